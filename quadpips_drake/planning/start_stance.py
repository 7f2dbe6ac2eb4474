"""The stance in which a plan starts, and the ground that nobody has seen because the robot stands on it."""

from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.math.rotations import rotation_from_rpy, yaw_matrix
from quadpips_drake.planning.nominal_pose import base_pose_above
from quadpips_drake.planning.region_table import in_convex_polygon
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import PlanStart
from quadpips_drake.values.regions import PlanarRegion, RegionSet
from quadpips_drake.values.robot_state import RobotState

CONTACT_DISTANCE = 0.04
"""A foot stands on a region when its ground point is this close to the region's plane [m] (as in the release)."""
_PATCH = 0.04
"""Edge of the patch under a foot without perceived ground [m] (as in the release)."""


@dataclass(frozen=True)
class Attachment:
    """What one foot stands on."""

    point: np.ndarray
    """Ground point in W [m], (3,)."""
    region: PlanarRegion
    perceived: bool
    """False when the region is a patch made up for this foot."""


def _distance_to_plane(region: PlanarRegion, center: np.ndarray, radius: float) -> float:
    """Distance of the foot's sole from the plane of ``region`` [m]; inf when it is not above its boundary."""
    local = region.X_WR[:3, :3].T @ (center - region.center)
    if not in_convex_polygon(local[:2], region.boundary):
        return np.inf
    return abs(local[2] - radius)


def state_at_start(measured: RobotState, start: PlanStart | None) -> RobotState:
    """The state in which a plan begins: the ``measured`` one, or that where the present reference leads."""
    if start is None:
        return measured
    x = start.state
    rpy = x[CentroidalState.ORIENTATION].copy()
    rpy[2] = wrap_angle(rpy[2])
    return replace(
        measured,
        stamp=start.time,
        p_WB=x[CentroidalState.POSITION],
        rpy_WB=rpy,
        R_WB=rotation_from_rpy(rpy),
        joint_positions=x[CentroidalState.JOINTS],
        contacts=np.ones(len(Leg), dtype=bool),
    )


def flat_region(region_id: int, center: np.ndarray, half_x: float, half_y: float, yaw: float = 0.0) -> PlanarRegion:
    """Returns a level rectangle around ``center`` (3,) whose inset is all of it."""
    X_WR = np.eye(4)
    X_WR[:3, :3] = yaw_matrix(yaw)
    X_WR[:3, 3] = center
    corners = np.array([[-half_x, -half_y], [half_x, -half_y], [half_x, half_y], [-half_x, half_y]])
    return PlanarRegion(region_id, X_WR, corners, corners)


def attach_feet(state, regions, robot) -> list[Attachment]:
    """Finds the region under each foot: the nearest in height of those whose boundary contains the foot.

    A foot without any, be it in the air or on ground that the camera has not seen, gets a small level patch with a negative
    id, so that a plan can start in every situation.
    """
    origins = np.array([region.center for region in regions]).reshape(-1, 3)
    radii = np.array([np.linalg.norm(region.boundary, axis=1).max() for region in regions])
    attachments = []
    for leg, center in zip(Leg, robot.foot_positions_W(state), strict=True):
        near = np.flatnonzero(np.hypot(*(origins[:, :2] - center[:2]).T) <= radii)
        distances = [_distance_to_plane(regions[k], center, robot.foot_radius) for k in near]
        nearest = int(np.argmin(distances)) if distances else -1
        if nearest >= 0 and distances[nearest] < CONTACT_DISTANCE:
            region = regions[near[nearest]]
            attachments.append(Attachment(center - robot.foot_radius * region.normal, region, True))
        else:
            point = robot.soles_W(center)
            attachments.append(Attachment(point, flat_region(-1 - int(leg), point, _PATCH / 2, _PATCH / 2), False))
    return attachments


def start_ground(state, robot, margin: float, max_unevenness: float = 0.02) -> PlanarRegion | None:
    """Returns the rectangle around the feet as a region: the ground that a robot with a camera in front cannot see.

    It is meant for the moment before the first step only, when the robot stands on ground that somebody chose for it;
    between stepping stones the same assumption would be fatal. ``margin`` [m] goes beyond the feet on all sides.

    Returns None when a foot is more than ``max_unevenness`` [m] off their common plane, or the plane is steep.
    """
    feet = robot.soles_W(robot.foot_positions_W(state))
    center = feet.mean(axis=0)
    design = np.column_stack([feet[:, :2] - center[:2], np.ones(4)])
    plane, *_ = np.linalg.lstsq(design, feet[:, 2] - center[2], rcond=None)
    if np.abs(design @ plane - (feet[:, 2] - center[2])).max() > max_unevenness or np.hypot(*plane[:2]) > 0.5:
        return None
    yaw = base_pose_above(feet, 0.0, 1.0)[1][2]
    normal = np.array([-plane[0], -plane[1], 1.0])
    normal /= np.linalg.norm(normal)
    x_axis = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    x_axis -= (x_axis @ normal) * normal
    x_axis /= np.linalg.norm(x_axis)
    X_WR = np.eye(4)
    X_WR[:3, :3] = np.column_stack([x_axis, np.cross(normal, x_axis), normal])
    X_WR[:3, 3] = center
    local = (feet - center) @ X_WR[:3, :2]
    low, high = local.min(axis=0), local.max(axis=0)
    inset = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    grow = np.sign(inset - 0.5 * (low + high))
    return PlanarRegion(-100, X_WR, inset + (margin + robot.foot_radius) * grow, inset + margin * grow)


def with_region(regions: RegionSet, extra: PlanarRegion | None) -> RegionSet:
    """Returns ``regions`` with one more, if there is one."""
    return regions if extra is None else RegionSet(regions.stamp, (*regions.regions, extra))
