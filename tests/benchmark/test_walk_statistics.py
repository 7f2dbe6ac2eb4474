"""Statistics of walks, and the bookkeeping of the robustness study."""

import numpy as np
import pytest

from quadpips_drake.benchmark import robustness
from quadpips_drake.benchmark.walk_statistics import FootholdBook, walk_statistics
from quadpips_drake.control.walk_command import WalkCommand, command_at
from quadpips_drake.robots.legs import Leg
from quadpips_drake.trajectory.reference import ContactSchedule, FootholdTarget, WholeBodyReference


def _circle(speed=0.4, rate=0.5, duration=6.0):
    """Log of a robot that goes round a circle to the left at constant speed, from 1 s on."""
    time = np.arange(0.0, duration + 1e-9, 0.01)
    yaw = rate * time
    zero = 0.0 * time
    return {
        "time": time,
        "rpy_WB": np.column_stack((0.1 * np.sin(time), zero, yaw)),
        "v_WB": speed * np.column_stack((np.cos(yaw), np.sin(yaw), zero)),
        "w_WB": np.column_stack((zero, zero, rate + zero)),
        "p_WB": np.column_stack((zero, zero, 0.3 + zero)),
        "foot_positions": np.zeros((len(time), 4, 3)),
    }


def test_velocities_are_those_in_the_heading_frame():
    commands = [WalkCommand(0.5, "trot", [0.5, 0.0, 0.5]), WalkCommand(5.0, "pace", [0.0, 0.0, 0.0])]
    statistics = walk_statistics(_circle(), commands)
    first, second = statistics["commands"]
    assert first["mean_velocity"] == pytest.approx([0.4, 0.0, 0.5], abs=1e-3)
    assert first["error"] == pytest.approx([-0.1, 0.0, 0.0], abs=1e-3)
    assert (first["from"], first["to"]) == (2.5, 5.0)
    assert "mean_velocity" not in second, "less than the time to accelerate"
    assert statistics["max_tilt"] == pytest.approx(0.1, abs=1e-3)
    assert command_at(commands, 4.0).gait == "trot"
    assert command_at(commands, 0.2).gait == "stance"


def test_the_last_word_on_a_foothold_counts():
    book = FootholdBook()
    for time, x in ((0.9, 0.0), (1.0, 0.1), (1.2, 0.2), (1.5, 0.3)):
        target = FootholdTarget(Leg.LF, 1.0, 1.3, np.array([x, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
        samples = np.zeros((2, 24))
        schedule = ContactSchedule.standing()
        book.note(WholeBodyReference(time, 1, np.array([time, time + 1]), samples, samples, schedule, (target,)), time)
    reference = book.reference(2.0)
    assert [target.position[0] for target in reference.footholds] == [0.2]
    assert reference.schedule.swings(Leg.LF) == [pytest.approx((1.0, 1.3))]


def test_the_study_bisects_and_repeats_nothing(monkeypatch, tmp_path):
    asked = []

    def survives(name, size, robot, folder, seed):
        asked.append(size)
        return {"size": size, "survived": size < 0.31, "detail": "", "max_tilt": 0.0}

    monkeypatch.setattr(robustness, "survives", survives)
    trials = robustness.study("payload", "go2", tmp_path, 0, [])
    assert asked[0] == 0.2, "the target comes first"
    assert robustness.largest_survived(trials) == pytest.approx(0.3, abs=0.05)
    count = len(asked)
    assert robustness.study("payload", "go2", tmp_path, 0, trials) == trials
    assert len(asked) == count
    assert "| payload [of the mass] | 0.3" in robustness.table({"go2/payload": trials})
    assert "not run" in robustness.table({"go2/payload": trials})


@pytest.mark.parametrize("name", robustness.DISTURBANCES)
def test_every_disturbance_makes_a_valid_trial(name, tmp_path):
    from quadpips_drake.benchmark.trial_options import resolve_config
    from quadpips_drake.benchmark.walk_trial import WalkTrialConfig
    from quadpips_drake.terrain.library import load_terrain

    disturbance = robustness.DISTURBANCES[name]
    options, sets = disturbance.trial(0.5 * (disturbance.least + disturbance.most), "go2", tmp_path)
    config = resolve_config(WalkTrialConfig, None, {"robot": "go2", **options}, sets)
    terrain = load_terrain(config.terrain, start=config.start or None)
    assert terrain.problem_with_start() is None
