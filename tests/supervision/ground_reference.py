"""What the ground says against a reference, one foothold and one pose at a time: for comparison."""

import numpy as np

from quadpips_drake.math.rotations import rotation_from_rpy, yaw_matrix
from quadpips_drake.planning.region_table import in_convex_polygon
from quadpips_drake.supervision import ground_events as events
from quadpips_drake.supervision.ground_events import Extent, GroundEventConfig
from quadpips_drake.trajectory.swing.ground_profile import SAMPLES, KnownGround
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.regions import GroundHeights, RegionSet
from quadpips_drake.values.steppability import Steppability


def _hold(regions: RegionSet, point: np.ndarray, tolerance: float) -> bool:
    """Whether a region that may carry a foot contains ``point`` (3,), or is ``tolerance`` [m] away from it at most."""
    for region in regions.regions:
        local = region.X_WR[:3, :3].T @ (point - region.center)
        usable = region.label in (Steppability.UNKNOWN, Steppability.STEPPABLE)
        if usable and abs(local[2]) <= tolerance and in_convex_polygon(local[:2], region.boundary, tolerance):
            return True
    return False


def foothold_problem(
    foothold, regions: RegionSet, ground: GroundHeights, before: GroundHeights, radius: float, config: GroundEventConfig
) -> str:
    """Says why a foot of ``radius`` [m] cannot come down on a FootholdTarget as planned; empty if it can."""
    point = foothold.position - radius * foothold.normal
    offsets = events._disc(radius, ground.cell)
    heights = ground.at(*(point[:2] + offsets).T)
    known = np.isfinite(heights)
    if known.sum() < events._SEEN * len(heights):
        return ""
    above = heights - (point[2] - offsets @ foothold.normal[:2] / foothold.normal[2])
    change = float(np.median(above[known]))
    if abs(change) > config.height_change:
        return f"the ground is {abs(change):.2f} m {'higher' if change > 0 else 'lower'} than planned"
    around = point[:2] + events._disc(round(radius + events._BESIDE, 6), ground.cell)
    risen = ground.at(*around.T) - np.fmax(before.at(*around.T), point[2])
    if (risen > config.height_change).mean() > events._TOUCHED:
        return f"the ground beside it has risen by {np.nanmax(risen):.2f} m"
    was_seen = foothold.region is not None and foothold.region.id >= 0
    if was_seen and not _hold(regions, point, config.region_tolerance):
        return "in no region any more"
    return ""


def obstacle_on_swing(
    start: np.ndarray, foothold, ground: GroundHeights, radius: float, config: GroundEventConfig
) -> float | None:
    """By how much ground on the way of a swing is higher than all that it was planned to clear [m]; None if it is not."""
    if foothold.profile is None or len(foothold.profile) != SAMPLES or not ground.height.size:
        return None
    parts = np.linspace(0.0, 1.0, SAMPLES)
    straight = start[2] + parts * (foothold.position[2] - start[2]) + foothold.apex_height
    now = KnownGround((), ground).profile(start, foothold.position, radius)
    excess = float((now - np.maximum(foothold.profile, straight))[events._ENDS : -events._ENDS].max())
    return excess if excess > config.height_change else None


def obstacle_on_way(
    reference: WholeBodyReference, time: float, ground: GroundHeights, extent: Extent, config: GroundEventConfig
) -> float | None:
    """When the torso will first be above ground that it cannot pass over [s]; None if it never will.

    What it is above now is no obstacle: it stands there.
    """
    ahead = np.flatnonzero(reference.times > time)
    if not len(ahead) or not ground.height.size:
        return None
    step = max(1, round(events._WAY_STEP / max(float(np.diff(reference.times).mean()), 1e-6)))
    states = reference.states[ahead[::step]]
    blocked = np.zeros(len(states), dtype=bool)
    for k, state in enumerate(states):
        position, rpy = state[CentroidalState.POSITION], state[CentroidalState.ORIENTATION]
        upwards, too_high = rotation_from_rpy(np.array(rpy))[2], 0
        for point in extent.under_body:
            place = position[:2] + yaw_matrix(rpy[2])[:2, :2] @ point
            belly = position[2] + upwards[:2] @ point - extent.belly
            too_high += bool(ground.at(*place[:, None])[0] > belly - config.body_clearance)
        blocked[k] = too_high >= events._BODY_POINTS
    if blocked[0] or not blocked.any():
        return None
    return float(reference.times[ahead[::step]][np.argmax(blocked)])
