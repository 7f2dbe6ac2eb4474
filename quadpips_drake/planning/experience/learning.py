"""Learning from swings that were tried: a running mean of the optimal cost of each transition."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.gaits.swing_gaits import swing_gait
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.planning.experience.experience_config import ExperienceConfig
from quadpips_drake.values.plans import FootholdPlan
from quadpips_drake.values.swing_plan import ExperienceLibrary, SwingOutcome, SwingPlan

RECORD_FIELDS = ("phase", "legs", "before", "after", "count", "cost", "status", "last")
"""The arrays of an ExperienceLibrary."""
_OUTCOMES = {"converged": SwingOutcome.CONVERGED, "unconverged": SwingOutcome.UNCONVERGED}


@dataclass(frozen=True)
class TriedSwing:
    """One attempt at a transition."""

    phase: int
    """Of the gait."""
    legs: tuple
    """That swing."""
    before: np.ndarray
    """Ground points of all feet in W [m], (4, 3) ..."""
    after: np.ndarray
    """... and after it."""
    outcome: SwingOutcome
    cost: float
    """Of the optimal motion [1]; when there is none it does not count."""


def tried_swings(plan: FootholdPlan, swings: SwingPlan) -> tuple[TriedSwing, ...]:
    """Returns the swings of ``plan`` that were tried, the failed one included; those after it were not.

    Args:
        plan: what was asked for.
        swings: what the optimiser made of it.
    """
    results = {report.number: (_OUTCOMES.get(report.status, SwingOutcome.FAILED), report.cost) for report in swings.reports}
    if swings.refused is not None:  # also where no configuration was found, of which there is no report
        number = _number_of(swings.refused, plan)
        results.setdefault(number, (SwingOutcome.FAILED, np.nan))
    return tuple(tried_swing(plan, number, *result) for number, result in sorted(results.items()))


def tried_swing(plan: FootholdPlan, number: int, outcome: SwingOutcome, cost: float) -> TriedSwing:
    """Swing ``number`` of a plan, counted from 0, as something that was tried."""
    legs, before, after = plan.swing_legs[number], plan.stances[number], plan.stances[number + 1]
    phases = [set(phase) for phase in swing_gait(plan.gait).phases]
    phase = phases.index(set(legs)) if set(legs) in phases else len(phases)  # swings in any order may be of another gait
    return TriedSwing(phase, tuple(legs), before.footholds, after.footholds, outcome, cost)


def _number_of(refused, plan: FootholdPlan) -> int:
    """Which swing of ``plan`` was refused."""
    for number, (legs, before, after) in enumerate(zip(plan.swing_legs, plan.stances[:-1], plan.stances[1:], strict=True)):
        same = tuple(legs) == refused.legs and np.array_equal(before.footholds, refused.start)
        if same and np.array_equal(after.footholds, refused.end):
            return number
    raise ValueError("what was refused is no swing of this plan")


def learned(library: ExperienceLibrary, tries: Iterable[TriedSwing], config: ExperienceConfig) -> ExperienceLibrary:
    """Returns ``library`` with the ``tries`` of one more trial; the mean over n attempts is ((n - 1) mean + cost) / n."""
    now = library.trials + 1
    fields = {name: getattr(library, name).copy() for name in RECORD_FIELDS}
    for attempt in tries:
        _add(fields, attempt, library.scope, now, config)
    if len(fields["count"]) > config.max_records:
        least_used = np.lexsort((fields["last"], fields["count"]))
        kept = np.sort(least_used[len(least_used) - config.max_records :])
        fields = {name: values[kept] for name, values in fields.items()}
    return replace(library, trials=now, **fields)


def leg_bits(legs: Iterable) -> int:
    """The legs as a number."""
    return sum(1 << int(leg) for leg in legs)


def heading_frame(feet: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Origin in W [m] (3,) and axes (3, 3) of the heading frame H of a stance with the ground points ``feet`` (4, 3)."""
    ahead = feet[0] + feet[1] - feet[2] - feet[3]
    return feet.mean(axis=0), yaw_matrix(np.arctan2(ahead[1], ahead[0]))


def in_scope(scope: str, before: np.ndarray, after: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Footholds before (4, 3) and after, (..., 3), in the frame of a library with that ``scope``."""
    if scope == "site":
        return before, after
    origin, axes = heading_frame(before)
    return (before - origin) @ axes, (after - origin) @ axes


def _add(fields: dict, attempt: TriedSwing, scope: str, now: int, config: ExperienceConfig) -> None:
    """Puts one attempt among the records, into the one that is like it or into a new one."""
    failed = attempt.outcome is SwingOutcome.FAILED or not np.isfinite(attempt.cost)
    dearer = config.failure_cost if failed else float(attempt.cost) - config.easy_cost
    cost = min(max(dearer, 0.0), config.failure_cost)
    before, after = in_scope(scope, np.asarray(attempt.before), np.asarray(attempt.after))
    bits, outcome = leg_bits(attempt.legs), SwingOutcome.FAILED if failed else attempt.outcome
    alike = (fields["legs"] == bits) & (fields["phase"] == attempt.phase)
    distance = np.full(len(alike), np.inf)
    for name, feet in (("before", before), ("after", after)):
        apart = np.linalg.norm(fields[name][alike] - feet, axis=2).max(axis=1, initial=0.0)
        distance[alike] = apart if name == "before" else np.maximum(distance[alike], apart)
    k = int(np.argmin(distance)) if len(distance) else -1
    if k >= 0 and distance[k] <= config.same:
        fields["count"][k] += 1
        fields["cost"][k] += (cost - fields["cost"][k]) / fields["count"][k]
        fields["status"][k], fields["last"][k] = outcome, now
        return
    new = {"phase": attempt.phase, "legs": bits, "before": before, "after": after, "count": 1, "cost": cost}
    new |= {"status": int(outcome), "last": now}
    for name, value in new.items():
        row = np.asarray(value, fields[name].dtype)[None]
        fields[name] = np.concatenate((fields[name], row))
