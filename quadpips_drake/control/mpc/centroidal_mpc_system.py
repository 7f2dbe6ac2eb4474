"""CentroidalMpc system: a new policy at 50 Hz."""

from contextlib import nullcontext

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from quadpips_drake.control.mpc.real_time_iteration import MpcConfig, MpcMemory, RealTimeIteration
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.reference import WholeBodyReference


class CentroidalMpc(LeafSystem):
    """Tracks a whole-body reference by model predictive control on the centroidal model.

    min sum |x - x_ref|_Q^2 + |u - u_ref|_R^2 subject to the centroidal dynamics, friction cones, contact and joint limits
    (QuadPiPS section VII-B, eq. 19); one SQP iteration per update, started from the last solution. Without a reference the
    robot stands where it is. A failed solve carries the last policy on and is counted in it. With a ``delay`` in the
    configuration each policy appears at the port that much later than the measurement that it started from.

    .. pydrake_system::

        name: CentroidalMpc
        input_ports:
        - robot_state
        - reference
        output_ports:
        - mpc_policy

    - robot_state: RobotState, frame W.
    - reference: WholeBodyReference in absolute time, frame W; without samples: stand.
    - mpc_policy: MpcPolicy in absolute time, frame W; empty before the first one. Updated at 1 / ``period``.
    """

    def __init__(self, robot, config: MpcConfig | None = None, *, period: float = 0.02, timings=None):
        super().__init__()
        self.set_name("centroidal_mpc")
        self._mpc = RealTimeIteration(robot, config)
        self._timings = timings
        self._robot_state = self.DeclareAbstractInputPort("robot_state", AbstractValue.Make(standing_state(robot)))
        self._reference = self.DeclareAbstractInputPort("reference", AbstractValue.Make(WholeBodyReference.empty()))
        self._state = self.DeclareAbstractState(AbstractValue.Make(MpcMemory.empty()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)
        self.DeclareAbstractOutputPort(
            "mpc_policy",
            lambda: AbstractValue.Make(MpcPolicy.empty()),
            lambda context, output: output.set_value(self._memory(context).policy_at(context.get_time())),
            {self.abstract_state_ticket(self._state)} | ({self.time_ticket()} if config and config.delay > 0.0 else set()),
        )

    def _memory(self, context) -> MpcMemory:
        return context.get_abstract_state(int(self._state)).get_value()

    def _update(self, context, state):
        with self._timings.measure("centroidal_mpc") if self._timings else nullcontext():
            memory = self._mpc.compute(self._robot_state.Eval(context), self._reference.Eval(context), self._memory(context))
        state.get_mutable_abstract_state(int(self._state)).set_value(memory)
