"""What is drawn of regions and plans: values in, coloured triangles out (QuadPiPS figures 1 and 5 show the same)."""

import numpy as np

from quadpips_drake.math.rotations import rotation_from_rpy, yaw_matrix
from quadpips_drake.terrain.terrain import GOAL_TOLERANCE, Terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.images import AffordanceImage
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import PlanSketch
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.regions import RegionSet
from quadpips_drake.values.steppability import Steppability
from quadpips_drake.visualization.colors import (
    BASE_REFERENCE_COLOR,
    GOAL_COLOR,
    LEG_COLORS,
    REGION_COLORS,
    START_COLOR,
    WAYPOINT_COLOR,
)
from quadpips_drake.visualization.shapes import ColorMesh, ColorPoints

LIFT = 0.004
"""Height above the ground [m] at which flat things are drawn, so that they do not flicker."""
_SWING_SAMPLES = 14


def region_mesh(region_set: RegionSet, *, varied: bool = True) -> ColorMesh:
    """Insets of the regions as polygons with the hull as a darker border, coloured by label.

    ``varied``: whether neighbours differ in brightness.
    """
    mesh = ColorMesh()
    for region in region_set.regions:
        color = np.array(REGION_COLORS[Steppability(region.label)])
        # Neighbours differ in brightness, so that one sees where one ends (a fixed pattern by id).
        color = np.clip(color * (0.85 + 0.3 * ((region.id * 7) % 10) / 9), 0, 1) if varied else color
        mesh.add_polygon(_in_world(region.X_WR, region.inset), color)
        mesh.add_outline(_in_world(region.X_WR, region.boundary), region.normal, 0.008, 0.55 * color)
    return mesh


