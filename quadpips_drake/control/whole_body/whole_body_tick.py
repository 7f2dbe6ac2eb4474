"""A tick of whole-body control in two compiled steps: all before the quadratic program is solved, and all after it.

They call the same functions as TaskSpaceInverseDynamics does one by one where it has to solve tasks, in the same order. In
a running simulation little of what a tick touches is still in the processor's cache, so each call through Python counts.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from quadpips_drake.control.whole_body.contact_logic import FootSettings, aim_feet, bears, current_paths
from quadpips_drake.control.whole_body.robot_dynamics import NUM_VELOCITIES, dynamics_at, measured
from quadpips_drake.control.whole_body.whole_body_assembly import AssemblySettings, ProgramData, assemble
from quadpips_drake.control.whole_body.whole_body_targets import aim_base, aim_joints, base_gains, redistribute
from quadpips_drake.control.whole_body.whole_body_tasks import NUM_VARIABLES
from quadpips_drake.math.interpolation import interpolate_at
from quadpips_drake.robots.kinematic_tree import KinematicTree
from quadpips_drake.values.centroidal import CentroidalInput, CentroidalState
from quadpips_drake.values.legs import NUM_JOINTS, NUM_LEGS
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.robot_state import RobotState

_POSITION, _ORIENTATION, _FORCES = CentroidalState.POSITION, CentroidalState.ORIENTATION, CentroidalInput.FORCES


class TickSettings(NamedTuple):
    """What does not change from tick to tick."""

    tree: KinematicTree
    rotor_inertia: np.ndarray
    feet: FootSettings
    base_gains: tuple[float, float, float, float]
    assembly: AssemblySettings

    @staticmethod
    def of(robot, config) -> "TickSettings":
        """Those of a RobotModel and a WbcConfig."""
        feet, assembly = FootSettings.of(config), AssemblySettings.of(robot, config)
        return TickSettings(robot.tree, np.array(robot.rotor_inertia, dtype=float), feet, base_gains(config), assembly)


class Scratch(NamedTuple):
    """What lies between the two steps; each tick fills it completely."""

    mass_matrix: np.ndarray
    bias: np.ndarray
    jacobian: np.ndarray
    foot_bias: np.ndarray
    p_WF: np.ndarray
    v_WF: np.ndarray
    policy_state: np.ndarray
    policy_twist: np.ndarray
    p_d: np.ndarray
    v_d: np.ndarray
    accelerations: np.ndarray
    base: np.ndarray
    forces: np.ndarray
    program: ProgramData

    @staticmethod
    def allocated() -> "Scratch":
        """Room for one tick."""
        n, feet = NUM_VELOCITIES, (NUM_LEGS, 3)
        shapes = (n, n), n, (3 * NUM_LEGS, n), 3 * NUM_LEGS, feet, feet, 24, 6, feet, feet, feet, 6, feet
        return Scratch(*(np.zeros(shape) for shape in shapes), ProgramData.allocated())


class CompiledTick:
    """Keeps room for a tick, but remembers nothing."""

    def __init__(self, robot, config):
        self._settings = TickSettings.of(robot, config)
        self._scratch = Scratch.allocated()

    def prepare(self, state: RobotState, policy: MpcPolicy, last_modes: np.ndarray) -> tuple[np.ndarray, np.ndarray, bool]:
        """Fills the program. Returns the FootModes (4,), the state in one array, and whether all numbers are numbers."""
        time, where, modes = float(state.stamp), measured(state), np.empty(NUM_LEGS, dtype=int)
        plan = policy.times, policy.states, policy.inputs, policy.base_twists
        schedule = policy.schedule.event_times, policy.schedule.stance
        paths = current_paths(policy, time)
        good = _prepare(
            self._settings, self._scratch, time, where, state.contacts, plan, schedule, policy.normals, paths, last_modes,
            modes,
        )  # fmt: skip
        return modes, where, good

    def matrices(self) -> tuple:
        """H, g, A, b, C, lower, upper of the program."""
        return self._scratch.program.matrices()

    def finish(self, solution: np.ndarray, where: np.ndarray) -> np.ndarray:
        """From the program's solution z (30,) to torques, joint positions and joint velocities, (3, 12)."""
        commands = np.empty((3, NUM_JOINTS))
        _finish(self._settings.assembly.efforts, self._scratch, solution, where, commands)
        commands.flags.writeable = False  # at once, instead of each part of it as a value's field
        return commands


@njit(cache=True, nogil=True)
def _prepare(settings, scratch, time, where, contacts, plan, schedule, normals, paths, last_modes, modes):
    s = scratch
    M, bias, J, foot_bias = s.mass_matrix, s.bias, s.jacobian, s.foot_bias
    dynamics_at(settings.tree, settings.rotor_inertia, where, M, bias, J, foot_bias, s.p_WF, s.v_WF)
    times, states, inputs, base_twists = plan
    interpolate_at(time, times, base_twists, s.policy_twist)
    k = interpolate_at(time, times, states, s.policy_state)
    event_times, stance = schedule
    planned = stance[np.searchsorted(event_times, time, side="right")]
    aim_feet(
        settings.feet, time, contacts, planned, last_modes, normals, paths, s.p_WF, s.v_WF, modes, s.p_d, s.v_d,
        s.accelerations,
    )  # fmt: skip
    position, attitude = s.policy_state[_POSITION], s.policy_state[_ORIENTATION]
    wanted = np.empty((NUM_LEGS, 3))
    down = np.empty(NUM_LEGS, np.bool_)
    for leg in range(NUM_LEGS):
        down[leg] = bears(modes[leg])
        for i in range(3):
            wanted[leg, i] = inputs[k, 3 * leg + i]
    aim_base(settings.base_gains, M, bias, J, where, position, attitude, s.policy_twist, wanted, s.base)
    redistribute(wanted, down, s.forces)
    assemble(settings.assembly, M, bias, J, foot_bias, s.accelerations, modes, s.base, s.forces, normals, s.program)
    total = where.sum() + s.program.gradient.sum() + s.program.targets.sum() + normals.sum()
    return np.isfinite(total)


@njit(cache=True, nogil=True)
def _finish(efforts, scratch, solution, where, commands):
    """Torques M vdot + bias - J^T f, within the limits; joint set points."""
    M, bias, J = scratch.mass_matrix, scratch.bias, scratch.jacobian
    for j in range(NUM_JOINTS):
        torque = bias[6 + j]
        for i in range(NUM_VELOCITIES):
            torque += M[6 + j, i] * solution[i]
        for i in range(NUM_VARIABLES - NUM_VELOCITIES):
            torque -= J[i, 6 + j] * solution[NUM_VELOCITIES + i]
        commands[0, j] = min(max(torque, -efforts[j]), efforts[j])
    aim_joints(J, where, scratch.policy_twist, scratch.p_WF, scratch.p_d, scratch.v_d, commands[1], commands[2])
