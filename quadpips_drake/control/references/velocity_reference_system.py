"""VelocityReference: walking by velocity command, without a planner."""

import numpy as np

from quadpips_drake.control.references.velocity_reference import STANCE, VelocityReferenceConfig, VelocityWalk, WalkMemory
from quadpips_drake.framework.stage import FirstUpdate, Inputs, Stage
from quadpips_drake.gaits.gaits import load_gait
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.status import SafetyStatus


class VelocityReference(Stage):
    """Makes a rolling whole-body reference with Raibert footholds from a velocity command and a gait.

    The base reference integrates the command; a foot comes down at its nominal place below the base in the middle of its
    next stance, plus k sqrt(h / g) (v - v_ref) (M. Raibert, Legged Robots That Balance, 1986), on the plane through the
    points where the feet touched the ground last.

    .. pydrake_system::

        name: VelocityReference
        input_ports:
        - robot_state
        - velocity_command
        - gait
        - safety_status (optional)
        output_ports:
        - reference

    - robot_state: RobotState, frame W.
    - velocity_command: vector (3,): forward, left [m/s], yaw rate [rad/s] in the heading frame of the robot.
    - gait: str, name of the gait to walk in; it may change at any time. "stance": slow down, step once on the spot, stand.
    - safety_status (optional): SafetyStatus; while it is unstable the robot is to stand where it is; then the walk begins
      anew from there.
    - reference: WholeBodyReference in absolute time, frame W, from now over the configured horizon; without samples before
      the first update. Updated at ``config.rate`` (50 Hz).
    """

    def __init__(self, robot, config: VelocityReferenceConfig | None = None, *, timings: StageTimings | None = None):
        super().__init__(
            "velocity_reference",
            config or VelocityReferenceConfig(),
            memory=WalkMemory.empty(),
            timings=timings,
            first=FirstUpdate.AT_INITIALIZATION,
        )
        self._walk = VelocityWalk(robot, self.config)
        self.declare_input("robot_state", RobotState)
        self.declare_vector_input("velocity_command", 3)
        self.declare_input("gait", str, example=STANCE)
        self.declare_input("safety_status", SafetyStatus, default=SafetyStatus.empty())
        self.declare_output("reference", WholeBodyReference, lambda memory: memory.reference)

    def update(self, inputs: Inputs, memory: WalkMemory, time: float) -> WalkMemory:
        """Goes on with the walk; a robot in trouble stands, and begins anew afterwards."""
        if not inputs.robot_state.is_known:
            return memory
        if inputs.safety_status.unstable:
            return self._walk.update(WalkMemory.empty(), inputs.robot_state, np.zeros(3), load_gait(STANCE))
        return self._walk.update(memory, inputs.robot_state, inputs.velocity_command, load_gait(inputs.gait))
