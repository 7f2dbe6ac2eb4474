"""A robot in the middle of a trot, for tests and benchmarks of whole-body control without a simulation."""

from dataclasses import replace

import numpy as np

from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.trajectory.swing.swing_trajectory import SwingSpline
from quadpips_drake.values.centroidal import CentroidalInput, CentroidalState
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.mpc_policy import MpcPolicy

TROT = np.array([True, False, False, True])


def feet(robot, state):
    """Foot centres in W [m], (4, 3)."""
    return robot.foot_positions_W(state)


def mid_trot(robot, stance=TROT):
    """State at 0.15 s into a swing of 0.3 s, and the policy behind it: feet that are not in ``stance`` swing."""
    state = replace(
        standing_state(robot, 0.15),
        v_WB=np.array([0.4, 0.03, -0.02]),
        w_WB=np.array([0.1, -0.1, 0.05]),
        joint_velocities=0.3 * np.sin(np.arange(12.0)),
        contacts=stance,
    )
    where = feet(robot, state)
    step, lift = np.array([0.12, 0.0, 0.0]), np.array([0.0, 0.0, 0.08])
    swings = tuple(
        () if down else (SwingSpline(p - lift - 0.5 * step, p - lift + 0.5 * step, 0.0, 0.3),)
        for p, down in zip(where, stance, strict=True)
    )
    x = np.zeros(24)
    x[CentroidalState.POSITION], x[CentroidalState.JOINTS] = state.p_WB, robot.nominal_joints
    u = np.zeros(24)
    u[CentroidalInput.VERTICAL_FORCES] = np.where(stance, GRAVITY * robot.mass / stance.sum(), 0.0)
    policy = MpcPolicy(
        stamp=0.14,
        times=np.array([0.14, 0.34]),
        states=np.stack((x, x)),
        inputs=u[None],
        base_twists=np.tile([0.0, 0.0, 0.0, 0.4, 0.0, 0.0], (2, 1)),
        schedule=ContactSchedule(np.array([0.0, 0.3]), np.stack((np.ones(4, bool), stance, np.ones(4, bool)))),
        swings=swings,
        normals=np.tile([0.0, 0.0, 1.0], (4, 1)),
        success=True,
    )
    return state, policy
