"""Looks over the shoulder of a trial, for explain.html."""

import traceback

from quadpips_drake.trials.explaining.plan_stories import STAGES, PlanRecorder
from quadpips_drake.trials.observation import read
from quadpips_drake.trials.simulated_trial import BREAKDOWNS


class Explainer:
    """Collects, sample by sample, what the page is made of; it reads output ports and nothing else, so no result changes."""

    def __init__(self):
        self.plans = PlanRecorder()
        self.problem = ""
        """Why it stopped looking; empty unless something broke."""

    def look(self, trial) -> None:
        """Takes one sample of a SimulatedTrial. Whatever goes wrong here ends the looking, not the trial."""
        if self.problem:
            return
        try:
            self._look(trial.diagram, trial.context, trial.present_terrain)
        except BREAKDOWNS:
            self.problem = f"at t = {trial.context.get_time():.2f} s: {traceback.format_exc(limit=-1)}"

    def _look(self, diagram, context, terrain) -> None:
        planner = getattr(diagram, "planning", None)
        if planner is None or not planner.HasOutputPort("plan_request"):
            return
        inside = planner.GetMyContextFromRoot(context)
        answers = {port: read(planner, port, inside) for port in STAGES if planner.HasOutputPort(port)}
        state, status = read(diagram, "robot_state", context), read(diagram, "status", context)
        reference = read(diagram, "reference", context)
        self.plans.note(state, read(planner, "plan_request", inside), status, reference, answers, terrain)
