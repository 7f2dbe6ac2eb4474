"""Causes under the feet: slippery ground, footholds at wrong heights, steps too high, something in the way of a swing."""

from collections.abc import Iterator

import numpy as np

from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.trials.reporting.case import Case, Finding
from quadpips_drake.trials.reporting.measurements import sliding_of
from quadpips_drake.trials.reporting.suspects import Place
from quadpips_drake.values.legs import Leg

_BEFORE = 3.0
"""Feet that slid so long before the chain began still count [s]."""
_SLIPPERY = 0.85
"""Ground whose friction is less than this part of what is believed is slippery [1]."""
_HEIGHT = 0.03
"""Footholds that are so far from the true ground are at the wrong height [m]."""
_STEP = 0.25
"""A step that is so high, as part of the height of the base above the feet, is high for a robot [1]."""
_AROUND = 0.5
"""Steps are looked for so far around the base [m]."""
_CELL = 0.02
_HINDERED = ("early contact", "stuck", "link", "astray", "joint stop", "late contact", "torque")
"""Kinds of events that a step too high leads to."""


def slippery(case: Case) -> Iterator[Finding]:
    """Feet that slid were held back by less than the controllers believe."""
    if not case.fell:
        return
    sliding = sliding_of(case.record, case.begin - _BEFORE)
    believed = case.record.setting("stages.tracking.wbc.friction", 0.5)
    if (
        sliding is None
        or not sliding.is_consistent
        or sliding.friction > _SLIPPERY * believed
        or sliding.since > case.end - 0.05
    ):
        return
    foot = Leg(sliding.leg).name
    text = (
        f"{foot} slid first; feet that slid were held back by {sliding.friction:.2f} of their load "
        f"({sliding.samples} samples), no foot by more than {sliding.bound:.2f}; the controllers count on {believed:g}"
    )
    weight = 0.9 if sliding.friction < 0.6 * believed else 0.6
    keys = ("stages.station.model_error.friction", "stages.tracking.wbc.friction", "stages.tracking.mpc.ocp.friction")
    yield Finding("low friction", sliding.since, text, "station", keys, weight)


def wrong_height(case: Case) -> Iterator[Finding]:
    """The footholds of the last seconds lay above or below the true ground, all alike."""
    moments = case.moments
    if moments is None or not case.fell:
        return
    error = moments.footholds[..., 2] - moments.foot_radius - moments.foothold_ground
    counts = ~np.isnan(error) & (moments.time <= case.begin + 0.5)[:, None]
    if np.count_nonzero(counts) < 20:
        return
    middle = float(np.median(error[counts]))
    if abs(middle) < _HEIGHT:
        return
    text = f"footholds lay {100 * abs(middle):.0f} cm {'above' if middle > 0 else 'below'} the true ground in the median"
    keys = ("stages.tracking.faults.terrain_height_error", "terrain")
    first = moments.time[np.flatnonzero(counts.any(axis=1))[0]]
    yield Finding("footholds at a wrong height", float(first), text, "raised_footholds", keys, 0.8)


def too_high(case: Case) -> Iterator[Finding]:
    """A step near where it happened is high for this robot, and feet or links met it."""
    robot, terrain, moments = case.record.robot, case.record.terrain, case.moments
    if robot is None or terrain is None or moments is None:
        return
    hindered = [event for event in case.chain if event.kind in _HINDERED]
    if not hindered:
        return
    height = highest_step(terrain, case.position(case.begin)[:2])
    share = height / robot.nominal_base_height
    if share < _STEP or height > 3.0 * robot.nominal_base_height:
        return
    text = (
        f"a step of {100 * height:.0f} cm, {share:.0%} of the {robot.nominal_base_height:.2f} m at which this robot carries "
        f"its base: {hindered[0].text}"
    )
    suspect = case.suspects.step
    weight = min(0.75, 0.45 + share)
    yield Finding("step too high", hindered[0].time, text, suspect.system, ("difficulty", *suspect.keys), weight)


def highest_step(terrain, place: np.ndarray) -> float:
    """The highest step between walkable ground within ``_AROUND`` of ``place`` (2,) [m]."""
    line = np.arange(-_AROUND, _AROUND, _CELL)
    x, y = np.meshgrid(place[0] + line, place[1] + line)
    heights = GroundTruth(terrain).height(x, y, walkable_only=True)
    steps = [np.abs(np.diff(heights, axis=axis)) for axis in (0, 1)]
    return float(np.nanmax([np.nanmax(step, initial=0.0) if np.isfinite(step).any() else 0.0 for step in steps]))


def obstructed(case: Case) -> Iterator[Finding]:
    """A foot met something, slipped or found no ground, and nothing else explains it."""
    first = case.chain[0] if case.chain and case.fell else None
    who = case.suspects
    kinds = {
        "early contact": ("foot hit something", who.swing),
        "late contact": ("no ground at a foothold", who.ground),
        "lost contact": ("no ground under a foot", who.ground),
        "stuck": ("foot did not lift", Place("whole_body_controller", ("stages.tracking.wbc",))),
        "slip": ("slip", Place(who.ground.system, ("stages.tracking.wbc.friction",))),
        "link": ("link hit something", who.reach),
        "itself": ("robot hit itself", who.reach),
        "joint stop": ("joint at its stop", who.reach),
        "astray": ("foot astray", Place("whole_body_controller", ("stages.tracking.wbc",))),
    }
    if first is not None and first.kind in kinds:
        cause, place = kinds[first.kind]
        yield Finding(cause, first.time, first.text, place.system, place.keys, 0.4)
