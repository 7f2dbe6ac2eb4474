"""What a report says in few words: the verdict in a sentence, and the last lines of the terminal."""

import numpy as np

from quadpips_drake.trials.reporting.post_mortem import PostMortem
from quadpips_drake.trials.reporting.trial_record import TrialRecord
from quadpips_drake.trials.result import TrialResult

_ENDS = {
    "goal_reached": "reached its goal",
    "upright": "stayed upright",
    "fell": "fell",
    "left_terrain": "stepped beside the terrain",
    "timeout": "did not reach its goal in time",
    "no_plan": "found no way to its goal",
    "interrupted": "was interrupted",
    "error": "broke off",
}
_LENGTHS = {"landing_error_p50": "median landing error", "landing_error_max": "largest", "deepest_m": "deepest below ground"}
"""Entries that are lengths [m], as they are called."""


def verdict(record: TrialRecord, found: PostMortem | None) -> str:
    """One sentence: who did what, when, and after a failure why."""
    result = record.result
    what = f"{result.robot} on {result.terrain} {_ENDS[result.reason]} after {result.sim_time:.1f} s"
    if result.success:
        return f"{what}{_how(record)}."
    detail = f" ({result.detail})" if result.detail else ""
    first = found.first if found is not None else None
    if first is None:
        return f"{what}{detail}."
    return f"{what}{detail}, most likely because of {_article(first.cause)}: {first.text}."


def counted(entries: dict) -> str:
    """What was counted, events for example, and how far feet came down beside their footholds."""

    def told(key, value) -> str:
        if key in _LENGTHS and isinstance(value, int | float):
            return f"{_LENGTHS[key]} {1e3 * value:.1f} mm"
        return f"{str(key).replace('_', ' ')} {value}"

    return ", ".join(told(key, value) for key, value in entries.items() if value) or "none"


def _article(cause: str) -> str:
    """A cause as it is called in a sentence."""
    named = {"camera blind": "a blind camera", "goal blocked": "a blocked goal", "step too high": "a step that is too high"}
    counted_ones = ("push", "payload", "gap in the way", "spawned obstacle", "slip", "missed foothold", "foot astray")
    return named.get(cause, f"a {cause}" if cause in counted_ones else cause)


def _how(record: TrialRecord) -> str:
    """How well it went."""
    result, parts = record.result, []
    if not record.is_walk:
        parts.append(f"{result.replans + 1} plans")
    if result.footholds.get("planned"):
        parts.append(f"{result.footholds['planned']} footholds, {result.footholds.get('missed', 0)} missed")
        parts.append(f"{result.footholds.get('slipped', 0)} slipped")
    fallbacks = sum(n for n in result.fallbacks.values() if isinstance(n, int))
    parts.append(f"{fallbacks} fallbacks")
    if len(record.log):
        parts.append(f"tilt {np.nanmax(np.abs(record.log['rpy_WB'][:, :2]), initial=0.0):.2f} rad at most")
    return f" ({', '.join(parts)})"


def last_lines(result: TrialResult, again: str) -> list[str]:
    """Lines for the terminal after a failure: what came first, where to look, how to see it again.

    Args:
        result: with its ``cause``; empty if there is none.
        again: the command that repeats the trial.
    """
    cause = result.cause
    if not cause:
        return []
    when = "from the beginning" if cause["time"] <= 0.0 else f"at t = {cause['time']:.2f} s"
    return [
        f"cause:     {cause['cause']}, {when}: {cause['text']}",
        f"look at:   {'; '.join(dict.fromkeys((cause['system'], ', '.join(cause['keys']))))}",
        f"repeat:    {again}",
    ]
