"""The study of crossings: which there are, what is kept, what the tables say."""

import json

import cv2
import numpy as np
import pytest

from quadpips_drake.benchmark.motion_models.course_picture import save_course_picture, shown_crossings
from quadpips_drake.benchmark.motion_models.crossing_tables import PAPER, pooled_errors, table_2, table_of_crossings
from quadpips_drake.benchmark.motion_models.crossings import (
    TERRAINS,
    check_models,
    crossings_of,
    known_horizons,
    landings,
    run_crossings,
)
from quadpips_drake.errors import UserInputError
from tests.cli.test_run import quadpips


def result(success=True, deepest=0.0, mae=0.005, mean=-0.001, steps=10, **more) -> dict:
    errors = {"steps": steps, **{name: {"mae": mae, "mean": mean, "mae_y": 0.0} for name in ("cdm", "fdm", "cvm")}}
    return {
        "success": success,
        "clean": success and deepest <= 0.05,
        "touch_downs": 60,
        "unsafe": int(deepest > 0.0),
        "deepest_m": deepest,
        "replans": 30,
        "fallbacks": {"rest_of_last_plan": 2, "mpc": 5, "unstable_slip": 1},
        "planning": {"plans": 31, "cumulative_cost": 50.0, "search_ms": 0.25, "expansions": 20.0, "errors": errors},
        **more,
    }


def some(models=("learned",), horizons=(3, 7), seeds=(0, 1)):
    return crossings_of(["anymal_c"], ["gaps_symmetric"], horizons, models, ["oracle"], seeds)


def test_which_crossings_there_are():
    crossings = crossings_of(["anymal_c", "go2"], TERRAINS, [3, 5, 7], ["learned", "blind"], ["oracle"], range(5))
    assert len(crossings) == 2 * 3 * (3 + 1) * 5
    assert len({crossing.key for crossing in crossings}) == len(crossings)
    assert {c.horizon for c in crossings if c.model == "blind"} == {0}
    assert [crossing.seed for crossing in crossings[:24]] == [0] * 24, "seed by seed"


def test_their_configurations():
    first = some(("learned", "quadpips"))[0].config()
    assert first.planner == "motion_models" and first.stages.region_source == "oracle"
    assert first.stages.motion_models.planner.search.horizon == 3
    (rival,) = (c.config() for c in some(("quadpips",), seeds=(4,)))
    assert rival.planner == "quadpips" and rival.seed == 4
    (camera,) = crossings_of(
        ["go2"], ["gaps_staggered"], [5], ["ideal"], ["camera"], [1], ("stages.motion_models.gait=slow_trot",)
    )
    config = camera.config()
    assert config.stages.region_source == "superpixels" and config.stages.motion_models.gait == "slow_trot"
    assert "slow_trot" in camera.key


def test_pushes_are_part_of_a_crossing():
    (pushed,) = crossings_of(["anymal_c"], ["gaps_symmetric"], [7], ["blind"], ["oracle"], [0], push=10.0)
    (push,) = pushed.config().pushes
    assert push.force == [0.0, 100.0, 0.0] and push.duration == 0.1
    assert "push 10" in pushed.key and pushed.key != some(("blind",), seeds=(0,))[0].key


def test_what_is_there_is_not_computed_again(tmp_path):
    crossings = some()
    results = {crossing.key: result() for crossing in crossings}
    study = run_crossings(crossings, tmp_path, results)
    assert study.results == results and not study.failed


def test_table_2_puts_ours_beside_the_papers():
    crossings = some()
    results = {crossing.key: result(success=crossing.seed == 0) for crossing in crossings}
    text = table_2(results, crossings)
    assert "| gaps_symmetric | success, % | 100 / 100 / 100 | 50 / 50 |" in text
    assert "| gaps_symmetric | cumulative cost | 32.6 / 23.96 / 20.95 | 50 / 50 |" in text
    assert "0.0050 (-0.0010)" in text
    assert set(PAPER) == set(TERRAINS)
    assert " -" in table_2({}, crossings)


