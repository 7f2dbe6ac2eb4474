"""What there is to say about a plan: why it was asked for, what the stages made of it, what came of it."""

from collections.abc import Iterator
from html import escape

import numpy as np

from quadpips_drake.trials.explaining.plan_stories import PlanStory
from quadpips_drake.values.plans import FootholdPlan
from quadpips_drake.values.swing_plan import SwingPlan

_NEARER = 0.05
"""A sub-goal that is nearer to the goal than where the path begins by more than this [m] is chosen for that."""


def why_asked(story: PlanStory) -> str:
    """Why there was a request."""
    if story.ahead:
        start, event = story.request.start, f"{story.event}: " if story.event else ""
        return f"{event}to go on from plan {start.follows} at t = {start.time:.2f} s, {start.time - story.asked:.2f} s ahead"
    return story.reason or "nothing was followed"


def way_of(story: PlanStory) -> str:
    """What came of the request."""
    if story.published is not None:
        word = "joined to the plan before it" if story.ahead else "followed"
        short = story.swing_plan is not None and story.swing_plan.reason
        return f"{word} from t = {story.published:.2f} s on" + (f", but ends early: {short}" if short else "")
    for answer in (story.torso_path, story.foothold_plan, story.swing_plan):
        if answer is not None and answer.reason:
            return f"no motion: {answer.reason}"
    return f"not followed: {story.outcome}" if story.outcome else "not followed before the trial ended"


def torso_words(story: PlanStory) -> str:
    """What the torso search found."""
    path = story.torso_path
    if path is None:
        return "no answer"
    regions = f"{len(path.regions.regions)} regions of t = {path.regions.stamp:.2f} s"
    nodes = f"{int(path.reached.sum())} of {len(path.nodes)} nodes reached" if len(path.nodes) else "no nodes"
    if not path.success:
        return f"none: {path.reason} ({regions}, {nodes})"
    length = np.hypot(*np.diff(path.poses[:, :2], axis=0).T).sum()
    left = np.hypot(*(path.poses[-1, :2] - story.request.goal))
    whole = np.hypot(*(path.poses[0, :2] - story.request.goal))
    why = "nearer to the goal" if left < whole - _NEARER else "from where more is to be seen"
    end = (
        "the goal" if path.to_goal else f"a sub-goal {why}, {left:.2f} m from the goal ({whole:.2f} m from where it begins)"
    )
    return f"{length:.2f} m to {end}; {regions}, {nodes}, viewpoints so far: {len(path.viewpoints)}"


def foothold_words(story: PlanStory, configured: str) -> str:
    """What the foothold search found, in which gait, and why in that one.

    Args:
        story: of the plan.
        configured: gait of the configuration; empty if not known.
    """
    plan = story.foothold_plan
    if plan is None:
        return "no answer"
    searched = f"{plan.expansions} expansions in {1e3 * plan.elapsed:.0f} ms"
    if plan.time_limit_hit:
        searched += ", cut short by the limit on computing time"
    if not plan.success:
        return f"none: {plan.reason} ({searched})"
    level = story.request.level
    why = "the configured one" if plan.gait == configured else f"in place of {configured}" if configured else "the planner's"
    why += f", because {plan.gait_reason}" if plan.gait_reason else ""
    why += f", at level {level} of escalation after failures or an instability" if level else ""
    where = "to the waypoint" if plan.complete else "towards the waypoint, which they do not reach"
    return f"{len(plan.swing_legs)} swings {where}; gait {plan.gait}, {why}; {searched}"


def refusal_rows(plan: FootholdPlan) -> Iterator[tuple]:
    """Rows of the table of refused stances: constraint, number, share; and those that were permitted."""
    for constraint, count in sorted(plan.refusals.items(), key=lambda item: -item[1]):
        yield escape(constraint), count, f"{100.0 * count / plan.considered:.0f} %"
    permitted = plan.considered - sum(plan.refusals.values())
    yield "none: permitted", permitted, f"{100.0 * permitted / plan.considered:.0f} %"


def swing_rows(plan: SwingPlan) -> Iterator[tuple]:
    """Rows of the table of swings."""
    for report in plan.reports:
        legs = " ".join(leg.name for leg in report.legs)
        status = report.status if report.used else f"refused: {report.status}"
        error = f"{1e3 * report.landing_error:.1f}" if np.isfinite(report.landing_error) else "-"
        violation = f"{report.constraint_violation:.1e}" if np.isfinite(report.constraint_violation) else "-"
        yield report.number + 1, legs, escape(status), report.iterations, violation, error, f"{1e3 * report.elapsed:.0f}"
    if plan.refused is not None:
        legs = " ".join(leg.name for leg in plan.refused.legs)
        yield "", legs, escape(f"no motion was found: {plan.refused.reason or plan.reason}"), "", "", "", ""
