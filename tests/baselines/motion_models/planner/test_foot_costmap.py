"""Where feet may come down: hand-made heights, the terrains of the study, from the truth and from remembered ground."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator

from quadpips_drake.baselines.motion_models.planner.foot_costmap import (
    FootCostmap,
    FootCostmapConfig,
    exact_costmap,
    foot_costmap,
)
from quadpips_drake.baselines.motion_models.planner.foot_costmap_system import FootCostmapBuilder, OracleFootCostmap
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.regions import GroundHeights

CELL = 0.01


def costmap_of(height, **settings) -> FootCostmap:
    return foot_costmap(GroundHeights(2.0, np.zeros(2), CELL, np.float32(height)), FootCostmapConfig(**settings))


def test_level_ground_is_safe_up_to_its_border():
    found = costmap_of(np.zeros((30, 20)))
    assert found.safe.all() and found.stamp == 2.0
    assert found.distance[0, 0] == pytest.approx(CELL), "what lies outside is unknown"
    assert found.distance[15, 10] == pytest.approx(10 * CELL)


def test_unknown_ground_is_unsafe_and_distances_are_straight():
    height = np.zeros((41, 41))
    height[20, 20] = np.nan
    found = costmap_of(height)
    assert not found.safe[20, 20] and np.isnan(found.height[20, 20])
    assert found.safe[20, 21]
    np.testing.assert_allclose(found.distance[[23, 24, 20], [24, 23, 31]], [5 * CELL, 5 * CELL, 10 * CELL], rtol=0.02)


def test_a_step_is_unsafe_along_its_edge_when_it_is_too_high():
    height = np.zeros((40, 10))
    height[20:] = 0.05
    found = costmap_of(height)
    assert (~found.safe).any(axis=1).nonzero()[0].tolist() == [19, 20]
    assert costmap_of(height, max_height_range=0.06).safe.all()
    gentle = np.linspace(0.0, 0.4, 40)[:, None] * np.ones(10)  # 45 degrees: 2 cm over three cells
    assert costmap_of(gentle).safe.all()


def test_without_ground_nothing_is_safe():
    assert not costmap_of(np.full((5, 5), np.nan)).safe.any()
    empty = foot_costmap(GroundHeights.empty(), FootCostmapConfig())
    assert empty.height.shape == (0, 0)
    height, distance = empty.at(np.zeros((2, 2)))
    assert np.isnan(height).all() and (distance == 0.0).all()


def test_points_are_looked_up_in_their_cells():
    height = np.zeros((10, 10))
    height[3:, :] = 0.01
    found = costmap_of(height)
    z, distance = found.at(np.array([[0.029, 0.05], [0.031, 0.05], [-0.001, 0.05], [0.05, 0.101]]))
    np.testing.assert_allclose(z, [0.0, 0.01, np.nan, np.nan], atol=1e-7)
    assert (distance[:2] > 0.0).all() and (distance[2:] == 0.0).all()


GAPS = {
    "gaps_symmetric": [((0.05, 0.2), False), ((0.5, 0.2), True), ((1.125, -0.2), False), ((-0.5, 0.0), True)],
    "gaps_staggered": [((0.07, 0.2), False), ((0.07, -0.2), True), ((0.37, -0.2), False), ((0.37, 0.2), True)],
    "gaps_and_steps": [((0.05, 0.0), False), ((1.1, 0.2), False), ((1.1, -0.2), True), ((2.78, -0.2), False)],
}


@pytest.mark.parametrize("name", GAPS)
def test_exact_maps_of_the_terrains(name):
    truth = GroundTruth(load_terrain(name))
    for (x, y), is_safe in GAPS[name]:
        found = exact_costmap(truth, 1.0, np.array([x, y]), FootCostmapConfig())
        _, distance = found.at(np.array([[x, y]]))
        assert (distance[0] > 0.0) == is_safe, (x, y)
    # Everywhere: never safe where there is no ground to walk on.
    rng = np.random.default_rng(0)
    points = np.column_stack((rng.uniform(-1.0, 2.0, 4000), rng.uniform(-1.4, 1.4, 4000)))
    found = exact_costmap(truth, 1.0, np.array([0.5, 0.0]), FootCostmapConfig())
    height, distance = found.at(points)
    walkable = np.isfinite(truth.height(*points.T, walkable_only=True))
    assert not (distance[~walkable] > 0.0).any()
    assert (distance[walkable] > 0.0).mean() > 0.85
    known = distance > 0.0
    np.testing.assert_allclose(height[known], truth.height(*points.T)[known], atol=1e-6)


def test_edges_of_steps_are_unsafe_on_both_sides():
    truth = GroundTruth(load_terrain("gaps_and_steps"))
    found = exact_costmap(truth, 0.0, np.array([3.8, 0.0]), FootCostmapConfig())
    x = np.array([3.77, 3.795, 3.805, 3.83])
    height, distance = found.at(np.column_stack((x, np.zeros(4))))
    np.testing.assert_allclose(height, [0.0, 0.0, 0.06, 0.06], atol=1e-6)
    assert ((distance > 0.0) == [True, False, False, True]).all()


def test_the_builder_maps_what_is_remembered():
    system = FootCostmapBuilder()
    context = system.CreateDefaultContext()
    port = system.GetInputPort("ground_heights")
    port.FixValue(context, AbstractValue.Make(GroundHeights(3.0, np.zeros(2), CELL, np.zeros((9, 9), np.float32))))
    found = system.GetOutputPort("foot_costmap").Eval(context)
    assert found.safe.all() and found.stamp == 3.0
    port.FixValue(context, AbstractValue.Make(GroundHeights.empty()))
    assert system.GetOutputPort("foot_costmap").Eval(context).height.size == 0


def test_the_oracle_moves_its_map_with_the_robot():
    robot, system = load_robot("anymal_c"), OracleFootCostmap(load_terrain("gaps_symmetric"))
    simulator = Simulator(system)
    context = simulator.get_mutable_context()

    def map_at(x: float, time: float) -> FootCostmap:
        state = standing_state(robot, time)
        moved = replace(state, p_WB=state.p_WB + np.array([x, 0.0, 0.0]))
        system.GetInputPort("robot_state").FixValue(context, AbstractValue.Make(moved))
        simulator.AdvanceTo(time)
        return system.GetOutputPort("foot_costmap").Eval(context)

    first, near, far = map_at(0.0, 0.1), map_at(0.2, 0.2), map_at(1.0, 0.3)
    assert near.stamp > first.stamp and near.height is first.height, "only looked after"
    assert far.corner[0] - first.corner[0] == pytest.approx(1.0)
    assert far.at(np.array([[1.125, 0.2]]))[1][0] == 0.0
