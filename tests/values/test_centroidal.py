"""The layout of centroidal states and inputs: complete, without overlap, and named wherever it is used."""

import re

import numpy as np

from quadpips_drake.values.centroidal import (
    INPUT_SIZE,
    STATE_SIZE,
    CentroidalInput,
    CentroidalState,
    centroidal_state,
    foot_forces,
)
from tests.source_tree import ROOT, files


def test_the_parts_make_up_the_whole():
    x, u = np.arange(STATE_SIZE), np.arange(INPUT_SIZE)
    parts = ("LINEAR", "ANGULAR", "POSITION", "ORIENTATION", "JOINTS")
    assert list(np.concatenate([x[getattr(CentroidalState, part)] for part in parts])) == list(x)
    assert list(x[CentroidalState.MOMENTUM]) + list(x[CentroidalState.CONFIGURATION]) == list(x)
    assert x[CentroidalState.ORIENTATION][2] == x[CentroidalState.YAW]
    assert list(u[CentroidalInput.FORCES]) + list(u[CentroidalInput.JOINT_VELOCITIES]) == list(u)


def test_a_state_is_put_together_from_its_parts():
    x = centroidal_state([1.0, 2.0, 3.0], [0.1, 0.2, 0.3], np.arange(12.0))
    assert not x[CentroidalState.MOMENTUM].any()
    assert list(x[CentroidalState.POSITION]) == [1.0, 2.0, 3.0]
    assert list(x[CentroidalState.ORIENTATION]) == [0.1, 0.2, 0.3]
    assert list(x[CentroidalState.JOINTS]) == list(range(12))
    moving = centroidal_state(np.zeros(3), np.zeros(3), np.zeros(12), momentum=np.arange(6.0))
    assert list(moving[CentroidalState.MOMENTUM]) == list(range(6))


def test_foot_forces_are_the_forces_leg_by_leg():
    u = np.arange(float(INPUT_SIZE))
    assert list(foot_forces(u)[1]) == [3.0, 4.0, 5.0]
    assert list(foot_forces(u)[:, 2]) == list(u[CentroidalInput.VERTICAL_FORCES])
    foot_forces(u)[2, 0] = -1.0
    assert u[6] == -1.0
    assert foot_forces(np.stack((u, u, u))).shape == (3, 4, 3)


def test_nobody_counts_through_the_layout():
    counted = re.compile(r"\[[^][]*\b(6:9|9:12|12:24)\]|\b(STATE|INPUT)_SIZE = \d")
    places = [
        f"{path.relative_to(ROOT)}: {line.strip()}"
        for path in files("*.py")
        if path.relative_to(ROOT).parts[0] in ("quadpips_drake", "diagrams") and path.name != "centroidal.py"
        for line in path.read_text(encoding="utf-8").splitlines()
        if counted.search(line)
    ]
    assert not places
