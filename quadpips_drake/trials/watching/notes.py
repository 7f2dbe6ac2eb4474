"""What systems say in words during a trial, and when: taken down whenever it changes."""

from quadpips_drake.trials.observation import Observation
from quadpips_drake.trials.trial_log import TrialLog
from quadpips_drake.values.status import PlannerStatus

PLANNER, PLAN, SAFETY, MPC, WBC = "planner", "plan", "safety", "mpc", "wbc"
"""Who says something."""
STABLE_AGAIN = "stable again"


class NoteTaker:
    """Writes into a log what is new; it reads output ports and nothing else."""

    def __init__(self, log: TrialLog):
        self._log = log
        self._said: dict = {}

    def look(self, seen: Observation, status: PlannerStatus | None = None, plan=None) -> None:
        """Takes one sample.

        Args:
            seen: what an onlooker sees.
            status: of the planner, if there is one.
            plan: its FootholdPlan, if it has such.
        """
        now, safety = seen.robot_state.stamp, seen.safety_status
        self._note(now, SAFETY, safety.unstable and (safety.reason or "unstable"), STABLE_AGAIN)
        policy, command = seen.mpc_policy, seen.command
        failed = not policy.is_empty and not policy.success
        self._note(now, MPC, failed and f"the solver found nothing: {policy.status}", "the solver finds solutions again")
        failed = command.success is False
        self._note(now, WBC, failed and f"the solver found nothing: {command.status}", "the solver finds solutions again")
        if status is not None:
            self._note(now, PLANNER, f"{str(status.phase).replace('_', ' ')}: {status.reason}")
        if plan is not None and plan.request_id > 0:
            what = f"{plan.gait}, {len(plan.swing_legs)} swings" if plan.success else f"none: {plan.reason}"
            self._note(now, PLAN, f"plan {plan.request_id}: {what}")

    def _note(self, time: float, source: str, text, over: str = "") -> None:
        """Takes down ``text`` if it is another one than last time; where there is none any more, that it is ``over``."""
        text = text or ""
        if text == self._said.get(source, ""):
            return
        self._said[source] = text
        self._log.note(time, source, text or over)
