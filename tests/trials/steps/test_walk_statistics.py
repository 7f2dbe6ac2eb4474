"""Statistics of walks, and the bookkeeping of the studies of gaits and robustness."""

from functools import partial

import numpy as np
import pytest

from quadpips_drake.benchmark import gait_study, robustness
from quadpips_drake.benchmark.disturbances import DISTURBANCES, trial_options
from quadpips_drake.benchmark.study_pool import load_results, run_study
from quadpips_drake.control.references.velocity_reference import VelocityWalk
from quadpips_drake.control.references.walk_command import WalkCommand, command_at
from quadpips_drake.errors import UserInputError
from quadpips_drake.gaits.gaits import GAITS, load_gait
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.placement import problem_with_start
from quadpips_drake.trials.steps.walk_statistics import FootholdBook, stretches_of, walk_statistics
from quadpips_drake.trials.trial_options import resolve_config
from quadpips_drake.trials.walk_trial import WalkTrialConfig
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.reference import FootholdTarget, WholeBodyReference
from tests import trivial_jobs


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


def _told(log: dict, commands: list[WalkCommand]) -> dict:
    """The log with what was commanded in it."""
    at = [command_at(commands, time) for time in log["time"]]
    gaits = np.array([list(GAITS).index(command.gait) for command in at])
    return log | {"gait": gaits, "velocity_command": np.array([command.velocity for command in at])}


def _all_of_it(velocity, gait):
    return velocity


def test_velocities_are_those_in_the_heading_frame():
    commands = [WalkCommand(0.5, "trot", [0.5, 0.0, 0.5]), WalkCommand(5.0, "pace", [0.0, 0.0, 0.0])]
    statistics = walk_statistics(_told(_circle(), commands), _all_of_it)
    first, second = statistics["commands"]
    assert (first["gait"], first["begin"], first["end"]) == ("trot", 0.5, 5.0)
    assert (second["gait"], second["begin"], second["end"]) == ("pace", 5.0, 6.0)
    assert "feasible_velocity" not in first
    assert first["mean_velocity"] == pytest.approx([0.4, 0.0, 0.5], abs=1e-3)
    assert first["error"] == pytest.approx([-0.1, 0.0, 0.0], abs=1e-3)
    assert (first["from"], first["to"]) == (2.5, 5.0)
    assert "mean_velocity" not in second, "less than the time to accelerate"
    assert statistics["max_tilt"] == pytest.approx(0.1, abs=1e-3)
    assert command_at(commands, 4.0).gait == "trot"
    assert command_at(commands, 0.2).gait == "stance"


def test_what_was_walked_is_told_and_not_what_was_planned():
    commands = [WalkCommand(0.5, "trot", [0.3, 0.0, 0.0]), WalkCommand(99.0, "pace", [0.0, 0.0, 0.0])]
    (only,) = walk_statistics(_told(_circle(), commands), _all_of_it)["commands"]
    assert only["gait"] == "trot", "the walk was over before the other one"


def test_a_command_that_the_legs_cannot_follow_is_told_with_its_limit():
    walk = VelocityWalk(load_robot("go2"))

    def feasible(velocity, gait):
        return walk.feasible(velocity, load_gait(gait))

    statistics = walk_statistics(_told(_circle(), [WalkCommand(0.5, "trot", [50.0, 0.0, 0.0])]), feasible)
    (entry,) = statistics["commands"]
    assert entry["velocity"] == [50.0, 0.0, 0.0]
    assert 0.3 < entry["feasible_velocity"][0] < 2.0
    assert entry["feasible_velocity"][1:] == [0.0, 0.0]
    assert not feasible(np.array([0.3, 0.0, 0.0]), "stance").any()


def test_a_slider_that_is_moved_is_one_stretch():
    moved = [WalkCommand(2.0 + 0.05 * k, "trot", [0.05 * k, 0.0, 0.0]) for k in range(9)]
    log = _told(_circle(), [WalkCommand(0.0, "trot", [0.0, 0.0, 0.0]), *moved])
    first, moving, last = stretches_of(log)
    assert (first.gait, first.begin, first.varies) == ("trot", 0.0, False)
    assert moving.varies
    assert (moving.begin, moving.end) == pytest.approx((2.05, 2.4))
    assert moving.velocity[0] == pytest.approx(0.2, abs=0.01)
    assert (last.velocity[0], last.end) == pytest.approx((0.4, 6.0))


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


def tried(name, seeds, trials, survives, bisect=True):
    """Runs what is wanted of a disturbance of Go2 until nothing is; returns all trials in order."""
    trials = list(trials)
    while wanted := robustness.wanted_trials(name, "go2", seeds, trials, bisect=bisect):
        trials += [{"size": size, "seed": seed, "survived": survives(size, seed)} for size, seed in wanted]
    return trials


