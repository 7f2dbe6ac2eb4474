"""explain.html: how each plan of a trial came about, and how it ended, as one page that needs no network."""

from html import escape

import numpy as np

from quadpips_drake.html_page import page, picture, table
from quadpips_drake.trials.explaining.end_section import end_section
from quadpips_drake.trials.explaining.explainer import Explainer
from quadpips_drake.trials.explaining.last_moments import moments_of
from quadpips_drake.trials.explaining.plan_map import plan_map
from quadpips_drake.trials.explaining.plan_stories import FIRST, LAST, PlanStory
from quadpips_drake.trials.explaining.plan_words import (
    foothold_words,
    refusal_rows,
    swing_rows,
    torso_words,
    way_of,
    why_asked,
)
from quadpips_drake.trials.result import TrialResult


def explanation_of(trial, explainer: Explainer, result: TrialResult) -> str:
    """Returns the page about a SimulatedTrial that has run under the eyes of ``explainer``."""
    title = f"{trial.title()}, seed {result.seed}"
    parts = [f"<h1>{escape(title)}</h1>", _outcome(result)]
    if explainer.problem:
        parts.append(f"<p><b>What follows ends early</b>, the looking broke off {escape(explainer.problem)}</p>")
    moments = moments_of(trial.log.arrays(), trial.robot, trial.present_terrain)
    stories = explainer.plans.stories
    if result.reason == "no_plan" and stories:
        parts.append(_no_plan(stories[-1], trial, result))
    if not result.success and moments is not None:
        parts.append(end_section(moments, result))
    if stories:
        parts.append(_overview(stories, explainer.plans.left_out))
        configured = _configured_gait(trial.config)
        parts += [_plan(story, trial.robot, configured) for story in stories]
    else:
        parts.append("<p>No plan was asked for, or this planner does not tell how it plans.</p>")
    return page(f"Explained: {title}", "\n".join(parts))


def _configured_gait(config) -> str:
    """The gait in the configuration of the planner; empty for one that has none."""
    planning = getattr(getattr(config, "stages", None), "planning", None)
    return getattr(getattr(planning, "footholds", None), "gait", "")


def _outcome(result: TrialResult) -> str:
    word = "success" if result.success else "failure"
    ended = f"{word}: {result.reason.replace('_', ' ')} at t = {result.sim_time:.2f} s"
    return f"<p>{escape(ended)}{escape(f': {result.detail}' if result.detail else '')}. Times t are simulated ones.</p>"


def _no_plan(story: PlanStory, trial, result: TrialResult) -> str:
    """The section about a planner that gave up."""
    path, plan = story.torso_path, story.foothold_plan
    said = [("the planner gave up", result.detail)]
    if path is not None and path.reason:
        said.append(("torso search", path.reason))
    if plan is not None and plan.reason and plan.reason != (path.reason if path else ""):
        said.append(("foothold search", plan.reason))
    if story.swing_plan is not None and story.swing_plan.reason:
        said.append(("swings", story.swing_plan.reason))
    blocked = ""
    if path is not None and len(path.nodes) and not path.reached.all():
        red = path.nodes[~path.reached]
        near = np.hypot(*(red[:, :2] - story.request.goal).T).min()
        blocked = (
            "<p>Red nodes are poses with ground for all legs that no way leads to, the nearest of them "
            f"{near:.2f} m from the goal: what blocks lies between the blue and the red ones.</p>"
        )
    rows = ((escape(who), escape(what)) for who, what in said)
    image = picture(plan_map(story, trial.robot), "map of the last plan")
    return f"<h2>Why there is no plan</h2>{table(('who', 'says'), rows, text=(0, 1))}{blocked}<p>{image}</p>"


def _overview(stories: list[PlanStory], left_out: int) -> str:
    """The table of all plans."""
    head = (
        "plan",
        "asked at t [s]",
        "made",
        "why",
        "gait",
        "swings planned / used",
        "expansions",
        "computed [ms]",
        "what came of it",
    )
    note = f"<p>{left_out} plans between the first {FIRST} and the last {LAST} are left out.</p>" if left_out else ""
    return f"<h2>Plans</h2>{note}{table(head, map(_overview_row, stories), text=(2, 3, 4, 8))}"


def _overview_row(story: PlanStory) -> tuple:
    plan, swings = story.foothold_plan, story.swing_plan
    used = sum(report.used for report in swings.reports) if swings is not None else 0
    computed = sum(1e3 * value.elapsed for value in (plan, swings) if value is not None)
    return (
        f'<a href="#plan{story.request.id}">{story.request.id}</a>',
        f"{story.asked:.2f}",
        "while walking" if story.ahead else "from a stand",
        escape(why_asked(story)),
        escape(plan.gait if plan is not None and plan.gait else "-"),
        f"{len(plan.swing_legs) if plan is not None else 0} / {used}",
        plan.expansions if plan is not None else 0,
        f"{computed:.0f}",
        escape(way_of(story)),
    )


def _plan(story: PlanStory, robot, configured: str) -> str:
    """The section about one plan."""
    number = story.request.id
    arrived = ", ".join(f"{port.replace('_', ' ')} at t = {time:.2f} s" for port, time in story.arrived) or "nothing"
    facts = [
        ("asked", f"at t = {story.asked:.2f} s, {'while walking' if story.ahead else 'standing'}: {why_asked(story)}"),
        ("torso path", torso_words(story)),
        ("footholds", foothold_words(story, configured)),
        ("arrived", arrived),
        ("came of it", way_of(story)),
    ]
    rows = ((f"<b>{escape(name)}</b>", escape(text)) for name, text in facts)
    tables = []
    if story.foothold_plan is not None and story.foothold_plan.considered:
        head = ("stances refused by", "stances", "of all looked at")
        tables.append(table(head, refusal_rows(story.foothold_plan)))
    if story.swing_plan is not None and (story.swing_plan.reports or story.swing_plan.refused):
        head = ("swing", "legs", "status", "iterations", "violation [1]", "landing error [mm]", "computed [ms]")
        tables.append(table(head, swing_rows(story.swing_plan), text=(1, 2)))
    image = picture(plan_map(story, robot), f"map of plan {number}")
    return f"""<h3 id="plan{number}">Plan {number}</h3>
{table(("", ""), rows, text=(0, 1))}
<p>{image}</p>
<div class="tables">{"".join(f"<div>{t}</div>" for t in tables)}</div>"""
