"""The full centroidal model of a quadruped: momentum, base pose and joints driven by foot forces and joint velocities."""

import numpy as np
from numba import njit

from quadpips_drake.errors import unknown_name
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.math.rotations import rotation_from_rpy
from quadpips_drake.math.small_algebra import add, cross, scale, store, times, transpose_times, vector
from quadpips_drake.robots.kinematic_tree import KinematicTree
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.trajectory.centroidal.centroidal_derivatives import knot_derivatives
from quadpips_drake.trajectory.centroidal.centroidal_kernels import (
    POSITION,
    composite_terms,
    link_kinematics,
    motion_kernel,
)
from quadpips_drake.values.centroidal import INPUT_SIZE, STATE_SIZE, CentroidalInput, CentroidalState, centroidal_state
from quadpips_drake.values.robot_state import RobotState

MODEL_KINDS = ("centroidal", "single_rigid_body")


@njit(cache=True)
def _all_knots(tree, states, inputs):
    n = len(states)
    f, a, b = np.empty((n, STATE_SIZE)), np.empty((n, STATE_SIZE, STATE_SIZE)), np.empty((n, STATE_SIZE, INPUT_SIZE))
    p, v = np.empty((n, 4, 3)), np.empty((n, 4, 3))
    p_x, v_x, v_u = np.empty((n, 4, 3, STATE_SIZE)), np.empty((n, 4, 3, STATE_SIZE)), np.empty((n, 4, 3, INPUT_SIZE))
    for i in range(n):
        knot_derivatives(tree, states[i], inputs[i], f[i], a[i], b[i], p[i], v[i], p_x[i], v_x[i], v_u[i])
    return f, a, b, p, v, p_x, v_x, v_u


@njit(cache=True, nogil=True)
def _base_twists(tree, states, inputs, twists):
    for k in range(len(states)):
        f, w = motion_kernel(tree, states[k], inputs[min(k, len(inputs) - 1)])
        for i in range(3):
            twists[k, i], twists[k, 3 + i] = w[i], f[POSITION + i]


@njit(cache=True)
def _momentum(tree, rpy, q, v_WB, w_WB, rates):
    rotation = rotation_from_rpy(rpy)
    axes, origins, coms, inertias, _ = link_kinematics(tree, q)
    mass, center, center_jacobian, inertia, joint_momentum = composite_terms(tree, axes, origins, coms, inertias)
    w = transpose_times(rotation, w_WB)
    slip, spin = cross(w, center), times(inertia, w)
    for j in range(12):
        slip = add(slip, scale(rates[j], vector(center_jacobian[:, j])))
        spin = add(spin, scale(rates[j], vector(joint_momentum[:, j])))
    momentum = np.empty(6)
    store(momentum, add(vector(v_WB), times(rotation, slip)))
    store(momentum[3:], scale(1.0 / mass, times(rotation, spin)))
    return momentum


def lumped_tree(robot: RobotModel) -> KinematicTree:
    """Returns the robot's kinematic tree with all mass in the base, as it is distributed at the nominal joints."""
    tree = robot.tree
    axes, origins, coms, inertias, _ = link_kinematics(tree, _contiguous(robot.nominal_joints))
    mass, center, _, inertia, _ = composite_terms(tree, axes, origins, coms, inertias)
    masses, centers, moments = np.zeros(13), np.zeros((13, 3)), np.zeros((13, 3, 3))
    masses[0], centers[0], moments[0] = mass, center, inertia
    for array in (masses, centers, moments):  # as the robot's own are: compiled functions tell them apart
        array.flags.writeable = False
    return tree._replace(link_mass=masses, link_com=centers, link_inertia=moments)


