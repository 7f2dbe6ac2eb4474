"""One trial of the offline experiment: searches and swing optimisations from the start to the goal, without a simulation."""

import gc
import time
from dataclasses import asdict, dataclass, field, replace

import numpy as np

from quadpips_drake.benchmark.experience.collisions import first_contact
from quadpips_drake.benchmark.experience.course import OfflineCourse
from quadpips_drake.diagrams.planning_module import PlanningConfig
from quadpips_drake.planning.experience.edge_experience import EdgeExperience
from quadpips_drake.planning.experience.learning import TriedSwing, learned, tried_swing, tried_swings
from quadpips_drake.planning.footholds.foothold_search import search_footholds
from quadpips_drake.planning.start_stance import state_at_start
from quadpips_drake.planning.torso.subgoals import Exploration
from quadpips_drake.planning.torso.torso_search import search_torso_path
from quadpips_drake.trajectory.swing.swing_optimizer import SwingOptimizer, known_ground
from quadpips_drake.values.images import LabelImage
from quadpips_drake.values.plans import FootholdPlan, PlanStart
from quadpips_drake.values.swing_plan import ExperienceLibrary, SwingOutcome, SwingPlan

_MAX_PLANS = 30
"""Plans after which a trial that goes round and round is over."""
GOAL, FAILED_SWING, COLLISION, NO_PLAN = "goal", "failed swing", "collision", "no plan"
"""How a trial ends."""


@dataclass
class TrialRow:
    """What came of one trial."""

    result: str = NO_PLAN
    detail: str = ""
    plans: int = 0
    swings: int = 0
    """That succeeded."""
    path_cost: float = 0.0
    """Of the plans, as the searches count [m]."""
    motion_cost: float = 0.0
    """Mean optimal cost of the swings that were tried."""
    search_ms: list = field(default_factory=list)
    """CPU time of each foothold search."""
    expansions: list = field(default_factory=list)
    optimization_ms: float = 0.0
    """CPU time of all swing optimisations."""
    records: int = 0
    """In the library afterwards."""
    repeated: bool = False
    """Whether it was not run, because it would have been the same as the last one to the bit."""

    @property
    def success(self) -> bool:
        """Whether it came to the goal."""
        return self.result == GOAL

    def as_dict(self) -> dict:
        """For a file."""
        return {key: _rounded(value) for key, value in asdict(self).items()}


def _rounded(value):
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return round(value, 4) if isinstance(value, float) else value


class Walker:
    """Runs trials on one course."""

    def __init__(self, course: OfflineCourse, config: PlanningConfig):
        self.course, self.config = course, config
        self._optimizer = SwingOptimizer(course.robot, config.swings)
        self._warm_up()

    def _warm_up(self):
        """Loads the compiled code of the searches; and what was loaded so far is no garbage: looking through it takes 0.1 s,
        which would count for whichever search is under way."""
        state, settings = self.course.start_state(), self.config.experience
        row, goal = TrialRow(), np.asarray(self.course.terrain.goal)
        path = self._torso_path(state, goal, 1, 0, Exploration().standing_at((*state.p_WB[:2], 0.0), goal))
        plan = self._footholds(state, path, None, None, row)
        if plan.success:
            known = learned(ExperienceLibrary(settings.scope), [tried_swing(plan, 0, SwingOutcome.FAILED, np.nan)], settings)
            self._footholds(state, path, None, EdgeExperience.of(known, settings), row)
        gc.collect()
        gc.freeze()

    def trial(
        self, library: ExperienceLibrary, labels: LabelImage | None = None, level: int = 0
    ) -> tuple[TrialRow, list[TriedSwing]]:
        """Plans and optimises until the goal, the first swing that fails, or too many plans that failed.

        Args:
            library: what is known; empty: nothing.
            labels: the mask, taken once before all searches; only looked at if labels count.
            level: of escalation, with which it begins.

        Returns: what came of it, and the swings that were tried.
        """
        row, tries, costs = TrialRow(), [], []
        experience = EdgeExperience.of(library, self.config.experience)
        measured = self.course.start_state()
        start = PlanStart(0, 0.0, self._optimizer.model.state_from_robot_state(measured))
        failed, path, exploration, goal = 0, None, Exploration(), np.asarray(self.course.terrain.goal)
        while row.plans < _MAX_PLANS and failed < self.config.monitor.max_failed_plans:
            state = state_at_start(measured, start)
            if np.hypot(*(state.p_WB[:2] - goal)) < self.config.monitor.goal_tolerance:
                row.result = GOAL
                break
            row.plans += 1
            pose = (*state.p_WB[:2], float(state.rpy_WB[2]))
            exploration = exploration.standing_at(pose, goal, path.poses if failed else None)
            path = self._torso_path(state, goal, row.plans, level, exploration)
            exploration = exploration.after(path)
            plan = self._footholds(state, path, labels, experience, row)
            if not plan.success:
                failed, level, row.detail = failed + 1, level + 1, plan.reason
                continue
            failed, level, row.path_cost = 0, max(level - 1, 0), row.path_cost + plan.cost
            began = time.thread_time()
            swings = self._optimizer.optimize(
                start.state, replace(plan, start=start), 0.0, known_ground(plan, path.regions, self.course.heights)
            )
            row.optimization_ms += 1e3 * (time.thread_time() - began)
            tried, row.result, row.detail = self._judged(plan, swings)
            tries += tried
            costs += [attempt.cost for attempt in tried if attempt.outcome is not SwingOutcome.FAILED]
            row.swings += len(tried) - bool(row.detail)
            if row.detail:
                break
            start = PlanStart(row.plans, 0.0, swings.reference.states[-1])
        row.motion_cost = float(np.mean(costs)) if costs else 0.0
        return row, tries

    def _torso_path(self, state, goal, request_id: int, level: int, exploration: Exploration):
        return search_torso_path(
            state.p_WB, state.rpy_WB[2], self.course.regions_around(state), goal, self.course.robot, self.config.torso,
            request_id=request_id, level=level, exploration=exploration,
        )  # fmt: skip

    def _footholds(self, state, path, labels, experience, row: TrialRow) -> FootholdPlan:
        began = time.thread_time()
        plan = search_footholds(
            state, path.regions, path, self.course.robot, self.config.footholds, labels=labels, experience=experience
        )
        row.search_ms.append(1e3 * (time.thread_time() - began))
        row.expansions.append(plan.expansions)
        return plan

    def _judged(self, plan: FootholdPlan, swings: SwingPlan) -> tuple[list[TriedSwing], str, str]:
        """The swings that were tried, up to the first that fails or touches something; how that ended, and why, if so."""
        tried = list(tried_swings(plan, swings))
        found = sum(attempt.outcome is not SwingOutcome.FAILED for attempt in tried)
        if found:
            contact = first_contact(self.course.robot, swings.reference.states, self.course.centers, self.course.radii)
            if contact is not None:
                number = min(int(contact.state * found / (len(swings.reference.states) - 1)), found - 1)
                touching = tried_swing(plan, number, SwingOutcome.FAILED, np.nan)
                detail = f"{contact.leg.name} touches sphere {contact.sphere} in swing {number + 1}"
                return [*tried[:number], touching], COLLISION, detail
        if swings.reason:
            return tried, FAILED_SWING, swings.reason
        return tried, NO_PLAN, ""
