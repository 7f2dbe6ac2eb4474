"""Causes on the way: what the robot did not see, and what stands between it and its goal."""

import re
from collections.abc import Iterator
from functools import partial

import numpy as np

from quadpips_drake.trials.reporting.case import Case, Finding
from quadpips_drake.trials.reporting.suspects import margin_of, regions_of
from quadpips_drake.trials.reporting.true_way import Obstacle, obstacle_before
from quadpips_drake.values.steppability import Steppability

_BLIND = 0.005
"""A camera that has measured less than this part of what is around it is blind [1]."""
_NEARER = 0.05
"""A robot that has come nearer to its goal by less than this has come no nearer [m]."""
_LOOKED = 1.0
"""So long it has to have looked [s]."""
_AFTER_TOUCH = 3.0
"""A fall that begins later than this after something has appeared, untouched, is not blamed on it [s]."""


def blind(case: Case) -> Iterator[Finding]:
    """The camera measured nothing all along."""
    measured, time = case.log.get("measured"), case.log.get("time")
    if measured is None or case.end < _LOOKED or not np.isfinite(measured).any():
        return
    most = float(np.nanmax(measured))
    if most >= _BLIND:
        return
    regions = case.log["region_labels"].sum(axis=1)
    text = (
        f"the camera measured nothing: {most:.1%} of the surroundings in {case.end:.1f} s; {int(regions.max())} regions at "
        "most came of it"
    )
    keys = (
        "stages.perception.depth_noise.dropout",
        "stages.station.depth_camera.max_range",
        "stages.perception.self_filter",
    )
    yield Finding("camera blind", float(time[0]), text, "depth_noise", keys, 0.97)


def nothing_steppable(case: Case) -> Iterator[Finding]:
    """The camera sees, but no region may carry a foot."""
    labels = case.log.get("region_labels")
    if labels is None or case.result.reason not in ("no_plan", "timeout"):
        return
    last = labels[case.log["time"] >= case.end - 1.0]
    carrying = last[:, [Steppability.UNKNOWN, Steppability.STEPPABLE]].sum(axis=1)
    if carrying.max() > 0:
        return
    text = f"none of the {int(last.sum(axis=1).max())} regions seen in the last second may carry a foot"
    suspect = regions_of(case.record)
    yield Finding("no steppable ground", case.end - 1.0, text, suspect.system, suspect.keys, 0.7)


def blocked(case: Case) -> Iterator[Finding]:
    """No way leads to the goal on the true terrain, with all that has appeared."""
    obstacle = _obstacle(case)
    if obstacle is None:
        return
    where = f"at ({obstacle.place[0]:.2f}, {obstacle.place[1]:.2f})"
    who = case.suspects
    if obstacle.kind == "wall" and obstacle.appeared is not None:
        at = float(case.log["appeared_time"][obstacle.appeared])
        text = (
            f"what appeared at t = {at:.2f} s stands {100 * obstacle.size:.0f} cm high before the goal {where}, and no way "
            f"leads round it{_planner_says(case)}"
        )
        yield Finding("spawned obstacle", at, text, who.appeared.system, ("spawn", *who.step.keys[:1]), 0.95)
    elif obstacle.kind == "wall":
        text = f"a wall {100 * obstacle.size:.0f} cm high keeps the robot from the goal {where}{_planner_says(case)}"
        yield Finding("goal blocked", _stuck_since(case), text, who.way.system, ("goal", "terrain"), 0.9)
    elif obstacle.kind == "gap":
        text = (
            f"a gap of {obstacle.size:.2f} m before the goal {where} is wider than "
            f"{'the longest swing' if who.longest_swing else 'a step'}, {_longest_swing(case):.2f} m{_planner_says(case)}"
        )
        keys = ("difficulty", *who.gap.keys, "goal")
        yield Finding("gap in the way", _stuck_since(case), text, who.gap.system, keys, 0.9)
    else:
        text = (
            f"a step of {obstacle.size:.2f} m before the goal {where} is higher than feet "
            f"{'are allowed to rise' if who.highest_rise else 'can rise'}, {_highest_rise(case):.2f} m{_planner_says(case)}"
        )
        keys = (*who.step.keys[:1], "difficulty", "goal")
        yield Finding("step too high", _stuck_since(case), text, who.step.system, keys, 0.9)