def label_points(image: AffordanceImage, stride: int, size: float = 0.03) -> ColorPoints:
    """The labelled points that a camera sees, coloured by label (green, yellow, red); every ``stride``-th row and column.

    Points of unknown steppability are left out.
    """
    rows, columns = (np.arange(stride // 2, n, stride) for n in image.labels.shape)
    labels, depth = image.labels[np.ix_(rows, columns)], image.depth[np.ix_(rows, columns)]
    shown = (labels != Steppability.UNKNOWN) & np.isfinite(depth)
    v, u = np.nonzero(shown)
    k, z = image.intrinsics, depth[shown].astype(float)
    p_C = np.column_stack([z * (columns[u] - k.cx) / k.fx, z * (rows[v] - k.cy) / k.fy, z])
    # A little towards the camera, so that points do not sink into the surface that they lie on.
    p_C *= 1 - LIFT / np.maximum(np.linalg.norm(p_C, axis=1, keepdims=True), LIFT)
    table = np.array([REGION_COLORS[Steppability(value)] for value in range(len(REGION_COLORS))])
    return ColorPoints(p_C @ image.X_WC[:3, :3].T + image.X_WC[:3, 3], table[labels[shown]], size)


def foothold_mesh(reference: WholeBodyReference, ball_radius: float = 0.03) -> ColorMesh:
    """A ball at each planned foothold, coloured by leg."""
    mesh = ColorMesh()
    for target in reference.footholds:
        mesh.add_ball(target.position, ball_radius, LEG_COLORS[Leg(target.leg)])
    return mesh


def swing_mesh(reference: WholeBodyReference, robot, tube_radius: float = 0.009) -> ColorMesh:
    """The path of each foot during each of its swings, coloured by leg."""
    mesh = ColorMesh()
    for leg, path in swing_paths(reference, robot):
        mesh.add_tube(path, tube_radius, LEG_COLORS[leg])
    return mesh


def swing_paths(reference: WholeBodyReference, robot) -> list[tuple[Leg, np.ndarray]]:
    """Returns the leg and the positions of its foot's centre in W [m], (n, 3), for each swing of ``reference``."""
    paths = []
    for leg in Leg:
        for liftoff, touchdown in reference.schedule.swings(leg):
            begin, end = max(liftoff, reference.times[0]), min(touchdown, reference.end_time)
            if end > begin:
                times = np.linspace(begin, end, _SWING_SAMPLES)
                paths.append((leg, np.array([_foot_at(reference, robot, leg, time) for time in times])))
    return paths


def base_mesh(reference: WholeBodyReference, tube_radius: float = 0.008, samples: int = 60) -> ColorMesh:
    """The path of the base origin."""
    mesh = ColorMesh()
    mesh.add_tube(base_path(reference, samples), tube_radius, BASE_REFERENCE_COLOR)
    return mesh


def base_path(reference: WholeBodyReference, samples: int = 60) -> np.ndarray:
    """Positions of the base origin in W [m], (samples, 3)."""
    times = np.linspace(reference.times[0], reference.end_time, samples)
    positions = reference.states[:, CentroidalState.POSITION]
    return np.column_stack([np.interp(times, reference.times, column) for column in positions.T])


def plan_mesh(plan: PlanSketch, disc_radius: float = 0.045) -> ColorMesh:
    """The planned footholds as discs on the ground, and a ball at the waypoint of the base."""
    mesh = ColorMesh()
    for point, normal, leg in zip(plan.points, plan.normals, plan.legs, strict=True):
        mesh.add_disc(point + 1.5 * LIFT * normal, normal, disc_radius, LEG_COLORS[Leg(leg)])
    if plan.waypoint is not None:
        mesh.add_ball(plan.waypoint, 0.05, WAYPOINT_COLOR)
    return mesh


def start_mesh(terrain: Terrain) -> ColorMesh:
    """The start, an arrow on the ground."""
    truth = GroundTruth(terrain)
    mesh = ColorMesh()
    x, y, yaw = terrain.start
    arrow = np.array([[0.0, -0.04], [0.3, -0.04], [0.3, 0.04], [0.0, 0.04]])
    head = np.array([[0.3, -0.11], [0.5, 0.0], [0.3, 0.11]])
    rotation = yaw_matrix(yaw)[:2, :2]
    for part in (arrow, head):
        mesh.add_polygon(_on_ground(truth, np.array([x, y]) + part @ rotation.T), START_COLOR)
    return mesh


def goal_mesh(terrain: Terrain, goal_tolerance: float = GOAL_TOLERANCE) -> ColorMesh:
    """The goal, a ring of the tolerated distance [m] with a flag."""
    truth = GroundTruth(terrain)
    mesh = ColorMesh()
    angle = np.linspace(0, 2 * np.pi, 49)
    circle = terrain.goal + goal_tolerance * np.column_stack((np.cos(angle), np.sin(angle)))
    mesh.add_tube(_on_ground(truth, circle), 0.012, GOAL_COLOR)
    foot = _on_ground(truth, terrain.goal[None])[0]
    mesh.add_tube(foot + np.array([[0, 0, 0], [0, 0, 0.6], [0, 0, 1.2]]), 0.012, GOAL_COLOR)
    flag = foot + np.array([[0, 0, 1.2], [0, 0, 0.95], [-0.35, 0, 1.075]])
    mesh.add_polygon(flag, GOAL_COLOR)
    return mesh


def _in_world(X_WR: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    points = np.column_stack((polygon, np.full(len(polygon), LIFT)))
    return points @ X_WR[:3, :3].T + X_WR[:3, 3]


def _on_ground(truth: GroundTruth, xy: np.ndarray) -> np.ndarray:
    heights = truth.nearest_walkable_height(xy[:, 0], xy[:, 1])
    return np.column_stack((xy, np.nan_to_num(heights) + LIFT))


def _foot_at(reference: WholeBodyReference, robot, leg: Leg, time: float) -> np.ndarray:
    """Centre of a foot in W [m] in the reference at ``time``, by forward kinematics."""
    state = np.array([np.interp(time, reference.times, column) for column in reference.states.T])
    R_WB = rotation_from_rpy(state[CentroidalState.ORIENTATION])
    return robot.foot_positions_at(state[CentroidalState.POSITION], R_WB, state[CentroidalState.JOINTS])[leg]
