"""The signed distance on its way from the elevation map to the MPC, and what it does there."""

import dataclasses

import numpy as np
import pytest

from quadpips_drake.control.mpc.mpc_config import MpcConfig
from quadpips_drake.control.mpc.real_time_iteration import MpcMemory, RealTimeIteration
from quadpips_drake.diagrams.quadpips import QuadpipsConfig, QuadpipsDiagram
from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.trials.loading import load_config, load_walk_config
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.regions import SignedDistance

ROBOT = load_robot("anymal_c")


def config_of(source, enabled):
    config = QuadpipsConfig(region_source=source)
    config.tracking.mpc.ocp.sdf_clearance.enabled = enabled
    return config


@pytest.mark.parametrize("enabled", [False, True])
def test_it_is_worked_out_and_wired_only_if_the_mpc_wants_it(enabled):
    diagram = QuadpipsDiagram(ROBOT, load_terrain("flat"), config_of("elevation", enabled))
    context = diagram.CreateDefaultContext()
    tracking = diagram.tracking
    assert diagram.regions.HasOutputPort("signed_distance") == enabled
    assert tracking.GetInputPort("signed_distance").HasValue(tracking.GetMyContextFromRoot(context)) == enabled


def test_a_source_that_does_not_know_it_is_refused():
    with pytest.raises(UserInputError, match=r"sdf_clearance needs a region source.*elevation, not oracle"):
        QuadpipsDiagram(ROBOT, load_terrain("flat"), config_of("oracle", True))


def test_no_configuration_has_it_where_it_would_do_nothing():
    with pytest.raises(UserInputError, match="a walk sees no ground"):
        load_walk_config(sets=("stages.tracking.mpc.ocp.sdf_clearance.enabled=true",))
    for key in ("sdf_clearance.enabled", "max_step"):
        with pytest.raises(UserInputError, match=r"did you mean .*stages\.tracking\.mpc\.ocp\."):
            load_config(sets=(f"stages.planning.swings.ocp.{key}=1",))


def ground_at(height):
    """Level ground at ``height`` [m]."""
    z = np.linspace(-1.0, 1.0, 41)
    distance = np.broadcast_to((z - height).astype(np.float32), (41, 41, 41))
    return SignedDistance(0.0, np.full(3, -1.0), 0.05, distance)


def predicted(enabled, ground):
    """Heights of the base [m] that a standing robot's MPC predicts."""
    config = MpcConfig()
    config.ocp = dataclasses.replace(
        config.ocp, sdf_clearance=dataclasses.replace(config.ocp.sdf_clearance, enabled=enabled)
    )
    mpc, memory = RealTimeIteration(ROBOT, config), MpcMemory.empty()
    for _ in range(3):
        memory = mpc.compute(standing_state(ROBOT), WholeBodyReference.empty(), memory, ground=ground)
    assert memory.policy.success
    return memory.policy.states[:, CentroidalState.POSITION][:, 2]


def test_knees_that_are_too_low_lift_the_base_and_others_change_nothing():
    plain = predicted(False, ground_at(0.0))
    np.testing.assert_array_equal(predicted(False, ground_at(0.15)), plain, "off is off")
    np.testing.assert_array_equal(predicted(True, SignedDistance.empty()), plain)
    np.testing.assert_array_equal(predicted(True, ground_at(-0.5)), plain, "out of reach")
    _, origins = ROBOT.link_poses_B(standing_state(ROBOT).joint_positions)
    knees = standing_state(ROBOT).p_WB[2] + origins[3::3, 2].min()
    assert predicted(True, ground_at(knees - 0.09))[-1] > plain[-1] + 0.005
