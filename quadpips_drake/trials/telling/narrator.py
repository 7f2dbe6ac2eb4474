"""Looks over the shoulder of a trial and takes down, in words, what it is about."""

import numpy as np

from quadpips_drake.trials.observation import read
from quadpips_drake.trials.simulated_trial import BREAKDOWNS
from quadpips_drake.visualization.overlay.story import Story

SPEED_PERIOD = 0.5
"""Between two speeds that are told, each a mean over that time [s]."""


class Narrator:
    """Fills a Story, sample by sample; it reads output ports and nothing else, so that no result changes."""

    def __init__(self):
        self.story = Story()
        self._counts: dict[str, int] = {}
        self._elements = 0
        self._gaits: dict[int, str] = {}
        self._speed: tuple[float, np.ndarray] | None = None
        self._has_failed = False

    def look(self, trial) -> None:
        """Takes one sample of a SimulatedTrial. Whatever goes wrong here ends the telling, not the trial."""
        if self._has_failed:
            return
        try:
            self._look(trial)
        except BREAKDOWNS:
            self._has_failed = True

    def finish(self, trial) -> Story:
        """The whole story, with the end."""
        config, story = trial.config, self.story
        who = [f"planner {config.planner}"] if getattr(config, "planner", "") else []
        story.title, story.subtitle = trial.title(), ", ".join([*who, f"seed {config.seed}"])
        story.end = round(trial.context.get_time(), 3)
        if trial.verdict is not None:
            detail = f": {trial.verdict.detail}" if trial.verdict.detail else ""
            story.verdict = f"{trial.verdict.reason.replace('_', ' ')} after {story.end:.1f} s{detail}"
        return story

    def _look(self, trial) -> None:
        diagram, context = trial.diagram, trial.context
        state, reference = read(diagram, "true_robot_state", context), read(diagram, "reference", context)
        self.story.note(state.stamp, feet=int(np.dot(state.contacts, 1 << np.arange(len(state.contacts)))))
        if diagram.HasOutputPort("status"):
            self._tell_run(diagram, context, reference, state.stamp)
        if diagram.HasOutputPort("velocity_command"):
            self._tell_walk(trial, state)
        self._tell_push(state.stamp, trial.force_on_base(state.stamp))
        safety = read(diagram, "safety_status", context)
        self._count(state.stamp, {f"unstable: {event}": n for event, n in safety.counts_by_event().items()})
        elements = len(trial.present_terrain.elements)
        if elements > self._elements > 0:
            self.story.happen(state.stamp, "something appeared")
            self.story.note(state.stamp, appeared=trial.appeared())
        self._elements = elements

    def _tell_run(self, diagram, context, reference, time: float) -> None:
        status = read(diagram, "status", context)
        self.story.note(time, phase=str(status.phase), text=status.reason, gait=self._gait_of(diagram, context, reference))
        self.story.note(time, plan=f"plan {1 + status.replans}" if len(reference.times) else "no plan yet")
        if np.isfinite(status.distance_to_goal):
            self.story.note(time, goal=f"{status.distance_to_goal:.1f} m to the goal")
        self._count(time, {event.replace("_", " "): n for event, n in status.events.items()})

    def _gait_of(self, diagram, context, reference) -> str:
        """Gait of the plan behind a reference; empty where a planner has none."""
        planner = diagram.planning
        if not planner.HasOutputPort("foothold_plan"):
            return ""
        plan = read(planner, "foothold_plan", planner.GetMyContextFromRoot(context))
        self._gaits[plan.request_id] = plan.gait
        return self._gaits.get(reference.request_id, "") if len(reference.times) else ""

    def _tell_walk(self, trial, state) -> None:
        time, (forward, left, turn) = state.stamp, read(trial.diagram, "velocity_command", trial.context)
        self.story.note(time, gait=read(trial.diagram, "gait", trial.context))
        self.story.note(time, command=f"command {forward:.2f}, {left:.2f} m/s, {turn:.2f} rad/s")
        if self._speed is None or time - self._speed[0] >= SPEED_PERIOD - 1e-9:
            if self._speed is not None:
                moved = np.linalg.norm(state.p_WB[:2] - self._speed[1]) / (time - self._speed[0])
                self.story.note(time, speed=f"walks at {moved:.2f} m/s")
            self._speed = time, state.p_WB[:2]

    def _tell_push(self, time: float, force: np.ndarray) -> None:
        push = f"pushed with {np.linalg.norm(force):.0f} N" if force.any() else ""
        if push and push != self.story.at("push", time):
            self.story.happen(time, push)
        self.story.note(time, push=push)

    def _count(self, time: float, counts: dict[str, int]) -> None:
        """Tells of what has happened once more."""
        for event, number in counts.items():
            if number > self._counts.get(event, 0):
                self.story.happen(time, event)
            self._counts[event] = number
