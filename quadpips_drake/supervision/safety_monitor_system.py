"""SafetyMonitor: takes the reference away from a robot that is in trouble."""

from quadpips_drake.framework.ports import declare_output
from quadpips_drake.framework.stage import FirstUpdate, Inputs, Stage
from quadpips_drake.supervision.safety import SafetyConfig, SafetyMemory, watch
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.status import SafetyStatus


class SafetyMonitor(Stage):
    """Watches attitude, joint speeds, torques, slipping feet and missing contacts; aborts the reference and stabilises.

    QuadPiPS section VII-A: large roll, pitch, joint velocities or torques abort the reference; slip and lasting contact
    mismatch are added. An event lasts until the robot has been upright and at rest for a while; meanwhile there is nothing
    to follow, so that the MPC balances on the spot. References from before the end of an event stay dropped.

    .. pydrake_system::

        name: SafetyMonitor
        input_ports:
        - robot_state
        - mpc_policy
        - reference
        - abort (optional)
        output_ports:
        - safety_status
        - safe_reference

    - robot_state: RobotState, frame W.
    - mpc_policy: MpcPolicy with the planned contacts; an empty one plans all feet down.
    - reference: WholeBodyReference in absolute time, frame W.
    - abort (optional): bool; True drops the reference as an event would, for as long as it lasts; not counted.
    - safety_status: SafetyStatus; updated at ``config.rate`` (100 Hz).
    - safe_reference: the reference while all is well, else one without samples (request id 0): stand.
    """

    def __init__(self, robot, config: SafetyConfig | None = None, *, timings: StageTimings | None = None):
        super().__init__(
            "safety_monitor",
            config or SafetyConfig(),
            memory=SafetyMemory.empty(),
            timings=timings,
            first=FirstUpdate.AFTER_ONE_PERIOD,
        )
        self._robot = robot
        self.declare_input("robot_state", RobotState)
        self.declare_input("mpc_policy", MpcPolicy)
        reference = self.declare_input("reference", WholeBodyReference)
        abort = self.declare_input("abort", bool, default=False)
        self.declare_output("safety_status", SafetyStatus, lambda memory: memory.status)
        sources = self.memory_tickets() | {reference.ticket(), abort.ticket()}
        declare_output(self, "safe_reference", WholeBodyReference, self._safe_reference, sources)

    def update(self, inputs: Inputs, memory: SafetyMemory, time: float) -> SafetyMemory:
        """Looks at the robot."""
        if not inputs.robot_state.is_known:
            return memory
        return watch(memory, inputs.robot_state, inputs.mpc_policy, self._robot, self.config)

    def _safe_reference(self, context) -> WholeBodyReference:
        """The reference, or standing: at once, without waiting for the next update."""
        inputs, memory = self.inputs(context), self.shown_memory(context)
        reference = inputs.reference
        dropped = memory.status.unstable or reference.stamp < memory.released or inputs.abort
        return WholeBodyReference.empty(reference.stamp) if dropped else reference
