"""What a trial's configuration gets from the terrain that it is on."""

import pytest

from quadpips_drake.trials.trial import TrialConfig
from quadpips_drake.trials.trial_options import load_trial_config


def further_cameras(**options):
    return load_trial_config(TrialConfig, **options).stages.station.further_cameras


@pytest.mark.parametrize(
    ("robot", "terrain", "cameras"),
    [("anymal_c", "parallel_beams", ["left", "right"]), ("anymal_c", "balance_beam", []), ("go2", "parallel_beams", [])],
)
def test_a_terrain_may_ask_for_cameras_that_the_robot_has(robot, terrain, cameras):
    assert further_cameras(robot=robot, terrain=terrain) == cameras
    assert TrialConfig(robot=robot, terrain=terrain).stages.station.further_cameras == cameras


def test_what_is_set_counts_more():
    assert further_cameras(terrain="parallel_beams", sets=("stages.station.further_cameras=[]",)) == []
    assert further_cameras(terrain="flat", sets=("stages.station.further_cameras=[rear]",)) == ["rear"]
