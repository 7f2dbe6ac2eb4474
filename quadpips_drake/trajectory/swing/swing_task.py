"""The task of one swing: reference, contacts, splines and regions on a uniform grid (QuadPiPS section VI-D)."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from quadpips_drake.math.angles import whole_turns
from quadpips_drake.math.rotations import body_rates, rotation_from_rpy
from quadpips_drake.math.small_algebra import store
from quadpips_drake.trajectory.centroidal.centroidal_model import CentroidalModel
from quadpips_drake.trajectory.ocp.tracking_task import TrackingTask
from quadpips_drake.trajectory.swing.ground_profile import KnownGround, region_halfspaces
from quadpips_drake.trajectory.swing.swing_trajectory import SwingConfig, SwingSpline
from quadpips_drake.trajectory.swing.target_configuration import TargetConfiguration
from quadpips_drake.values.centroidal import STATE_SIZE, CentroidalInput, CentroidalState
from quadpips_drake.values.legs import NUM_LEGS


@dataclass(frozen=True, eq=False)
class SwingSetup:
    """One swing, in its own time: all feet down, ``legs`` swing, all feet down."""

    legs: tuple
    liftoff_time: float
    """[s]"""
    touchdown_time: float
    """[s]"""
    duration: float
    """[s]"""
    num_knots: int
    targets: np.ndarray
    """Centres of the feet at touch-down in W [m], (4, 3)."""
    normals: np.ndarray
    """Upward normals under the feet before (first) and after the swing, (2, 4, 3)."""
    regions: tuple
    """PlanarRegion or None for each foot after the swing."""
    ground: KnownGround
    """That the swings pass over."""
    end: TargetConfiguration
    start_velocity: np.ndarray
    """Velocity of the base at the beginning that the reference has [m/s], (3,)."""
    end_velocity: np.ndarray
    """... and at the end [m/s], (3,)."""

    @property
    def times(self) -> np.ndarray:
        return np.linspace(0.0, self.duration, self.num_knots + 1)


def make_swing_task(model: CentroidalModel, x0, setup: SwingSetup, config: SwingConfig) -> tuple[TrackingTask, dict]:
    """Returns the tracking task from state ``x0`` (24,), and the SwingSpline of each swinging leg.

    Base: cubic between the present and the target pose with the given velocities. Swinging feet: splines. Joints: inverse
    kinematics of both. The forces carry the weight.
    """
    times = setup.times
    feet0 = model.foot_positions(x0)
    stance = np.ones((setup.num_knots, NUM_LEGS), dtype=bool)
    middles = 0.5 * (times[1:] + times[:-1])
    in_swing = (middles > setup.liftoff_time) & (middles < setup.touchdown_time)
    foot_p, foot_v = np.tile(feet0, (len(times), 1, 1)), np.zeros((len(times), NUM_LEGS, 3))
    normals = np.tile(setup.normals[0], (setup.num_knots, 1, 1))
    splines = {}
    for leg in setup.legs:
        stance[in_swing, leg] = False
        ends = feet0[leg], setup.targets[leg]
        spline = SwingSpline.plan(
            setup.liftoff_time,
            setup.touchdown_time,
            *ends,
            setup.normals[1, leg],
            config,
            liftoff_normal=setup.normals[0, leg],
            profile=setup.ground.profile(*ends, model.robot.foot_radius),
        )
        splines[leg] = spline
        path = spline.sample(times)
        foot_p[:, leg], foot_v[:, leg] = path[:, 0], path[:, 1]
        normals[:, leg] = spline.normal(times[:-1])
    x_ref, u_ref = _reference(model, x0, setup, times, foot_p, stance)
    halfspaces = _halfspaces(setup, stance, times)
    return TrackingTask(times, x_ref, u_ref, stance, foot_p, foot_v, normals, *halfspaces), splines


def _reference(model, x0, setup, times, foot_p, stance):
    angles = np.vstack((x0[CentroidalState.ORIENTATION], setup.end.rpy_WB))
    angles[1, 2] += whole_turns(angles[0, 2] - angles[1, 2])
    p_WB = x0[CentroidalState.POSITION]
    position, velocity = _hermite(p_WB, setup.end.p_WB, setup.start_velocity, setup.end_velocity, times)
    rpy, rpy_rate = _hermite(angles[0], angles[1], np.zeros(3), np.zeros(3), times)
    x_ref = np.zeros((len(times), STATE_SIZE))
    x_ref[:, CentroidalState.LINEAR] = velocity
    x_ref[:, CentroidalState.POSITION] = position
    x_ref[:, CentroidalState.ORIENTATION] = rpy
    joints, _ = model.robot.joints_following(position, rpy, foot_p, x0[CentroidalState.JOINTS])
    x_ref[:, CentroidalState.JOINTS] = joints
    inertia = model.locked_inertia(x0[CentroidalState.JOINTS]) / model.mass
    x_ref[:, CentroidalState.ANGULAR] = _spin(rpy, rpy_rate, inertia)
    u_ref = model.gravity_compensation(stance)
    joint_steps = np.diff(x_ref[:, CentroidalState.JOINTS], axis=0)
    u_ref[:, CentroidalInput.JOINT_VELOCITIES] = joint_steps / np.diff(times)[:, None]
    return x_ref, u_ref


@njit(cache=True)
def _spin(rpy, rates, inertia):
    """Angular momentum of a body with that ``inertia`` in its own frame, in W, while its attitude changes, (n, 3)."""
    out = np.empty((len(rpy), 3))
    for k in range(len(rpy)):
        store(out[k], rotation_from_rpy(rpy[k]) @ (inertia @ body_rates(rpy[k], rates[k])))
    return out


def _hermite(p0, p1, v0, v1, times):
    """Position and velocity (n, 3) of the cubic over ``times`` with these ends."""
    duration = times[-1]
    s = (times / duration)[:, None]
    d = p1 - p0
    c2, c3 = 3 * d - (2 * v0 + v1) * duration, -2 * d + (v0 + v1) * duration
    return p0 + v0 * duration * s + c2 * s**2 + c3 * s**3, v0 + (2 * c2 * s + 3 * c3 * s**2) / duration


def _halfspaces(setup, stance, times):
    """Regions of the legs that have landed, as rows normals @ p + offsets >= 0; the others keep zeros."""
    landed = times[:-1] >= setup.touchdown_time - 1e-9
    halfspaces = {leg: region_halfspaces(setup.regions[leg]) for leg in setup.legs if setup.regions[leg] is not None}
    if not halfspaces:
        return None, None
    rows = max(len(b) for _, b in halfspaces.values())
    normals, offsets = np.zeros((*stance.shape, rows, 3)), np.zeros((*stance.shape, rows))
    for leg, (a, b) in halfspaces.items():
        normals[landed, leg, : len(b)], offsets[landed, leg, : len(b)] = a, b
    return normals, offsets
