"""Where the feet go within the MPC's horizon: splines, references, ground normals and regions on the time grid."""

import numpy as np

from quadpips_drake.trajectory.swing.ground_profile import ground_profile, region_halfspaces
from quadpips_drake.trajectory.swing.swing_trajectory import SwingConfig, SwingSpline
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.legs import NUM_LEGS, Leg
from quadpips_drake.values.reference import FootholdTarget

UP = np.array([0.0, 0.0, 1.0])
_MATCH = 0.05
"""A foothold belongs to a swing when their touch-downs are closer than this [s]."""
_SAME_ENDS = 1e-3
"""A spline is kept while its ends move by less than this [m], the normals there by less than this [1]."""
_SAME_TIME = 1e-6
"""... and its times by less than this [s]."""
_KEEP_SWING = 0.5
"""How long a finished swing stays in the policy [s]: a foot that has not found the ground yet needs it."""


class SwingPlanner:
    """Makes the splines of all swings within the horizon, from where the feet are to where the reference wants them."""

    def __init__(self, config: SwingConfig, foot_radius: float):
        self._config, self._foot_radius = config, foot_radius

    def plan(
        self,
        schedule: ContactSchedule,
        footholds: tuple,
        feet: np.ndarray,
        normals: np.ndarray,
        now: float,
        until: float,
        last: tuple = ((),) * NUM_LEGS,
    ) -> tuple:
        """For each leg the splines of its swings between ``now`` and ``until`` [s].

        Args:
            schedule: contacts in absolute time.
            footholds: FootholdTargets; a swing without one comes down where it began.
            feet: where each foot stands, or stood when its present swing began, in W, (4, 3).
            normals: of the ground there, (4, 3).
            last: splines of each leg from the last time; those that would hardly change are used again.
        """
        plans = []
        for leg in Leg:
            splines = []
            point, normal = np.asarray(feet[leg]), normals[leg]
            for liftoff, touchdown in schedule.swings(leg):
                if touchdown <= now or liftoff >= until or not np.isfinite(touchdown - liftoff):
                    continue
                target = matching_target(footholds, leg, touchdown)
                end = point if target is None else target.position
                end_normal = normal if target is None else target.normal
                spline = _kept(last[leg], liftoff, touchdown, point, end, normal, end_normal)
                if spline is None:
                    spline = self._spline(liftoff, touchdown, point, end, normal, end_normal, target)
                splines.append(spline)
                point, normal = end, end_normal
            plans.append(tuple(splines))
        return tuple(plans)

    def _spline(self, liftoff, touchdown, start, end, start_normal, end_normal, target) -> SwingSpline:
        """As high over the ground as it was planned, and with an apex no lower."""
        if target is None or target.profile is None:
            region = None if target is None else target.region
            profile, apex = ground_profile(start, end, () if region is None else (region,), self._foot_radius), 0.0
        else:
            profile, apex = np.array(target.profile), target.apex_height
            profile[0], profile[-1] = start[2], end[2]
        options = {"liftoff_normal": start_normal, "profile": profile, "least_apex": apex}
        return SwingSpline.plan(liftoff, touchdown, start, end, end_normal, self._config, **options)


def _kept(splines, liftoff, touchdown, start, end, start_normal, end_normal):
    """The spline among ``splines`` that would hardly be another, or None."""
    for spline in splines:
        if abs(spline.start_time - liftoff) > _SAME_TIME or abs(spline.end_time - touchdown) > _SAME_TIME:
            continue
        if np.abs(spline.ends - np.array((start, end, start_normal, end_normal))).max() < _SAME_ENDS:
            return spline
    return None


def matching_target(footholds: tuple, leg: Leg, touchdown: float) -> FootholdTarget | None:
    """The target of ``leg`` that belongs to the swing ending at ``touchdown`` [s]."""
    best = None
    for target in footholds:
        if target.leg == leg and abs(target.touchdown_time - touchdown) < _MATCH:
            best = target
    return best


def with_finished(swings: tuple, before: tuple, now: float) -> tuple:
    """The new swings, led by each leg's last finished one of those ``before``."""
    merged = []
    for leg in Leg:
        finished = [s for s in before[leg] if now - _KEEP_SWING < s.end_time <= now]
        merged.append((*finished[-1:], *swings[leg]))
    return tuple(merged)


def foot_references(swings: tuple, feet: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities of the feet at ``times``, each (n, 4, 3): on the ground, along the splines, on the ground."""
    p, v = np.empty((len(times), NUM_LEGS, 3)), np.zeros((len(times), NUM_LEGS, 3))
    p[:] = feet
    for leg, splines in enumerate(swings):
        for spline in splines:
            first = times.searchsorted(spline.start_time)
            path = spline.sample(times[first:])  # at rest beyond the end
            p[first:, leg], v[first:, leg] = path[:, 0], path[:, 1]
    return p, v


def standing_normals(footholds: tuple, last: np.ndarray, now: float) -> np.ndarray:
    """Unit normals of the ground that the feet are on or come from, (4, 3): the ``last`` ones until the next touch-down."""
    normals = np.array(last)
    for target in footholds:
        if target.touchdown_time <= now:
            normals[target.leg] = target.normal
    return normals


def ground_normals(footholds: tuple, standing: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Unit normal of the ground under each foot in each interval of ``times``, or where it comes down next, (N, 4, 3).

    A normal belongs to a foothold from its lift-off on; before the first one those of ``standing`` (4, 3) hold.
    """
    normals = np.empty((len(times) - 1, NUM_LEGS, 3))
    normals[:] = standing
    middle = 0.5 * (times[:-1] + times[1:])
    lifted = middle.searchsorted([target.liftoff_time for target in footholds])
    for first, target in zip(lifted, footholds, strict=True):  # in order of touch-down: later ones overwrite
        normals[first:, target.leg] = target.normal
    return normals


def foothold_halfspaces(footholds: tuple, times: np.ndarray) -> tuple:
    """Regions that the feet have to stand on after their next touch-downs: normals (N, 4, m, 3), offsets (N, 4, m) with
    normals @ p + offsets >= 0, rows of zeros for padding; (None, None) without any region."""
    coming = [t for t in footholds if t.region is not None and times[0] < t.touchdown_time < times[-1]]
    if not coming:
        return None, None
    halfspaces = [region_halfspaces(target.region, target.polygon) for target in coming]
    rows = max(len(offsets) for _, offsets in halfspaces)
    shape = len(times) - 1, NUM_LEGS, rows
    all_normals, all_offsets = np.zeros((*shape, 3)), np.zeros(shape)
    middle = 0.5 * (times[:-1] + times[1:])
    landed = middle.searchsorted([target.touchdown_time for target in coming])
    for first, target, (normals, offsets) in zip(landed, coming, halfspaces, strict=True):
        all_normals[first:, target.leg], all_offsets[first:, target.leg] = 0.0, 0.0
        all_normals[first:, target.leg, : len(offsets)] = normals
        all_offsets[first:, target.leg, : len(offsets)] = offsets
    return all_normals, all_offsets
