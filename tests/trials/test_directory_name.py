"""Names of directories: readable, and another one for each trial."""

import re
from itertools import combinations

import pytest

from quadpips_drake.cli.run import default_directory as of_run
from quadpips_drake.cli.run import resolve_trial_config
from quadpips_drake.cli.walk import default_directory as of_walk
from quadpips_drake.cli.walk import resolve_walk_config


def walk(sets=(), **options):
    return of_walk(resolve_walk_config(None, {"robot": "go2", **options}, list(sets))).name


def run(sets=(), **options):
    return of_run(resolve_trial_config(None, {"robot": "go2", "terrain": "flat", **options}, list(sets))).name


def test_what_differs_can_be_read():
    assert run(seed=7) == "go2-flat-quadpips-7"
    assert run(goal=[4.0, 0.5]) == "go2-flat-quadpips-0-goal=4,0.5"
    assert walk() == walk(velocity=[0.3, 0.0, 0.0]) == "go2-flat-trot-0"
    assert walk(velocity=[0.5, 0.0, -0.25], duration=5.0) == "go2-flat-trot-0-duration=5-velocity=0.5,0,-0.25"


PUSHES = [{"force": [5.0, 0.0, 0.0], "time": 1.0, "duration": 0.1}]


@pytest.fixture(scope="module")
def names():
    return [
        walk(),
        walk(pushes=PUSHES),
        walk(pushes=[PUSHES[0] | {"time": 2.0}]),
        walk(["stages.station.model_error.payload=10"]),
        walk(["stages.station.model_error.payload=11"]),
        walk(["stages.station.model_error.friction=0.5"]),
        walk(["changes=[{time: 4, gait: pace}]"]),
        walk(velocity=[0.300000001, 0.0, 0.0]),
        walk(terrain="flat.yaml"),
        walk(terrain="elsewhere/flat.yaml"),
        walk(terrain="flat ; rm -r /../" + 300 * "x"),
        walk(start=[0.0, 0.0, 0.0]),
        run(),
        run(["stages.perception.superpixels.iterations=3"]),
    ]


def test_different_trials_have_different_names(names):
    assert all(a != b for a, b in combinations(names, 2)), names


def test_names_need_no_care(names):
    for name in names:
        assert re.fullmatch(r"[A-Za-z0-9._,=+-]{1,80}", name), name
        assert name.startswith("go2-")
