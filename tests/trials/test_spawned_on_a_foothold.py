"""A box that appears on a foothold while the robot walks there."""

import pytest

from quadpips_drake.trials.loading import load_config
from quadpips_drake.trials.trial import Trial


@pytest.mark.slow
def test_a_box_on_a_foothold_is_noticed_and_no_foot_comes_down_on_it():
    config = load_config("anymal_c", terrain="flat", duration=6.6, spawn=["box:0.2,0.2,0.15@foothold@4"])
    trial = Trial(config)
    verdict = trial.run()
    result = trial.result()
    (spawned,) = result.spawned
    assert verdict.reason == "timeout", verdict.detail
    assert 4.0 <= spawned["at"] <= 5.5 and spawned["at"] < spawned["noticed"] < spawned["at"] + 0.3
    assert result.events == {"foothold_lost": 1} and not spawned["touched"]
    low, high = trial.present_terrain.elements[-1].bounds()
    coming = trial.log.references[-1].footholds
    assert coming, "it walks on"
    for foothold in coming:
        assert ((foothold.position < low - 0.1) | (foothold.position > high + 0.1))[:2].any()