def test_the_study_tries_the_target_with_all_seeds_bisects_with_the_first_and_repeats_nothing():
    def survives(size, seed):
        return size < 0.31 and (size, seed) != (0.2, 9)

    trials = tried("payload", [8, 9], [], survives)
    asked = [(trial["size"], trial["seed"]) for trial in trials]
    assert asked[:2] == [(0.2, 8), (0.2, 9)], "the target comes first"
    assert {seed for _, seed in asked[2:]} == {8} and len(set(asked)) == len(asked)
    first = [trial for trial in trials if trial["seed"] == 8]
    assert robustness.largest_survived(first) == pytest.approx(0.3, abs=0.05)
    assert tried("payload", [8, 9], trials, survives) == trials
    results = {"go2/payload": trials, "go2/bumps": trials, "anymal_c/payload": trials}
    table = robustness.table(results, ["go2"], ["payload"])
    assert "| payload [of the mass] | 0.2 | 1/2 | 0.3" in table
    assert len(table.splitlines()) == 3 and "anymal_c" not in table, "only what was asked for"
    assert "no result" in robustness.table(results, ["go2"], ["payload", "slope_up"])


def test_bisection_begins_in_the_middle_where_there_is_no_target():
    assert robustness.wanted_trials("actuator_delay", "go2", [1, 2], []) == [(pytest.approx(0.02), 1)]
    assert robustness.wanted_trials("actuator_delay", "go2", [1, 2], [], bisect=False) == []


def test_targets_alone():
    trials = tried("bumps", [1, 2], [], lambda size, seed: True, bisect=False)
    assert [(trial["size"], trial["seed"]) for trial in trials] == [(0.03, 1), (0.03, 2)]
    assert "| 0.03 | 2/2 | 0.03 or more |" in robustness.table({"go2/bumps": trials}, ["go2"], ["bumps"])


def test_the_trials_of_robustness_follow_from_each_other_and_are_kept_one_by_one(tmp_path, monkeypatch):
    def at_once(jobs, store, results, *, keep, **_):
        waiting = dict(jobs)
        while waiting:
            key = next(iter(waiting))
            job = waiting.pop(key)
            name, size, robot, _, seed = job.args
            asked.append((name, size, robot, seed))
            waiting |= keep(results, key, {"size": size, "seed": seed, "survived": True})
        return results

    asked = []
    monkeypatch.setattr(robustness, "run_study", at_once)
    options = {"bisect": False, "workers": 1}
    known = {"go2/bumps": [{"size": 0.03, "seed": 5, "survived": True}]}
    results = robustness.run_robustness(["go2"], ["bumps", "payload"], [5, 6], tmp_path, known, **options)
    assert asked == [("bumps", 0.03, "go2", 6), ("payload", 0.2, "go2", 5), ("payload", 0.2, "go2", 6)]
    assert [trial["seed"] for trial in results["go2/bumps"]] == [5, 6]


@pytest.mark.parametrize("name", DISTURBANCES)
def test_every_disturbance_makes_a_valid_trial_that_depends_on_the_seed(name, tmp_path):
    disturbance = DISTURBANCES[name]
    size = 0.5 * (disturbance.least + disturbance.most)
    options, sets = trial_options(name, size, "go2", tmp_path, 3)
    assert (options, sets) == trial_options(name, size, "go2", tmp_path, 3)
    assert options != trial_options(name, size, "go2", tmp_path, 4)[0] | {"seed": 3}
    config = resolve_config(WalkTrialConfig, None, options, sets)
    terrain = load_terrain(config.terrain, start=config.start or None)
    assert problem_with_start(terrain) is None


def test_results_are_kept_one_by_one_and_bad_files_refused(tmp_path):
    store = tmp_path / "some.json"
    assert load_results(store) == {}
    study = run_study({"a": partial(round, 2.7)}, store, {"b": 1}, workers=1, description="rounding")
    assert study.results == load_results(store) == {"a": 3, "b": 1} and not study.failed
    store.write_text("[1")
    with pytest.raises(UserInputError, match=r"some.json: .*remove it or choose another --out"):
        load_results(store)


def test_a_job_without_a_result_is_named_and_the_rest_goes_on(tmp_path, capsys):
    jobs = {"bad": partial(int, "x"), "killed": trivial_jobs.end_by_force, "good": partial(round, 2.7)}
    study = run_study(jobs, tmp_path / "some.json", {}, workers=1, description="jobs")
    assert study.results == load_results(tmp_path / "some.json") == {"good": 3}
    assert study.failed == ["bad", "killed"]
    lines = capsys.readouterr().err.splitlines()
    assert "bad: ValueError: invalid literal for int() with base 10: 'x'" in lines
    assert any(line.startswith("killed: its process ended abruptly (SIGKILL") for line in lines)


def test_the_table_of_gaits_tells_the_worst_error():
    def trial(vx, upright=True):
        return {"upright": upright, "mean_velocity": [vx, 0.0, 0.0], "max_tilt": 0.1, "landing_error_max": 0.012}

    table = gait_study.table({"go2/trot 0.4,0,0/1": trial(0.41), "go2/trot 0.4,0,0/2": trial(0.38, upright=False)})
    assert "| go2 | trot 0.4,0,0 | 1/2 | 0.395, 0.000, 0.000 | 5.0% | 0.10 | 12 |" in table
