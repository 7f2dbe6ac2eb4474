"""Material for the tests of this stage: a trotting task, a plan over uneven footholds, finite differences."""

import numpy as np

from quadpips_drake.gaits.swing_gaits import swing_gait
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.trajectory.ocp.tracking_task import TrackingTask
from quadpips_drake.trajectory.swing.swing_trajectory import SwingSpline
from quadpips_drake.values.centroidal import CentroidalState as State
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import FootholdPlan, Stance
from quadpips_drake.values.robot_state import RobotState

DIAGONALS = (Leg.RF, Leg.LH), (Leg.LF, Leg.RH)


def trot_task(model, num_knots, horizon=1.0, speed=0.3, half_period=0.35, yaw=0.0) -> tuple[np.ndarray, TrackingTask]:
    """A state standing at the origin and the task to trot from there along its heading."""
    heading = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    turn = yaw_matrix(yaw)
    x0 = model.nominal_state()
    x0[State.YAW] = yaw
    x0[State.POSITION] = turn @ x0[State.POSITION]
    times = np.linspace(0.0, horizon, num_knots + 1)
    x_ref = np.tile(x0, (num_knots + 1, 1))
    x_ref[:, State.POSITION] += speed * times[:, None] * heading
    x_ref[:, 0:3] = speed * heading
    stance = np.ones((num_knots, 4), dtype=bool)
    foot_p, foot_v = np.tile(model.foot_positions(x0), (num_knots + 1, 1, 1)), np.zeros((num_knots + 1, 4, 3))
    stride = 2.0 * half_period * speed * heading
    for cycle in range(int(np.ceil(horizon / half_period))):
        start, end = cycle * half_period, (cycle + 1) * half_period
        for leg in DIAGONALS[cycle % 2]:
            point = foot_p[-1, leg].copy()
            spline = SwingSpline(point, point + stride, start, end)
            later = times >= start - 1e-9
            foot_p[later, leg], foot_v[later, leg] = spline.position(times[later]), spline.velocity(times[later])
            foot_p[-1, leg] = point + stride
            middles = 0.5 * (times[1:] + times[:-1])
            stance[(middles > start) & (middles < end), leg] = False
    u_ref = np.array([model.gravity_compensation(flags) for flags in stance])
    return x0, TrackingTask(times, x_ref, u_ref, stance, foot_p, foot_v, np.tile([0.0, 0.0, 1.0], (num_knots, 4, 1)))


def uneven_plan(robot, swings=4, step=0.2, legs=DIAGONALS, regions=(None,) * 4, **fields) -> FootholdPlan:
    """A plan of ``swings`` swings forward over footholds of different heights."""
    rng = np.random.default_rng(0)
    radius, height = robot.foot_radius, robot.nominal_base_height
    nominal = robot.nominal_footholds_B + np.array([0.0, 0.0, height - radius])
    normals = np.tile([0.0, 0.0, 1.0], (4, 1))
    feet, stances, order = nominal.copy(), [], []
    for k in range(swings + 1):
        if k > 0:
            order.append(legs[(k - 1) % len(legs)])
            for leg in order[-1]:
                feet[leg, 0] += step / 2 if k in (1, swings) else step
                feet[leg, 1:] = nominal[leg, 1] + rng.uniform(-0.02, 0.02), rng.uniform(0.0, 0.04)
        base = np.array([feet[:, 0].mean() - nominal[:, 0].mean(), 0.0, height + feet[:, 2].mean()])
        stances.append(Stance(feet.copy(), normals, regions, base, np.zeros(3)))
    gait = swing_gait("standing_trot")
    durations = gait.swing_duration, gait.stance_duration
    return FootholdPlan(0.0, 1, tuple(stances), tuple(order), gait.name, *durations, **fields)


def robot_state_of(model, x) -> RobotState:
    """A measurement of a robot at rest in the pose of ``x``."""
    zero = np.zeros(3)
    return RobotState(
        0.0,
        x[State.POSITION],
        x[State.ORIENTATION],
        np.eye(3),
        zero,
        zero,
        x[State.JOINTS],
        np.zeros(12),
        np.zeros(12),
        np.zeros((4, 3)),
        np.ones(4, bool),
    )


def central_difference(function, z, step=1e-6):
    """Derivative of ``function`` at ``z``; the last axis is that of z."""
    columns = [(function(z + step * e) - function(z - step * e)) / (2 * step) for e in np.eye(len(z))]
    return np.stack(columns, axis=-1)
