"""Walking by velocity command, without perception or planning: station, command, velocity reference, tracking."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pydrake.geometry import MeshcatVisualizer, MeshcatVisualizerParams
from pydrake.systems.framework import Diagram

from quadpips_drake.control.references.scripted_command_system import ScriptedCommand
from quadpips_drake.control.references.velocity_reference import VelocityReferenceConfig
from quadpips_drake.control.references.velocity_reference_system import VelocityReference
from quadpips_drake.control.references.walk_command import WalkCommand
from quadpips_drake.diagrams.simulation_station import StationConfig, make_simulation_station
from quadpips_drake.diagrams.tracking_module import TrackingConfig, make_tracking_module
from quadpips_drake.faults.push_system import Push, PushSource
from quadpips_drake.framework.ports import DiagramBuilder
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.visualization.camera_follower_system import CameraFollower
from quadpips_drake.visualization.meshcat_layers import draw_course
from quadpips_drake.visualization.recording import FRAMES_PER_SECOND, save_recording, start_recording
from quadpips_drake.visualization.walk_panel_system import WalkPanel


def _tracking() -> TrackingConfig:
    """Tracking of a walk: roll weighs as much as pitch.

    With the weights of the authors (100 against 300), which are right where footholds are given, the MPC leans the robot
    sideways to be where the reference is, although the next steps will put its feet there anyway.
    """
    config = TrackingConfig()
    weights = config.mpc.ocp.weights
    weights.base_orientation = [300.0, 300.0, 300.0]
    weights.angular_velocity = [30.0, 30.0, 30.0]
    return config


@dataclass
class WalkConfig:
    """The stages of a walk."""

    station: StationConfig = field(default_factory=StationConfig)
    velocity_reference: VelocityReferenceConfig = field(default_factory=VelocityReferenceConfig)
    tracking: TrackingConfig = field(default_factory=_tracking)


@dataclass(frozen=True)
class WalkObservation:
    """What an onlooker sees of the running diagram."""

    robot_state: RobotState
    foot_positions: np.ndarray
    """Centres of the feet in W [m], (4, 3)."""
    body_touches: bool
    """Whether the torso touches anything."""
    reference: WholeBodyReference
    """What is being tracked."""
    velocity_command: np.ndarray
    """Forward, left [m/s], yaw rate [rad/s], (3,)."""
    gait: str
    """Name of the gait that is commanded."""
    planned_forces: np.ndarray
    """Forces that whole-body control aims at, in W [N], (4, 3)."""
    foot_modes: np.ndarray
    """FootMode of each foot, int (4,)."""
    fallbacks: dict
    """How often each controller had to fall back so far, and the safety monitor's events."""


class Walk(Diagram):
    """Command -> VelocityReference -> tracking -> station, and pushes on the station.

    .. pydrake_system::

        name: Walk
        input_ports: []
        output_ports: []

    Args:
        robot: model of the robot.
        terrain: world and start.
        commands: gait and velocity over time.
        config: the stages' parameters.
        pushes: forces on the base.
        timings: collects the stages' computing times.
        meshcat: where to draw; None draws nothing.
        panel: whether sliders and buttons in Meshcat (or a gamepad) take the place of ``commands``.
    """

    def __init__(
        self,
        robot,
        terrain,
        commands: list[WalkCommand],
        config: WalkConfig | None = None,
        *,
        pushes: list[Push] = (),
        timings: StageTimings | None = None,
        meshcat=None,
        panel: bool = False,
    ):
        super().__init__()
        config = config or WalkConfig()
        self._terrain, self._meshcat = terrain, meshcat
        builder = DiagramBuilder()
        self.station = builder.AddSystem(make_simulation_station(robot, terrain, config.station))
        self.robot = self.station.robot
        self.tracking = builder.AddSystem(make_tracking_module(robot, config.tracking, timings))
        self.command = builder.AddSystem(WalkPanel(meshcat, commands[-1]) if panel else ScriptedCommand(commands))
        self.reference = builder.AddSystem(VelocityReference(robot, config.velocity_reference))
        state = self.station.GetOutputPort("robot_state")
        builder.Connect(state, self.reference.GetInputPort("robot_state"))
        for name in ("velocity_command", "gait"):
            builder.Connect(self.command.GetOutputPort(name), self.reference.GetInputPort(name))
        builder.Connect(state, self.tracking.GetInputPort("robot_state"))
        builder.Connect(self.reference.GetOutputPort("reference"), self.tracking.GetInputPort("reference"))
        builder.Connect(self.tracking.GetOutputPort("safety_status"), self.reference.GetInputPort("safety_status"))
        for name in ("feedforward_torque", "desired_joint_state"):
            builder.Connect(self.tracking.GetOutputPort(name), self.station.GetInputPort(name))
        if pushes:
            base = self.station.plant.GetBodyByName("base")
            source = builder.AddSystem(PushSource(pushes, base, self.robot.tree.link_com[0]))
            builder.Connect(source.get_output_port(), self.station.GetInputPort("applied_spatial_force"))
        if meshcat is not None:
            params = MeshcatVisualizerParams(publish_period=1.0 / FRAMES_PER_SECOND)
            MeshcatVisualizer.AddToBuilder(builder, self.station.GetOutputPort("query_object"), meshcat, params)
        if panel:
            follower = builder.AddSystem(CameraFollower(robot, meshcat))
            builder.Connect(state, follower.get_input_port())
        builder.BuildInto(self)
        self.set_name("walk")

    def set_initial_state(self, root_context, start) -> None:
        """Stands the robot on the terrain at ``start`` (x, y [m], yaw [rad]); raises UserInputError where it cannot."""
        self.station.set_initial_state(root_context, *start)

    def observe(self, root_context) -> WalkObservation:
        """Returns what there is to see at the context's time."""
        state = self._eval(self.station, "robot_state", root_context)
        policy = self._eval(self.tracking, "mpc_policy", root_context)
        wbc = self._eval(self.tracking, "wbc_status", root_context)
        safety = self._eval(self.tracking, "safety_status", root_context)
        return WalkObservation(
            robot_state=state,
            foot_positions=self.robot.foot_positions_W(state),
            body_touches="base" in self.station.touching_links(root_context),
            reference=self._eval(self.reference, "reference", root_context),
            velocity_command=self._eval(self.command, "velocity_command", root_context),
            gait=self._eval(self.command, "gait", root_context),
            planned_forces=wbc.forces,
            foot_modes=wbc.foot_modes,
            fallbacks={
                "mpc": policy.fallbacks,
                "wbc": wbc.fallbacks,
                **{f"unstable_{event}": count for event, count in safety.counts_by_event().items()},
            },
        )

    def draw_course(self) -> None:
        """Sets the stage in Meshcat."""
        draw_course(self._meshcat, self._terrain)

    def start_recording(self) -> None:
        """Lets Meshcat record from now on."""
        start_recording(self._meshcat)

    def save_recording(self, path: Path) -> None:
        """Ends the recording and writes it as one HTML file."""
        save_recording(self._meshcat, path, title=f"{self.robot.name} walks on {self._terrain.name}")

    @staticmethod
    def _eval(system, port: str, root_context):
        return system.GetOutputPort(port).Eval(system.GetMyContextFromRoot(root_context))
