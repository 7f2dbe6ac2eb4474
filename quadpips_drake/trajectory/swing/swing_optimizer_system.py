"""SwingTrajectoryOptimizer: turns each new foothold plan into a whole-body reference."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.timing import StageTimings
from quadpips_drake.trajectory.swing.swing_optimizer import SwingOptimizer, SwingOptimizerConfig
from quadpips_drake.values.plans import FootholdPlan, StageStatus
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.swing_plan import SwingPlan


class SwingTrajectoryOptimizer(LeafSystem):
    """Optimises one swing after the other along each new foothold plan.

    A chain of optimal control problems (QuadPiPS section VI-D, eq. 19), solved to convergence by sequential quadratic
    programming; see ``SwingOptimizer`` for what happens when one fails.

    .. pydrake_system::

        name: SwingTrajectoryOptimizer
        input_ports:
        - robot_state
        - foothold_plan
        output_ports:
        - reference
        - status
        - swing_plan

    - robot_state: RobotState, frame W; read once for each new plan.
    - foothold_plan: FootholdPlan, frame W; looked at every ``period``; a plan without stances, or whose ``request_id`` was
      dealt with before, is ignored.
    - reference: WholeBodyReference of the last plan that was dealt with, frame W, times relative to its first sample (0 s);
      without samples and with request id 0 before the first, without samples when not even the first swing was possible.
    - status: StageStatus of that request; ``ok`` is False, with the reason, when the reference ends before the plan does.
    - swing_plan: SwingPlan, the reference with a report on every swing.
    """

    def __init__(
        self,
        robot: RobotModel,
        config: SwingOptimizerConfig | None = None,
        *,
        period: float = 0.02,
        timings: StageTimings | None = None,
    ):
        """
        Args:
            robot: whose swings.
            config: of the optimisation.
            period: how often the input is looked at [s].
            timings: where computing times go, as "swing_optimization" (a plan) and "swing" (a swing of it).
        """
        LeafSystem.__init__(self)
        self.set_name("swing_trajectory_optimizer")
        self._optimizer = SwingOptimizer(robot, config)
        self._timings = timings
        self._robot_state = self.DeclareAbstractInputPort("robot_state", AbstractValue.Make(RobotState.empty()))
        self._foothold_plan = self.DeclareAbstractInputPort("foothold_plan", AbstractValue.Make(FootholdPlan(0.0, 0)))
        self._state = self.DeclareAbstractState(AbstractValue.Make(SwingPlan.empty()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)
        tickets = {self.abstract_state_ticket(self._state)}
        for name, example, view in (
            ("reference", SwingPlan.empty().reference, lambda plan: plan.reference),
            ("status", _status(SwingPlan.empty()), _status),
            ("swing_plan", SwingPlan.empty(), lambda plan: plan),
        ):
            self.DeclareAbstractOutputPort(name, _maker(example), self._writer(view), tickets)

    def _writer(self, view):
        def write(context, output):
            output.set_value(view(context.get_abstract_state(int(self._state)).get_value()))

        return write

    def _update(self, context, state):
        last = context.get_abstract_state(int(self._state)).get_value()
        plan = self._foothold_plan.Eval(context)
        if plan.request_id <= last.reference.request_id or not plan.success:
            return
        x0 = self._optimizer.model.state_from_robot_state(self._robot_state.Eval(context))
        result = self._optimizer.optimize(x0, plan, context.get_time())
        if self._timings is not None:
            self._timings.record("swing_optimization", result.elapsed)
            for report in result.reports:
                self._timings.record("swing", report.elapsed)
        state.get_mutable_abstract_state(int(self._state)).set_value(result)


def _status(plan) -> StageStatus:
    return StageStatus(plan.reference.stamp, plan.reference.request_id, not plan.reason, plan.reason)


def _maker(example):
    return lambda: AbstractValue.Make(example)