def hit_what_appeared(case: Case) -> Iterator[Finding]:
    """Something appeared, and the robot touched it or fell soon afterwards."""
    for spawned in case.result.spawned:
        at = spawned.get("at") if isinstance(spawned, dict) else None
        if not isinstance(at, int | float) or case.result.success:
            continue
        what, noticed = str(spawned.get("what", "something"))[:80], spawned.get("noticed")
        touched = [str(link)[:20] for link in spawned.get("touched_by", [])[:4]]
        if not (case.fell and (touched or at <= case.begin <= at + _AFTER_TOUCH)):
            continue
        seen = f"noticed at t = {noticed:.2f} s" if isinstance(noticed, int | float) else "never noticed"
        hit = f"touched by {', '.join(touched)}" if touched else "not touched"
        text = f"{what} appeared at t = {at:.2f} s, {seen}, {hit}"
        suspect = case.suspects.appeared
        weight = 0.88 if touched else 0.6
        yield Finding("spawned obstacle", float(at), text, suspect.system, ("spawn", *suspect.keys), weight)


def missed_ground(case: Case) -> Iterator[Finding]:
    """A foot went into a gap or a pit."""
    if case.result.reason == "left_terrain":
        suspect, further = case.suspects.ground, () if case.record.is_walk else margin_of(case.record).keys
        yield Finding("missed foothold", case.begin, case.result.detail, suspect.system, (*suspect.keys, *further), 0.5)


def gave_up(case: Case) -> Iterator[Finding]:
    """The planner found nothing, and the terrain does not say why."""
    reasons = [(time, text) for time, text in case.notes("planner") if "failed" in text or text.startswith("no plan")]
    if case.result.reason == "no_plan":
        time = reasons[0][0] if reasons else case.end
        text = case.result.detail or "the planner gave up"
        yield Finding("no plan", time, text, *_who_failed(case, text), 0.5)
    elif case.result.reason == "timeout":
        rate = _progress_rate(case)
        text = f"the time was over; in its last third the robot came {rate:.2f} m nearer to the goal"
        if reasons:
            text += f"; {len(reasons)} plans failed, the last one: {reasons[-1][1]}"
        suspect = case.suspects.pace
        yield Finding("too slow", case.end, text, suspect.system, suspect.keys, 0.3)


def _who_failed(case: Case, text: str) -> tuple[str, tuple[str, ...]]:
    """The system that a planner's words are about, and its settings."""
    search = case.suspects.search
    if search.system != "foothold_planner":  # only that of QuadPiPS has stages that fail each in its own words
        return search.system, search.keys
    if re.search(r"stances refused|foothold|swings? to", text):
        return search.system, search.keys
    if re.search(r"region|legs have ground|blocked|connected", text):
        return "torso_planner", ("stages.planning.torso.max_edge_length", "goal")
    return "swing_trajectory_optimizer", ("stages.planning.swings.max_iterations",)


def _obstacle(case: Case) -> Obstacle | None:
    """What stands before the goal, from where the robot was at the end (of a fall: before it began)."""
    record = case.record
    if record.is_walk or record.terrain is None or record.robot is None or case.result.success:
        return None
    if not np.isfinite(case.position(case.begin)).all():
        return None
    since = case.log.get("appeared_time", np.zeros(0))
    appeared = (case.log["appeared_low"], case.log["appeared_high"]) if len(since) else None
    search = partial(
        obstacle_before,
        record.terrain,
        case.position(case.begin)[:2],
        step=_highest_rise(case),
        gap=_longest_swing(case),
        half_width=0.5 * float(np.ptp(record.robot.nominal_footholds_B[:, 1])),
    )
    return search(appeared=appeared)


def _longest_swing(case: Case) -> float:
    return _limit(case, case.suspects.longest_swing, 0.5)


def _highest_rise(case: Case) -> float:
    return _limit(case, case.suspects.highest_rise, 0.25)


def _limit(case: Case, key: str, usual: float) -> float:
    """The value at a key [m]; ``usual`` where the planner has no such limit."""
    return float(case.record.setting(key, usual)) if key else usual


def _planner_says(case: Case) -> str:
    """What the planner said last about a failure."""
    said = [text for _, text in case.notes("planner") if "blocked" in text or "failed" in text]
    return f' (the planner: "{said[-1]}")' if said else ""


def _stuck_since(case: Case) -> float:
    """When the planner first found nothing, or the robot came no nearer to the goal any more [s]; not after the chain."""
    failed = [time for time, text in case.notes("planner") if "failed" in text]
    distances = np.hypot(*(case.log["p_WB"][:, :2] - np.asarray(case.record.terrain.goal)).T)
    near = float(case.log["time"][int(np.argmax(distances <= np.nanmin(distances) + _NEARER))])
    return min([near, case.begin, *failed])


def _progress_rate(case: Case) -> float:
    """By how much the robot came nearer to the goal in the last third of its time [m]."""
    if case.record.terrain is None:
        return float("nan")
    goal, path = np.asarray(case.record.terrain.goal), case.log["p_WB"][:, :2]
    distances = np.hypot(*(path - goal).T)
    return float(distances[2 * len(distances) // 3] - distances[-1])
