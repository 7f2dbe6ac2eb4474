"""SafetyMonitor: takes the reference away from a robot that is in trouble."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from quadpips_drake.robots.standing import standing_state
from quadpips_drake.supervision.safety import SafetyConfig, SafetyMemory, watch
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.safety_status import SafetyStatus


class SafetyMonitor(LeafSystem):
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
    - safety_status: SafetyStatus; updated at 1 / ``period`` (100 Hz).
    - safe_reference: the reference while all is well, else one without samples (request id 0): stand.
    """

    def __init__(self, robot, config: SafetyConfig | None = None, *, period: float = 0.01):
        super().__init__()
        self.set_name("safety_monitor")
        self._robot = robot
        self._config = config or SafetyConfig()
        self._robot_state = self.DeclareAbstractInputPort("robot_state", AbstractValue.Make(standing_state(robot)))
        self._policy = self.DeclareAbstractInputPort("mpc_policy", AbstractValue.Make(MpcPolicy.empty()))
        self._reference = self.DeclareAbstractInputPort("reference", AbstractValue.Make(WholeBodyReference.empty()))
        self._abort = self.DeclareAbstractInputPort("abort", AbstractValue.Make(False))
        self._state = self.DeclareAbstractState(AbstractValue.Make(SafetyMemory.empty()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, period, self._update)
        ticket = self.abstract_state_ticket(self._state)
        self.DeclareAbstractOutputPort(
            "safety_status",
            lambda: AbstractValue.Make(SafetyStatus(0.0)),
            lambda context, output: output.set_value(self._memory(context).status),
            {ticket},
        )
        self.DeclareAbstractOutputPort(
            "safe_reference",
            lambda: AbstractValue.Make(WholeBodyReference.empty()),
            self._calc_reference,
            {ticket, self._reference.ticket(), self._abort.ticket()},
        )

    def _memory(self, context) -> SafetyMemory:
        return context.get_abstract_state(int(self._state)).get_value()

    def _calc_reference(self, context, output):
        reference = self._reference.Eval(context)
        dropped = self._memory(context).status.unstable or reference.stamp < self._memory(context).released
        if self._abort.HasValue(context):
            dropped = dropped or self._abort.Eval(context)
        output.set_value(WholeBodyReference.empty(reference.stamp) if dropped else reference)

    def _update(self, context, state):
        memory = watch(
            self._memory(context),
            self._robot_state.Eval(context),
            self._policy.Eval(context),
            self._robot,
            self._config,
        )
        state.get_mutable_abstract_state(int(self._state)).set_value(memory)
