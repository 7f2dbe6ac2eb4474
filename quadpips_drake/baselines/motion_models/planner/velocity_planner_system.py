"""VelocityPlanner: the planner over velocity commands as a system."""

import numpy as np

from quadpips_drake.baselines.motion_models.planner.command_search import CommandSearch, VelocityPlan
from quadpips_drake.baselines.motion_models.planner.foot_costmap import FootCostmap
from quadpips_drake.baselines.motion_models.planner.variants import Belief
from quadpips_drake.baselines.motion_models.planner.velocity_planner_config import VelocityPlannerConfig
from quadpips_drake.baselines.motion_models.planner.velocity_planning import STANCE, PlanningMemory, VelocityPlanning
from quadpips_drake.framework.stage import Inputs, Stage
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.plans import PlanSketch
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.status import PlannerReport, PlannerStatus, SafetyStatus

SEARCH = "command_search"
"""Under which computing times of searches are filed."""


class VelocityPlanner(Stage):
    """Chooses a velocity command at each exchange of the feet, so that coming footholds are safe.

    Algorithm 1 of Taouil et al. (arXiv 2307.12292) over linear motion models; see ``velocity_planning`` and
    ``command_search``. Of the walk that follows the commands it sees nothing.

    .. pydrake_system::

        name: VelocityPlanner
        input_ports:
        - robot_state
        - foot_costmap
        - safety_status (optional)
        - goal
        output_ports:
        - velocity_command
        - gait
        - plan
        - status
        - velocity_plan
        - report

    - robot_state: RobotState, frame W; looked at ``config.rate`` (200 Hz) for exchanges of the feet in its contacts.
    - foot_costmap: FootCostmap, frame W; read at each exchange.
    - safety_status (optional): SafetyStatus; while it is unstable the plan is dropped and the robot is to stand.
    - goal: x, y in W [m], vector (2,).
    - velocity_command: forward, left [m/s], yaw rate [rad/s] in the heading frame of the robot, vector (3,); zero while it
      is to stand.
    - gait: str, name of the gait; "stance" while it is to stand.
    - plan: PlanSketch of the planned footholds, frame W.
    - status: PlannerStatus; in the phase ``no_plan`` the robot is to stand for good.
    - velocity_plan: VelocityPlan, frame W; the newest one.
    - report: PlannerReport: plans, what they cost, how long searches took, and how well the first steps were predicted.
    """

    def __init__(
        self,
        robot,
        gait: str,
        belief: Belief | None,
        config: VelocityPlannerConfig | None = None,
        *,
        timings: StageTimings | None = None,
    ):
        """
        Args:
            robot: RobotModel.
            gait: name of the gait to walk in.
            belief: what commands lead to; None: nobody looks where feet come down.
            config: of all.
            timings: collects computing times.
        """
        super().__init__("velocity_planner", config or VelocityPlannerConfig(), memory=PlanningMemory(), timings=timings)
        c, search = self.config, None
        if belief is not None:
            walk = {"acceleration": belief.acceleration, "goal_tolerance": c.goal_tolerance}
            search = CommandSearch(belief.models, c.search, **walk)
        self._planning = VelocityPlanning(robot, gait, c, search)
        self.declare_input("robot_state", RobotState)
        self.declare_input("foot_costmap", FootCostmap)
        self.declare_input("safety_status", SafetyStatus, default=SafetyStatus.empty())
        self.declare_vector_input("goal", 2)
        self.declare_vector_output("velocity_command", 3, lambda memory: memory.command)
        self.declare_output("gait", str, lambda memory: memory.gait, example=STANCE)
        self.declare_output("plan", PlanSketch, lambda memory: sketch_of(memory.plan))
        self.declare_output("status", PlannerStatus, status_of)
        self.declare_output("velocity_plan", VelocityPlan, lambda memory: memory.plan)
        self.declare_output("report", PlannerReport, report_of)

    def update(self, inputs: Inputs, memory: PlanningMemory, time: float) -> PlanningMemory:
        """Looks at the robot, and plans when a step begins."""
        following = self._planning.update(
            memory, inputs.robot_state, inputs.goal, inputs.safety_status, lambda: inputs.foot_costmap
        )
        if following.plans > memory.plans:
            self.timings.record(SEARCH, following.elapsed - memory.elapsed)
        return following


def status_of(memory: PlanningMemory) -> PlannerStatus:
    """What is going on, as trials and judges see it."""
    return PlannerStatus(
        memory.stamp,
        memory.phase,
        memory.reason,
        replans=max(memory.plans - 1, 0),
        fallbacks=dict(memory.fallbacks),
        events={"broken_off": memory.broken_off} if memory.broken_off else {},
        distance_to_goal=memory.distance,
    )


def report_of(memory: PlanningMemory) -> PlannerReport:
    """What result.json says: ``plans``, how many; ``cumulative_cost``, the sum of what the first node of each costs [m];
    ``expansions`` and ``search_ms`` in the mean; ``errors`` of the models, see PredictionErrors; where they
    go on learning also ``errors_without_adaptation``, of the models as they were."""
    count = max(memory.plans, 1)
    facts = {
        "plans": memory.plans,
        "cumulative_cost": round(memory.cost, 4),
        "expansions": round(memory.expansions / count, 2),
        "search_ms": round(1e3 * memory.elapsed / count, 4),
        "errors": memory.errors.plain(),
    }
    if memory.adaptation is not None:
        facts["errors_without_adaptation"] = memory.first_errors.plain()
    return PlannerReport(memory.stamp, facts)


def sketch_of(plan: VelocityPlan) -> PlanSketch:
    """The footholds that a plan has still to come to, and where it leads the base."""
    if not len(plan.commands) or len(plan.feet) != len(plan.commands) + 1:
        return PlanSketch(plan.stamp, plan.id)
    points, legs = [], []
    for step in range(len(plan.commands)):
        swing = (plan.swing + step) % 2
        for leg in (swing, 3 - swing):
            points.append(plan.feet[step + 1, leg])
            legs.append(leg)
    height = float(plan.feet[-1, :, 2].mean())
    return PlanSketch(
        stamp=plan.stamp,
        id=plan.id,
        points=np.array(points),
        normals=np.tile([0.0, 0.0, 1.0], (len(points), 1)),
        legs=np.array(legs),
        waypoint=np.array([*plan.bases[-1], height]),
    )