class CentroidalModel:
    """Centroidal dynamics (QuadPiPS eq. 19a; Orin, Goswami, Lee, "Centroidal dynamics of a humanoid robot", 2013).

        d v_com / dt = sum_l f_l / m + g
        d (k/m) / dt = sum_l (p_l - c) x f_l / m
        d p_WB / dt  = v_WB(x, u),   d rpy / dt = T(rpy) w_B(x, u),   d q_j / dt = v_j

    The base velocity follows from the momentum, h = A_b nu_b + A_j v_j. State x (24): linear momentum / mass, angular
    momentum about the centre of mass / mass (both in W), base position, roll-pitch-yaw, joints. Input u (24): foot forces
    in W [N], joint velocities [rad/s]. Rotor inertia of the drives does not count as momentum, as in Drake.

    ``kind`` "single_rigid_body" takes the legs for massless: the whole mass and the inertia at the nominal joints belong to
    the base (J. Di Carlo et al., "Dynamic locomotion in the MIT Cheetah 3", 2018). State, input, kinematics stay the same.
    """

    def __init__(self, robot: RobotModel, kind: str = "centroidal"):
        if kind not in MODEL_KINDS:
            raise unknown_name("model", kind, MODEL_KINDS)
        self.robot, self.kind = robot, kind
        self.tree = robot.tree if kind == "centroidal" else lumped_tree(robot)
        self.mass = float(robot.tree.link_mass.sum())

    def dynamics(self, x, u) -> np.ndarray:
        """Returns dx/dt (24,)."""
        return motion_kernel(self.tree, _contiguous(x), _contiguous(u))[0]

    def linearize(self, states, inputs):
        """Returns f (n, 24), A = df/dx, B = df/du (n, 24, 24) at n points."""
        return _all_knots(self.tree, _contiguous(states), _contiguous(inputs))[:3]

    def feet(self, states, inputs):
        """Returns foot positions p, velocities v (n, 4, 3) in W, then dp/dx, dv/dx, dv/du (n, 4, 3, 24)."""
        return _all_knots(self.tree, _contiguous(states), _contiguous(inputs))[3:]

    def foot_positions(self, x) -> np.ndarray:
        """Returns the feet's centres in W [m], (4, 3)."""
        rotation = rotation_from_rpy(np.asarray(x[CentroidalState.ORIENTATION], float))
        return self.robot.foot_positions_at(x[CentroidalState.POSITION], rotation, x[CentroidalState.JOINTS])

    def base_twists(self, states, inputs) -> np.ndarray:
        """Returns angular, then linear velocity of the base in W at n points, (n, 6) [rad/s, m/s].

        ``inputs`` may be fewer than states (n, 24); then the last one holds to the end.
        """
        twists = np.empty((len(states), 6))
        _base_twists(self.tree, _contiguous(states), _contiguous(inputs), twists)
        return twists

    def base_velocity(self, x, u) -> tuple[np.ndarray, np.ndarray]:
        """Returns the base's linear velocity v_WB [m/s] (at its origin) and angular w_WB [rad/s], (3,), both in W."""
        f, w = motion_kernel(self.tree, _contiguous(x), _contiguous(u))
        return f[CentroidalState.POSITION], w

    def momentum(self, rpy, q, v_WB, w_WB, joint_velocities) -> np.ndarray:
        """Returns [linear momentum, angular momentum about the centre of mass] / mass in W, (6,), from velocities in W."""
        return _momentum(self.tree, *(_contiguous(part) for part in (rpy, q, v_WB, w_WB, joint_velocities)))

    def state(self, p_WB, rpy, q, v_WB=(0, 0, 0), w_WB=(0, 0, 0), joint_velocities=None) -> np.ndarray:
        """Returns the state x (24,) with that base pose, joints and velocities (in W)."""
        rates = np.zeros(12) if joint_velocities is None else joint_velocities
        momentum = self.momentum(rpy, q, np.asarray(v_WB, float), np.asarray(w_WB, float), rates)
        return centroidal_state(p_WB, rpy, q, momentum)

    def state_from_robot_state(self, robot_state: RobotState) -> np.ndarray:
        """Returns the state x (24,) of a measurement."""
        s = robot_state
        return self.state(s.p_WB, s.rpy_WB, s.joint_positions, s.v_WB, s.w_WB, s.joint_velocities)

    def nominal_state(self, height: float = 0.0) -> np.ndarray:
        """Returns x standing still at the nominal joints over (0, 0) on flat ground of that height, facing x."""
        p_WB = np.array([0.0, 0.0, height + self.robot.nominal_base_height])
        return self.state(p_WB, np.zeros(3), self.robot.nominal_joints)

    def gravity_compensation(self, stance) -> np.ndarray:
        """Returns inputs (..., 24) that carry the weight in equal parts on the stance feet, bool (..., 4), at rest."""
        stance = np.asarray(stance, bool)
        inputs = np.zeros((*stance.shape[:-1], INPUT_SIZE))
        share = self.mass * GRAVITY / np.maximum(stance.sum(axis=-1, keepdims=True), 1)
        inputs[..., CentroidalInput.VERTICAL_FORCES] = stance * share
        return inputs

    def locked_inertia(self, q) -> np.ndarray:
        """Returns the inertia of the robot with locked joints about its centre of mass in B [kg m^2], (3, 3)."""
        axes, origins, coms, inertias, _ = link_kinematics(self.tree, _contiguous(q))
        return composite_terms(self.tree, axes, origins, coms, inertias)[3]

    def center_of_mass(self, x) -> np.ndarray:
        """Returns the centre of mass in W [m], (3,)."""
        rotation = rotation_from_rpy(np.asarray(x[CentroidalState.ORIENTATION], float))
        _, _, coms, _, _ = link_kinematics(self.tree, _contiguous(x[CentroidalState.JOINTS]))
        return x[CentroidalState.POSITION] + rotation @ (self.tree.link_mass @ coms / self.mass)


def _contiguous(a):
    """A copy, so that compiled functions see one kind of array: read-only ones would have them compiled twice."""
    return np.array(a, dtype=float, order="C")


__all__ = ["MODEL_KINDS", "CentroidalModel", "lumped_tree"]
