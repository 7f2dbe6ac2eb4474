"""Quantities that a log gives away about the world: the robot's true mass, the ground's friction, how late the MPC is, ...

All are measured from what the simulated sensors felt, none is read off the configuration of a fault.
"""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.trials.reporting.trial_record import TrialRecord

_LEAST_LOAD = 20.0
"""Feet that press on the ground by less than this tell nothing about friction [N]."""
_SLIDING = 0.08
"""A loaded foot that is faster than this along the ground slides rather than rolls [m/s]."""
_CONSISTENT = 1.4
"""Friction that is measured in two ways agrees within this factor [1]."""
_BOUND = 99.0
"""Percentile of tangential by normal force that counts as their bound."""
_LEAST_SAMPLES = 8
"""So many samples of sliding feet give a friction coefficient."""
_LEAST_TIME = 0.3
"""Shortest time over which the feet's forces give a mass [s]."""
_LEAST_POLICIES = 10
"""So many policies tell how late they come."""
_STEADY = 0.05
"""Over a longer time base and centre of mass have moved alike, but for about this speed [m/s]."""


@dataclass(frozen=True)
class Sliding:
    """What feet that slid along the ground tell about it."""

    friction: float
    """Tangential by normal force, the median over ``samples`` [1]."""
    samples: int
    since: float
    """When the first of them was [s]."""
    leg: int
    """Whose foot that was."""
    share: float
    """Of the loaded samples, how many slid [1]."""
    bound: float
    """Hardly any loaded foot was ever held by more of its load than this, sliding or not [1]."""

    @property
    def is_consistent(self) -> bool:
        """Whether this may be the friction of the ground: then no foot is held by more. Feet that scrape along edges are."""
        return self.bound <= _CONSISTENT * self.friction


@dataclass(frozen=True)
class Lateness:
    """How old the state is that a policy of the MPC started from when it comes into force."""

    latency: float
    """[s]"""
    period: float
    """Between policies [s]."""


@dataclass(frozen=True)
class Outage:
    """A time in which a solver found nothing."""

    begin: float
    """[s]"""
    end: float
    """[s]"""
    failures: int


def mass_of(record: TrialRecord, until: float = np.inf) -> float | None:
    """True mass of robot and load [kg] from the forces on the feet, up to ``until`` [s]; None if that is too short a time.

    The mean of the vertical forces is the weight and the mean acceleration times the mass, m = mean(f_z) / (g + (v_end -
    v_begin) / T); only samples until another link than a foot touches something count.
    """
    log = record.log
    time, vertical = log["time"], log["contact_forces"][:, :, 2].sum(axis=1)
    counts = time <= until
    if "touching" in log:
        counts &= np.cumsum(log["touching"].any(axis=1)) == 0
    standing = np.flatnonzero(counts & (vertical > 0.0))
    if len(standing) < 2:
        return None
    first, last = standing[0], standing[-1]
    lasted = time[last] - time[first]
    if lasted < _LEAST_TIME:
        return None
    mean = np.trapezoid(vertical[first : last + 1], time[first : last + 1]) / lasted
    acceleration = (log["v_WB"][last, 2] - log["v_WB"][first, 2]) / lasted
    return float(mean / (GRAVITY + acceleration)) if mean > 0.0 else None


def mass_uncertainty(until: float) -> float:
    """By how much such a mass may be wrong [1]."""
    return 0.02 + _STEADY / (GRAVITY * max(until, _LEAST_TIME))


