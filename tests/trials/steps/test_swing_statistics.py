"""Clearance of swings against the true terrain, and feasibility of what was in force."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.penetration import sphere_depths
from quadpips_drake.terrain.terrain import Box, Cylinder, Mesh, Terrain, pose
from quadpips_drake.trajectory.swing.swing_optimizer import SwingOptimizer
from quadpips_drake.trials.steps.foothold_statistics import ends_in_force, foothold_statistics, swing_statistics
from quadpips_drake.values.centroidal import CentroidalInput
from tests.trajectory.walking import uneven_plan


def terrain_of(*elements) -> Terrain:
    floor = Box(X_WE=pose((0.0, 0.0, -0.1)), size=[8.0, 8.0, 0.2])
    return Terrain("test", np.zeros(3), np.array([2.0, 0.0]), 1.0, (floor, *elements))


def test_depths_of_spheres():
    barrier = Box(X_WE=pose((1.0, 0.0, 0.1), (0.0, 0.0, 0.5)), size=[0.1, 1.0, 0.2])
    post = Cylinder(X_WE=pose((2.0, 0.0, 0.5)), radius=0.2, length=1.0)
    roof = Mesh(
        X_WE=pose((3.0, 0.0, 0.3)), vertices=[[-1, -1, 0], [1, -1, 0], [0, 1, 0]], triangles=[[0, 1, 2]], label=post.label
    )
    world = terrain_of(barrier, post, roof)
    centers = np.array([
        [0.0, 0.0, 0.05], [0.0, 0.0, 0.02], [1.0, 0.0, 0.19], [1.0, 0.0, 0.235], [2.22, 0.0, 0.5], [3.0, 0.0, 0.32],
        [3.0, 0.0, 0.35], [9.0, 0.0, 0.0],
    ])  # fmt: skip
    np.testing.assert_allclose(sphere_depths(world, centers, 0.03), [0, 0.01, 0.04, 0, 0.01, 0.01, 0, 0], atol=1e-9)


@pytest.fixture(scope="module")
def walked():
    """A robot, a reference, and a log of it as if the feet had gone exactly where they should."""
    robot = load_robot("anymal_c")
    optimizer = SwingOptimizer(robot)
    plan = uneven_plan(robot, swings=2)
    reference = optimizer.optimize(optimizer.model.nominal_state(), plan).reference
    feet = np.array([optimizer.model.foot_positions(x) for x in reference.states])
    stance = np.array([reference.schedule.at(t) for t in reference.times])
    log = {"time": np.array(reference.times), "foot_positions": feet, "contacts": stance, "reference_p_WB": feet[:, 0]}
    return robot, reference, log


def test_swings_over_nothing_are_clear_and_feasible(walked):
    robot, reference, arrays = walked
    found = swing_statistics([reference], arrays, robot, terrain_of())
    assert found == {"swings": 4, "infeasible": 0, "touches": 0, "worst_m": 0.0, "executed_worst_m": 0.0}


def test_what_stands_in_the_way_is_measured(walked):
    robot, reference, arrays = walked
    middle = arrays["foot_positions"][25, reference.footholds[0].leg]
    height = middle[2] - robot.foot_radius + 0.025
    wall = Box(X_WE=pose((middle[0], middle[1], height - 0.5)), size=[0.3, 0.3, 1.0])
    found = swing_statistics([reference], arrays, robot, terrain_of(wall))
    assert found["worst_m"] > 0.02 and found["executed_worst_m"] == pytest.approx(found["worst_m"], abs=5e-3)
    contacts = arrays["contacts"].copy()
    contacts[24, reference.footholds[0].leg] = True
    assert swing_statistics([reference], arrays | {"contacts": contacts}, robot, terrain_of())["touches"] == 1


def test_swings_of_a_reference_that_was_dropped_do_not_count(walked):
    robot, reference, arrays = walked
    positions = arrays["reference_p_WB"].copy()
    positions[70:] = np.nan  # in the middle of the second swing
    dropped = arrays | {"reference_p_WB": positions}
    assert ends_in_force([reference], dropped) == [arrays["time"][70]]
    assert ends_in_force([reference], arrays) == [np.inf]
    assert swing_statistics([reference], dropped, robot, terrain_of())["swings"] == 2
    samples = arrays["time"], arrays["foot_positions"], arrays["contacts"]
    assert foothold_statistics([reference], *samples, until=ends_in_force([reference], dropped))["planned"] == 2


def test_swings_that_nothing_moves_are_infeasible(walked):
    robot, reference, arrays = walked
    inputs = np.array(reference.inputs)
    inputs[:50, CentroidalInput.FORCES] *= 1.3
    assert swing_statistics([replace(reference, inputs=inputs)], arrays, robot, terrain_of())["infeasible"] == 2
    moved = tuple(replace(f, position=f.position + 0.1) for f in reference.footholds[:1]) + reference.footholds[1:]
    assert swing_statistics([replace(reference, footholds=moved)], arrays, robot, terrain_of())["infeasible"] == 1
