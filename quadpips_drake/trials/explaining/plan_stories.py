"""How each plan of a trial came about: the request, and what every stage of the planner made of it."""

from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.values.plans import FootholdPlan, PlanRequest, TorsoPath
from quadpips_drake.values.status import PlannerStatus
from quadpips_drake.values.swing_plan import SwingPlan

FIRST, LAST = 6, 24
"""So many plans at the beginning of a trial and at its end are kept: a long one stays within some megabytes."""
STAGES = ("torso_path", "foothold_plan", "swing_plan")
"""Ports of a planner whose values a story is made of, in the order in which they come."""


@dataclass(frozen=True, eq=False)
class PlanStory:
    """One request and its answers; frame W."""

    request: PlanRequest
    asked: float
    """When [s]."""
    phase: str
    """Of the planner when it asked."""
    reason: str
    """What the planner said then."""
    pose: np.ndarray
    """Of the base when it was asked: x, y, z [m], yaw [rad], (4,)."""
    terrain: object
    """The true Terrain then."""
    event: str = ""
    """What happened that called for it; empty for a plan that was due."""
    torso_path: TorsoPath | None = None
    foothold_plan: FootholdPlan | None = None
    swing_plan: SwingPlan | None = None
    arrived: tuple = ()
    """(port, time [s]) of each answer."""
    published: float | None = None
    """When a reference came of it [s]; None if none did."""
    outcome: str = ""
    """What the planner said next: after this plan began, or instead of it."""

    @property
    def ahead(self) -> bool:
        """Whether it was made while another plan was followed."""
        return self.request.start is not None

    @property
    def begin(self) -> np.ndarray:
        """Where the plan begins: x, y, z [m], yaw [rad] of the base, (4,)."""
        if self.torso_path is not None and self.torso_path.success:
            return self.torso_path.poses[0]
        return self.pose


class PlanRecorder:
    """Keeps the stories of the first and the last plans."""

    def __init__(self):
        self._stories: list[PlanStory] = []
        self._status = PlannerStatus.empty()
        self.left_out = 0
        """Plans between the first and the last that were let go."""

    @property
    def stories(self) -> list[PlanStory]:
        """What is kept, in order of time."""
        return list(self._stories)

    def note(self, state, request: PlanRequest, status: PlannerStatus, reference, answers: dict, terrain) -> None:
        """Takes one sample.

        Args:
            state: RobotState.
            request: the planner's last one.
            status: what it says.
            reference: WholeBodyReference that it has published.
            answers: value at each port of STAGES that the planner has.
            terrain: the true Terrain.
        """
        if request.id and not (self._stories and self._stories[-1].request.id == request.id):
            pose = np.array([*state.p_WB, state.rpy_WB[2]])
            event = status.reason if status.events != self._status.events else ""
            self._add(PlanStory(request, request.stamp, str(status.phase), status.reason, pose, terrain, event))
        said_before, self._status = self._status, status
        if not self._stories:
            return
        story = self._stories[-1]
        changes = {p: v for p, v in answers.items() if getattr(story, p) is None and request_of(v) == story.request.id}
        if changes:
            changes["arrived"] = (*story.arrived, *((port, state.stamp) for port in changes))
        if story.published is None and len(reference.times) and reference.request_id == story.request.id:
            changes["published"] = state.stamp
        if status.stamp > story.asked and status.reason not in (said_before.reason, story.reason) and not story.outcome:
            changes["outcome"] = status.reason
        if changes:
            self._stories[-1] = replace(story, **changes)

    def _add(self, story: PlanStory) -> None:
        self._stories.append(story)
        if len(self._stories) > FIRST + LAST:
            del self._stories[FIRST]
            self.left_out += 1


def request_of(value) -> int:
    """The request that a TorsoPath, FootholdPlan or SwingPlan answers."""
    return value.reference.request_id if isinstance(value, SwingPlan) else value.request_id