def test_the_table_of_crossings_tells_success_from_clean_success():
    crossings = some(horizons=(7,))
    results = {c.key: result(deepest=0.08 if c.seed else 0.0) for c in crossings}
    line = table_of_crossings(results, crossings).splitlines()[2]
    assert "| 2/2 (34 to 100 %) | 1/2 (9 to 91 %) | 1 of 120 | 8.0 | 30 | 4 |" in line
    assert table_of_crossings({}, crossings).count("\n") == 1


def test_landings_are_where_feet_come_down_again():
    contacts = np.ones((6, 4), bool)
    contacts[1:3, 0] = contacts[2:5, 3] = False
    feet = np.zeros((6, 4, 3))
    feet[3, 0], feet[5, 3] = (0.51234, 0.2, 0.02), (-0.1, -0.25, 0.02)
    assert landings({"contacts": contacts, "foot_positions": feet}) == [[0, 0.512, 0.2], [3, -0.1, -0.25]]


def test_the_picture_shows_the_first_crossing_of_each_course(tmp_path):
    crossings = crossings_of(["anymal_c", "go2"], ["gaps_symmetric"], [7], ["ideal", "learned"], ["oracle"], [3, 4])
    landed = [[leg, 0.1 * k, 0.2 - 0.4 * (leg % 2)] for k, leg in enumerate((0, 1, 2, 3))]
    results = {c.key: result(reason="goal_reached", landings=landed) for c in crossings if c.seed == 4 or c.robot == "go2"}
    shown = shown_crossings(results, crossings)
    assert [(c.robot, c.model, c.seed) for c in shown] == [("anymal_c", "learned", 4), ("go2", "learned", 3)]
    assert save_course_picture(results, crossings, tmp_path / "courses.png")
    height, width, _ = cv2.imread(str(tmp_path / "courses.png")).shape
    assert width > 900 and height > 400
    assert not save_course_picture({c.key: result() for c in crossings}, crossings, tmp_path / "none.png")
    assert not (tmp_path / "none.png").exists(), "results of before have no touch-downs"


def test_errors_are_weighted_by_steps():
    found = [result(mae=0.01, mean=0.0, steps=30), result(mae=0.02, mean=-0.02, steps=10), {"planning": {}}]
    assert pooled_errors(found, "fdm") == pytest.approx((0.0125, -0.005))
    assert pooled_errors([{"planning": {"errors": {"steps": 0}}}], "cdm") is None


@pytest.mark.parametrize("text", ["", "0", "3,x", "21", "3,,5", "-3"])
def test_horizons_are_checked(text):
    with pytest.raises(UserInputError, match="--horizons"):
        known_horizons(text)
    assert known_horizons("3,5,7") == [3, 5, 7]


def test_unknown_models_and_maps_are_named():
    with pytest.raises(UserInputError, match="known: blind, ideal, kinematic, learned, quadpips"):
        check_models(["anymal_c"], ["perfect"], ["oracle"])
    with pytest.raises(UserInputError, match="known: camera, oracle"):
        check_models(["anymal_c"], ["blind"], ["paper"])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--models", "perfect"), "unknown model 'perfect'"),
        (("--terrains", "moon"), "unknown terrain 'moon'"),
        (("--horizons", "0"), "--horizons '0'"),
        (("--map", "atlas"), "unknown map 'atlas'"),
        (("--robots", "cat"), "unknown robot 'cat'"),
        (("--models", "blind", "--set", "stages.motion_models.planner.search.speed_step=0"), "speed_step"),
    ],
)
def test_bad_input_ends_with_one_line(options, words, tmp_path):
    status, _, errors = quadpips("evaluate", "motion-models", *options, "--out", tmp_path / "study")
    assert (status, errors.count("\n")) == (2, 1), errors
    assert words in errors


def test_a_finished_study_prints_its_tables(tmp_path):
    crossings = some(("kinematic",), horizons=(7,))
    (tmp_path / "crossings.json").write_text(json.dumps({crossing.key: result() for crossing in crossings}))
    options = (
        "--robots",
        "anymal_c",
        "--terrains",
        "gaps_symmetric",
        "--models",
        "kinematic",
        "--horizons",
        "7",
        "--seeds",
        "0,1",
    )
    status, output, _ = quadpips("evaluate", "motion-models", *options, "--out", tmp_path)
    assert status == 0
    assert "| anymal_c | gaps_symmetric | oracle | kinematic | 7 | 2/2" in output
