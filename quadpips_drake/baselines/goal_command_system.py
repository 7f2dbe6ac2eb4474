"""GoalCommand: the way to the goal as a velocity command, and what there is to say about it."""

import numpy as np

from quadpips_drake.baselines.goal_command import GoalCommandConfig, GoalCommandMemory, goal_command
from quadpips_drake.control.references.velocity_reference import STANCE
from quadpips_drake.framework.ports import declare_output
from quadpips_drake.framework.stage import FirstUpdate, Inputs, Stage
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.status import PlannerPhase, PlannerStatus, SafetyStatus, StageStatus


class GoalCommand(Stage):
    """Says in which direction the goal lies, as a velocity command, and how the walk there is going.

    Constant speed along the straight way, a yaw rate in proportion to the heading error, nothing near the goal: what the
    baselines of the QuadPiPS paper get. It never gives up.

    .. pydrake_system::

        name: GoalCommand
        input_ports:
        - robot_state
        - goal
        - safety_status (optional)
        - reference_status (optional)
        output_ports:
        - velocity_command
        - gait
        - status

    - robot_state: RobotState, frame W.
    - goal: x, y in W [m], vector (2,).
    - safety_status (optional): SafetyStatus; only reported.
    - reference_status (optional): StageStatus of who walks by the command; only reported.
    - velocity_command: vector (3,): forward, left [m/s], yaw rate [rad/s] in the heading frame of the robot.
    - gait: str, name of the gait to walk in; "stance" at the goal and before the first estimate.
    - status: PlannerStatus, of this moment. The command is updated at ``config.rate`` (10 Hz).
    """

    def __init__(self, config: GoalCommandConfig | None = None, *, timings: StageTimings | None = None):
        super().__init__(
            "goal_command",
            config or GoalCommandConfig(),
            memory=GoalCommandMemory.empty(),
            timings=timings,
            first=FirstUpdate.AT_INITIALIZATION,
        )
        self.declare_input("robot_state", RobotState)
        self.declare_vector_input("goal", 2)
        safety = self.declare_input("safety_status", SafetyStatus, default=SafetyStatus.empty())
        walk = self.declare_input("reference_status", StageStatus, default=StageStatus.empty())
        self.declare_vector_output("velocity_command", 3, lambda memory: memory.velocity)
        self.declare_output("gait", str, lambda memory: memory.gait, example=STANCE)
        sources = self.memory_tickets() | {safety.ticket(), walk.ticket()}
        declare_output(self, "status", PlannerStatus, self._status, sources)

    def update(self, inputs: Inputs, memory: GoalCommandMemory, time: float) -> GoalCommandMemory:
        """Looks where the goal is."""
        if not inputs.robot_state.is_known:
            return memory
        return goal_command(inputs.robot_state, np.asarray(inputs.goal), self.config)

    def _status(self, context) -> PlannerStatus:
        inputs, memory = self.inputs(context), self.shown_memory(context)
        safety, walk = inputs.safety_status, inputs.reference_status
        fallbacks = {"no_region": walk.fallbacks} if walk.fallbacks else {}
        phase, reason = _phase(memory, safety, walk)
        return PlannerStatus(memory.stamp, phase, reason, fallbacks=fallbacks, distance_to_goal=memory.distance)


def _phase(memory: GoalCommandMemory, safety: SafetyStatus, walk: StageStatus) -> tuple[PlannerPhase, str]:
    """What is going on, and why."""
    if safety.unstable:
        return PlannerPhase.RECOVERING, safety.reason
    if memory.is_at_goal:
        return PlannerPhase.GOAL_REACHED, "the goal is near enough"
    if not np.isfinite(memory.distance):
        return PlannerPhase.STANDING_UP, "nothing is known of the robot yet"
    if not walk.ok:
        return PlannerPhase.PAUSING, walk.reason
    return PlannerPhase.WALKING, "straight to the goal"
