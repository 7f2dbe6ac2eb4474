"""The whole system: sees, plans and walks, the same way each time, and says so when it cannot."""

import json
from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.cli.run import resolve_trial_config
from quadpips_drake.errors import UserInputError
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.trials.trial import Trial, TrialConfig, run_trial
from tests.compare_logs import differences, read_log

pytestmark = pytest.mark.slow


def config(robot="anymal_c", sets=(), **options):
    return resolve_trial_config(None, {"robot": robot, "terrain": "flat", **options}, list(sets))


def steps_taken(trial):
    contacts = trial.log.arrays()["contacts"]
    return int((~contacts[:-1] & contacts[1:]).sum())


@pytest.mark.parametrize("robot", ["anymal_c", "go2"])
def test_short_walk_by_camera(robot):
    trial = Trial(config(robot, duration=3.0, seed=2))
    verdict = trial.run()
    log = trial.log.arrays()
    assert verdict.reason == "timeout"
    assert steps_taken(trial) >= 6
    assert log["p_WB"][-1, 0] - log["p_WB"][0, 0] > 0.15
    assert np.abs(log["rpy_WB"][:, :2]).max() < 0.15
    result = trial.result()
    assert result.footholds["planned"] >= 4
    assert result.footholds["missed"] == 0
    assert result.fallbacks["mpc"] == result.fallbacks["wbc"] == 0
    assert {"normals", "egocan", "superpixels", "foothold_search", "swing", "centroidal_mpc"} <= set(result.timings_ms)


def test_same_seed_same_log_to_the_bit():
    def log(seed):
        noise = ["stages.perception.depth_noise.sigma=0.002"]
        trial = Trial(config(terrain="stepping_stones", duration=1.6, seed=seed, sets=noise))
        trial.run()
        return trial.log.arrays()

    first, second, other = log(3), log(3), log(4)
    assert not differences(first, second)
    assert not np.array_equal(first["p_WB"], other["p_WB"])


def test_a_second_thread_changes_no_bit():
    def log(threads):
        trial = Trial(config(terrain="stepping_stones", duration=1.8, seed=3, latency="measured", threads=threads))
        trial.run()
        assert trial.result().timings_ms["swing_optimization"]["n"] == 1
        return trial.log.arrays()

    alone, beside = log(1), log(2)
    assert alone["phase"][-1] == 3, "it is expected to walk by then"
    assert not differences(alone, beside)


def test_a_recording_changes_no_bit(tmp_path):
    for recording in (True, False):
        wanted = config(terrain="stepping_stones", duration=1.2, seed=3)
        run_trial(wanted, tmp_path / str(recording), recording=recording)
        assert (tmp_path / str(recording) / "recording.html").is_file() == recording
    assert differences(*(read_log(tmp_path / str(recording)) for recording in (True, False))) == []


def test_no_foothold_is_planned_into_the_pit():
    trial = Trial(config(terrain="stepping_stones", duration=1.5, seed=1))
    trial.run()
    footholds = trial.log.arrays()["foothold_position"]
    truth = GroundTruth(trial.terrain)
    assert len(footholds) >= 4
    assert footholds[:, 0].max() > 0.2, "the plan is expected to lead onto the first stones"
    np.testing.assert_allclose(
        truth.height(footholds[:, 0], footholds[:, 1]), footholds[:, 2] - trial.robot.foot_radius, atol=0.02
    )
    assert truth.distance_to_edge(footholds[:, 0], footholds[:, 1]).min() > 0.01


def test_a_camera_that_sees_nothing_ends_in_no_plan():
    nothing_assumed = [f"stages.perception.egocan.ground.assumed_{where}=0" for where in ("behind", "ahead", "half_width")]
    blind = ["stages.perception.depth_noise.dropout=1.0", "stages.planning.torso.assume_start_ground=false"]
    trial = Trial(config(duration=30.0, sets=blind + nothing_assumed))
    verdict = trial.run()
    assert verdict.reason == "no_plan"
    assert verdict.detail
    assert trial.result().fallbacks["failed_plans"] >= 3


@pytest.mark.parametrize("key", ["planning.swings.ocp.solver", "tracking.mpc.ocp.solver", "tracking.wbc.solver"])
def test_a_solver_that_always_fails_is_survived_and_counted(key):
    trial = Trial(config(duration=2.0, sets=[f"stages.{key}=failing"]))
    verdict = trial.run()
    result = trial.result()
    assert verdict.reason in ("timeout", "no_plan", "fell")
    assert sum(result.fallbacks.values()) > 0


def test_refused_start_is_written_down(tmp_path):
    with pytest.raises(UserInputError, match="start"):
        run_trial(config(terrain="stepping_stones", start=[0.75, 0.2, 0.0]), tmp_path, recording=False)
    document = json.loads((tmp_path / "result.json").read_text())
    assert document["reason"] == "error"
    assert "start" in document["detail"]


def test_refused_goal_names_the_goal():
    with pytest.raises(UserInputError, match="goal"):
        Trial(config(goal=[500.0, 0.0]))


def test_seed_moves_the_start_unless_told_not_to():
    base = config(duration=1.0)
    starts = [Trial(replace(base, seed=seed)).start for seed in (0, 1, 1)]
    assert not np.array_equal(starts[0], starts[1])
    assert np.array_equal(starts[1], starts[2])
    asked_for = replace(base, start=[0.1, 0.2, 0.3])
    assert 0.0 < np.abs(Trial(asked_for).start - [0.1, 0.2, 0.3]).max() <= 0.05
    still = replace(asked_for, start_position_noise=0.0, start_yaw_noise=0.0)
    assert np.array_equal(Trial(still).start, [0.1, 0.2, 0.3])


def test_impossible_trials_are_refused():
    for wrong in ({"planner": "dreams"}, {"duration": -1.0}, {"start": [0.0]}, {"goal": [np.nan, 0.0]}, {"seed": -1}):
        with pytest.raises(UserInputError):
            TrialConfig(**wrong)
