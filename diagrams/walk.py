"""Walking by velocity command, without perception or planning: station, velocity reference, tracking."""

import time as clock
from dataclasses import dataclass, field

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from quadpips_drake.control.gaits import Gait
from quadpips_drake.control.safety import SafetyConfig, fall_reason
from quadpips_drake.control.velocity_reference import VelocityReferenceConfig
from quadpips_drake.control.velocity_reference_system import VelocityReference
from quadpips_drake.diagrams.simulation_station import StationConfig, make_simulation_station
from quadpips_drake.diagrams.tracking_module import TrackingConfig, make_tracking_module
from quadpips_drake.timing import StageTimings


@dataclass
class WalkConfig:
    """Everything about a walk but robot, terrain, gait and command."""

    station: StationConfig = field(default_factory=StationConfig)
    tracking: TrackingConfig = field(default_factory=TrackingConfig)
    velocity_reference: VelocityReferenceConfig = field(default_factory=VelocityReferenceConfig)
    safety: SafetyConfig = field(default_factory=SafetyConfig)
    settle_time: float = 0.5
    """The command begins so long after the start [s]."""
    stop_time: float = 2.0
    """The command ends so long before the end [s]."""
    log_period: float = 0.01
    """[s]"""


@dataclass(frozen=True, eq=False)
class WalkLog:
    """What happened, sampled every ``log_period``; frame W. ``arrays()`` names everything for a file."""

    times: np.ndarray
    """[s], (n,)"""
    p_WB: np.ndarray
    """(n, 3)"""
    rpy_WB: np.ndarray
    """(n, 3)"""
    v_WB: np.ndarray
    """(n, 3)"""
    joint_positions: np.ndarray
    """(n, 12)"""
    joint_torques: np.ndarray
    """(n, 12)"""
    contact_forces: np.ndarray
    """(n, 4, 3)"""
    planned_forces: np.ndarray
    """Forces that whole-body control aims at, (n, 4, 3)."""
    foot_modes: np.ndarray
    """FootMode, int (n, 4)."""
    feet: np.ndarray
    """Foot centres, (n, 4, 3)."""
    fell: str
    """Why the robot counts as fallen; empty when it did not."""
    fallbacks: dict
    """Failed solves: "centroidal_mpc", "whole_body_control"."""
    wall_time: float
    """[s]"""
    timings_ms: dict
    """Summary of StageTimings."""

    @property
    def realtime_factor(self) -> float:
        return float(self.times[-1] / max(self.wall_time, 1e-9))

    def arrays(self) -> dict:
        """The arrays by name, for ``numpy.savez``."""
        return {name: value for name, value in vars(self).items() if isinstance(value, np.ndarray)}


class Walk(Diagram):
    """Station, velocity reference and tracking, wired up.

    .. pydrake_system::

        name: walk
    """

    def __init__(
        self, robot, terrain, gait: Gait, velocity, duration: float, config: WalkConfig, timings=None, meshcat=None
    ):
        super().__init__()
        self.robot = robot
        builder = DiagramBuilder()
        self.station = builder.AddSystem(make_simulation_station(robot, terrain, config.station, meshcat))
        self.tracking = builder.AddSystem(make_tracking_module(robot, config.tracking, timings))
        source = builder.AddNamedSystem("velocity_command", TrajectorySource(_command(velocity, duration, config)))
        reference = builder.AddSystem(VelocityReference(robot, gait, config.velocity_reference))
        state = self.station.GetOutputPort("robot_state")
        builder.Connect(state, reference.GetInputPort("robot_state"))
        builder.Connect(source.get_output_port(), reference.GetInputPort("velocity_command"))
        builder.Connect(state, self.tracking.GetInputPort("robot_state"))
        builder.Connect(reference.GetOutputPort("reference"), self.tracking.GetInputPort("reference"))
        for name in ("feedforward_torque", "desired_joint_state"):
            builder.Connect(self.tracking.GetOutputPort(name), self.station.GetInputPort(name))
        builder.BuildInto(self)
        self.set_name("walk")


def _command(velocity, duration: float, config: WalkConfig) -> PiecewisePolynomial:
    """Zero, then the command, then zero again."""
    begin = config.settle_time
    end = max(begin + 1e-3, duration - config.stop_time)
    samples = np.stack((np.zeros(3), velocity, np.zeros(3), np.zeros(3)), axis=1)
    return PiecewisePolynomial.ZeroOrderHold([0.0, begin, end, end + max(duration, 1.0)], samples)


def simulate_walk(
    robot, terrain, gait: Gait, velocity, duration: float, config: WalkConfig | None = None, *, meshcat=None, on_step=None
) -> WalkLog:
    """Simulates a walk from the terrain's start pose until ``duration`` [s] or a fall.

    Args:
        velocity: forward, left [m/s], yaw rate [rad/s].
        on_step: called with the diagram and its context after every ``log_period`` (progress bars, recordings).
    """
    config = config or WalkConfig()
    timings = StageTimings()
    diagram = Walk(robot, terrain, gait, np.asarray(velocity, dtype=float), duration, config, timings, meshcat)
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    diagram.station.set_initial_state(context, *terrain.start)
    simulator.Initialize()
    rows, fell = [], ""
    start = clock.perf_counter()
    for time in np.arange(config.log_period, duration + 0.5 * config.log_period, config.log_period):
        simulator.AdvanceTo(float(time))
        state, command, policy = _observe(diagram, context)
        rows.append(_row(robot, state, command))
        if on_step is not None:
            on_step(diagram, context)
        fell = fall_reason(state, robot, config.safety)
        if fell:
            break
    wall_time = clock.perf_counter() - start
    columns = [np.stack(column) for column in zip(*rows, strict=True)]
    fallbacks = {"centroidal_mpc": policy.fallbacks, "whole_body_control": command.fallbacks}
    return WalkLog(*columns, fell, fallbacks, wall_time, timings.summary_ms())


def _observe(diagram: Walk, context):
    tracking = diagram.tracking.GetMyContextFromRoot(context)
    state = diagram.station.GetOutputPort("robot_state").Eval(diagram.station.GetMyContextFromRoot(context))
    command = diagram.tracking.GetOutputPort("wbc_status").Eval(tracking)
    return state, command, diagram.tracking.GetOutputPort("mpc_policy").Eval(tracking)


def _row(robot, state, command) -> tuple:
    feet = state.p_WB + robot.foot_positions_B(state.joint_positions) @ state.R_WB.T
    return (
        np.asarray(state.stamp),
        state.p_WB,
        state.rpy_WB,
        state.v_WB,
        state.joint_positions,
        state.joint_torques,
        state.contact_forces,
        command.forces,
        command.foot_modes,
        feet,
    )
