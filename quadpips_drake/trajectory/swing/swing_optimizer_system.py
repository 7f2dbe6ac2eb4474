"""SwingTrajectoryOptimizer: turns each new foothold plan into a whole-body reference."""

from dataclasses import dataclass

from quadpips_drake.framework.stage import Inputs, Stage
from quadpips_drake.planning.appeared_ground import with_margin
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.timing import StageTimings
from quadpips_drake.trajectory.swing.swing_optimizer import SwingOptimizer, SwingOptimizerConfig, known_ground
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.plans import FootholdPlan, PlanRequest, RefusedSwings
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.regions import GroundHeights, RegionSet
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.status import StageStatus
from quadpips_drake.values.swing_plan import SwingPlan


@dataclass(frozen=True, eq=False)
class _Memory(ImmutableValue):
    """The last plan, and how many swings of all plans were refused."""

    plan: SwingPlan
    refusals: int = 0


class SwingTrajectoryOptimizer(Stage):
    """Optimises one swing after the other along each new foothold plan.

    A chain of optimal control problems (QuadPiPS section VI-D, eq. 19), solved to convergence by sequential quadratic
    programming; see ``SwingOptimizer`` for what happens when one fails.

    .. pydrake_system::

        name: SwingTrajectoryOptimizer
        input_ports:
        - robot_state
        - foothold_plan
        - region_set (optional)
        - ground_heights (optional)
        - plan_request (optional)
        output_ports:
        - reference
        - status
        - refused_swings
        - swing_plan

    - robot_state: RobotState, frame W; read once for each new plan that begins where the robot is.
    - foothold_plan: FootholdPlan, frame W; looked for at ``config.rate`` (50 Hz); a plan without stances, or whose
      ``request_id`` was dealt with before, is ignored.
    - region_set (optional): RegionSet, frame W; swings clear its regions and those of the plan where nothing else is known.
    - ground_heights (optional): GroundHeights, frame W, that swings clear.
    - plan_request (optional): PlanRequest: what has appeared according to it is cleared with a margin.
    - reference: WholeBodyReference of the last plan that was dealt with, frame W, times relative to its first sample (0 s);
      without samples and with request id 0 before the first, without samples when not even the first swing was possible.
    - status: StageStatus of that request; ``ok`` is False, with the reason, when the reference ends before the plan does;
      ``fallbacks`` counts refused swings.
    - refused_swings: RefusedSwings of that request, frame W: the swing that no motion was found for, if there is one.
    - swing_plan: SwingPlan, the reference with a report on every swing.
    """

    WORTH_A_THREAD = True

    def __init__(
        self, robot: RobotModel, config: SwingOptimizerConfig | None = None, *, timings: StageTimings | None = None
    ):
        """
        Args:
            robot: whose swings.
            config: of the optimisation.
            timings: where computing times go, as "swing_optimization" (a plan) and "swing" (a swing of it).
        """
        self._optimizer = SwingOptimizer(robot, config)
        super().__init__(
            "swing_trajectory_optimizer",
            self._optimizer.config,
            memory=_Memory(SwingPlan.empty()),
            label="swing_optimization",
            timings=timings,
        )
        self.declare_input("robot_state", RobotState)
        self.declare_input("foothold_plan", FootholdPlan)
        self.declare_input("region_set", RegionSet, default=RegionSet.empty())
        self.declare_input("ground_heights", GroundHeights, default=GroundHeights.empty())
        self.declare_input("plan_request", PlanRequest, default=PlanRequest.empty())
        self.declare_output("reference", WholeBodyReference, lambda memory: memory.plan.reference)
        self.declare_output("status", StageStatus, _status)
        self.declare_output("refused_swings", RefusedSwings, _refused)
        self.declare_output("swing_plan", SwingPlan, lambda memory: memory.plan)

    def occasion(self, inputs: Inputs) -> int | None:
        """A new foothold plan that leads somewhere."""
        plan = inputs.foothold_plan
        return plan.request_id if plan.success else None

    def update(self, inputs: Inputs, memory: _Memory, time: float) -> _Memory:
        """Optimises the swings of the foothold plan."""
        plan = inputs.foothold_plan
        start = plan.start
        x0 = self._optimizer.model.state_from_robot_state(inputs.robot_state) if start is None else start.state
        heights = with_margin(inputs.ground_heights, inputs.plan_request.appeared)
        result = self._optimizer.optimize(x0, plan, time, known_ground(plan, inputs.region_set, heights))
        for report in result.reports:
            self.timings.record("swing", report.elapsed)
        return _Memory(result, memory.refusals + (result.refused is not None))


def _status(memory: _Memory) -> StageStatus:
    plan = memory.plan
    return StageStatus(plan.reference.stamp, plan.reference.request_id, not plan.reason, plan.reason, memory.refusals)


def _refused(memory: _Memory) -> RefusedSwings:
    plan = memory.plan
    return RefusedSwings(plan.reference.request_id, () if plan.refused is None else (plan.refused,))