def sliding_of(record: TrialRecord, since: float = -np.inf, until: float = np.inf) -> Sliding | None:
    """What feet that slid between two times [s] tell about friction; None if hardly any did.

    A body that slides is held back by mu times the normal force, whatever it weighs.
    """
    log = record.log
    time, feet, forces = log["time"], log["foot_positions"], log["contact_forces"]
    if len(time) < 3:
        return None
    normals = _normals_under(record, feet)
    normal_force = (forces * normals).sum(axis=2)
    tangential = np.linalg.norm(forces - normal_force[..., None] * normals, axis=2)
    velocity = np.gradient(feet, time, axis=0)
    along = np.linalg.norm(velocity - (velocity * normals).sum(axis=2, keepdims=True) * normals, axis=2)
    held = log["contacts"].astype(bool)
    steady = held.copy()  # neither the touch-down nor the lift-off
    steady[1:-1] &= held[:-2] & held[2:]
    within = ((time >= since) & (time <= until))[:, None]
    pressed = steady & (normal_force > _LEAST_LOAD)
    loaded = pressed & within
    slides = loaded & (along > _SLIDING)
    samples, legs = np.nonzero(slides)
    if len(samples) < _LEAST_SAMPLES:
        return None
    ratios = tangential[slides] / normal_force[slides]
    share = len(samples) / max(np.count_nonzero(loaded), 1)
    bound = float(np.percentile(tangential[pressed] / normal_force[pressed], _BOUND))
    return Sliding(float(np.median(ratios)), len(samples), float(time[samples[0]]), int(legs[0]), float(share), bound)


def _normals_under(record: TrialRecord, feet: np.ndarray) -> np.ndarray:
    """Normals of the ground under feet (n, 4, 3), (n, 4, 3); upright where it is not known."""
    upright = np.broadcast_to([0.0, 0.0, 1.0], feet.shape)
    if record.terrain is None:
        return upright
    normals = GroundTruth(record.terrain).normal(feet[..., 0], feet[..., 1])
    return np.where(np.isnan(normals), upright, normals)


def lateness_of(record: TrialRecord) -> Lateness | None:
    """How late the MPC's policies come; None where the log does not say.

    Just before the next one comes into force a policy is as old as its latency and a period.
    """
    ages = record.log.get("mpc_age")
    if ages is None:
        return None
    known = np.isfinite(ages)
    ages, begun = ages[known], record.log["time"][known] - ages[known]
    new = np.flatnonzero(np.diff(begun) > 1e-6)
    if len(new) < _LEAST_POLICIES:
        return None
    period = float(np.median(np.diff(begun[new])))
    return Lateness(max(0.0, float(np.median(ages[new])) - period), period)


def outages_of(record: TrialRecord, solver: str, *, pause: float = 0.1) -> list[Outage]:
    """When the solver ``mpc`` or ``wbc`` failed, failures with no ``pause`` [s] in between taken together."""
    counts = record.log.get(f"{solver}_failures")
    if counts is None or len(counts) < 2:
        return []
    time, new = record.log["time"], np.diff(counts.astype(float), prepend=0.0)
    found: list[Outage] = []
    for k in np.flatnonzero(new > 0):
        at, failures = float(time[k]), int(new[k])
        if found and at - found[-1].end <= pause:
            found[-1] = Outage(found[-1].begin, at, found[-1].failures + failures)
        else:
            found.append(Outage(at, at, failures))
    return found


def impulses_of(record: TrialRecord) -> list[tuple[float, float, np.ndarray]]:
    """Forces from outside on the base: begin, end [s] and impulse [N s] (3,) of each."""
    push = record.log.get("push")
    if push is None:
        return []
    time, acts = record.log["time"], np.abs(push).sum(axis=1) > 0.0
    edges = np.flatnonzero(np.diff(np.concatenate(([False], acts, [False])).astype(int)))
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.01
    return [(float(time[a]), float(time[b - 1] + step), push[a:b].sum(axis=0) * step) for a, b in edges.reshape(-1, 2)]


def largest_torque(record: TrialRecord) -> float | None:
    """Largest torque of any joint as part of its limit [1]; None without a robot."""
    if record.robot is None:
        return None
    return float(np.nanmax(np.abs(record.log["joint_torques"]) / record.robot.effort_limits, initial=0.0))
