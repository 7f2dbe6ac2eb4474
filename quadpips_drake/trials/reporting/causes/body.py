"""Causes at the body: it was pushed, it is heavier or lighter than it is believed to be, its drives are too weak."""

from collections.abc import Iterator

import numpy as np

from quadpips_drake.trials.reporting.case import Case, Finding
from quadpips_drake.trials.reporting.measurements import impulses_of, mass_of, mass_uncertainty

_AFTER_PUSH = 2.0
"""A fall that begins later than this after a push is not blamed on it [s]."""
_MARKED = 0.2
"""A push that changes the velocity by so much is a strong one [m/s]."""
_MASS = 0.15
"""Load beyond this part of the robot's mass is more than the controllers are made for [1]."""


def pushed(case: Case) -> Iterator[Finding]:
    """A force from outside shortly before the chain begins."""
    robot = case.record.robot
    for begin, end, impulse in impulses_of(case.record):
        size = float(np.linalg.norm(impulse))
        if not case.fell or robot is None or not begin - 0.02 <= case.begin <= end + _AFTER_PUSH:
            continue
        change = size / robot.mass
        way = _direction(impulse)
        text = (
            f"a force of {size / max(end - begin, 1e-9):.0f} N {way} acted on the base for {end - begin:.2f} s: "
            f"{size:.0f} N s, {change:.2f} m/s of the robot's {robot.mass:.0f} kg"
        )
        yield Finding("push", begin, text, "pushes", ("pushes",), min(0.98, 0.5 + 0.4 * change / _MARKED))


def _direction(vector: np.ndarray) -> str:
    """Along which axis of the world a vector mostly points."""
    axis = int(np.argmax(np.abs(vector)))
    return f"along {'-' if vector[axis] < 0 else '+'}{'xyz'[axis]}"


def loaded(case: Case) -> Iterator[Finding]:
    """The feet bear more or less than the robot weighs."""
    robot = case.record.robot
    mass = mass_of(case.record, case.begin) if robot is not None and case.fell else None
    if mass is None:
        return
    excess = mass / robot.mass - 1.0
    if abs(excess) < max(_MASS, 2.0 * mass_uncertainty(case.begin)):
        return
    kind = "payload" if excess > 0 else "missing mass"
    text = (
        f"the feet carried {mass:.0f} kg in the mean up to t = {case.begin:.2f} s, the model of the robot has "
        f"{robot.mass:.0f} kg: {abs(excess):.0%} {'more' if excess > 0 else 'less'}"
    )
    keys = ("stages.station.model_error.payload", "stages.station.model_error.base_mass_factor")
    yield Finding(kind, float(case.log["time"][0]), text, "station", keys, min(0.85, 0.5 + 0.6 * abs(excess)))


def too_weak(case: Case) -> Iterator[Finding]:
    """A joint at its torque limit is the first event."""
    first = case.chain[0] if case.chain and case.fell else None
    if first is not None and first.kind == "torque":
        keys = case.suspects.gait.keys
        yield Finding("torque saturation", first.time, first.text, "whole_body_controller", keys, 0.45)
