"""The world of the offline experiment: what the searches know of it, what is really there, and what a camera sees."""

from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.learning.scene_renderer import LABELS, SceneRenderer
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.perception.regions.oracle_regions import (
    OracleRegionConfig,
    centers_of,
    nearby_regions,
    regions_from_terrain,
)
from quadpips_drake.perception.steppability.label_edges import move_borders_to_edges
from quadpips_drake.perception.steppability.model import SteppabilityModel
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.sensing.depth_camera import DepthCameraConfig
from quadpips_drake.terrain.terrain import Sphere, Terrain
from quadpips_drake.terrain.triangles import joined_triangles
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.images import LabelImage
from quadpips_drake.values.regions import GroundHeights, RegionSet
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.steppability import Steppability

_CELL, _MARGIN = 0.02, 1.2
"""Cells of the map of heights, and how far it goes beyond start and goal [m]."""


class OfflineCourse:
    """A terrain on which the searches know everything but the spheres."""

    def __init__(self, robot: RobotModel, terrain: Terrain):
        self.robot, self.terrain = robot, terrain
        bare = [element for element in terrain.elements if not isinstance(element, Sphere)]
        spheres = [element for element in terrain.elements if isinstance(element, Sphere)]
        self.centers = np.array([sphere.X_WE[:3, 3] for sphere in spheres]).reshape(-1, 3)
        """Of the spheres in W [m], (n, 3)."""
        self.radii = np.array([sphere.radius for sphere in spheres])
        """Of the spheres [m], (n,)."""
        self._config = OracleRegionConfig()
        self._regions = regions_from_terrain(replace(terrain, elements=tuple(bare)), robot.foot_radius, self._config)
        self._region_centers = centers_of(self._regions)
        self.heights = _heights_of(terrain)
        """Exact, spheres included: what the swing optimisation clears."""

    def regions_around(self, state: RobotState) -> RegionSet:
        """The regions near the robot, as exact perception would have them were there no spheres."""
        near = nearby_regions(self._regions, state.p_WB, self._config.radius, self._region_centers)
        return RegionSet(state.stamp, near)

    def start_state(self) -> RobotState:
        """The robot at rest at the start."""
        x, y, yaw = self.terrain.start
        rest, R_WB = standing_state(self.robot), yaw_matrix(yaw)
        height = float(GroundTruth(self.terrain).height(x, y))
        p_WB = np.array([x, y, height + self.robot.nominal_base_height])
        return replace(rest, p_WB=p_WB, rpy_WB=np.array([0.0, 0.0, yaw]), R_WB=R_WB)


@dataclass(frozen=True)
class _TerrainScene:
    """A terrain as the renderer of scenes takes it."""

    terrain: Terrain

    def triangles(self, label: Steppability) -> np.ndarray:
        """All triangles with that ``label``, (n, 3, 3) in W [m]."""
        chosen = [element for element in self.terrain.elements if element.label == label]
        if not chosen:
            return np.zeros((0, 3, 3))
        vertices, faces = joined_triangles(chosen)
        return vertices[faces]


def label_image(course: OfflineCourse, state: RobotState, model: SteppabilityModel | None) -> LabelImage:
    """What the front camera sees from ``state``, without noise.

    Args:
        course: the world.
        state: of the robot.
        model: the network that labels the depth image; None: the exact labels of what each pixel shows.
    """
    renderer = SceneRenderer(DepthCameraConfig())
    renderer.show(_TerrainScene(course.terrain))
    X_WB = np.eye(4)
    X_WB[:3, :3], X_WB[:3, 3] = state.R_WB, state.p_WB
    X_WC = X_WB @ course.robot.camera().X_BC
    depth, labels = renderer.render(X_WC)
    if model is not None:
        down_C, intrinsics = -X_WC[2, :3], renderer.intrinsics
        labels = move_borders_to_edges(model.segment(depth, down_C, intrinsics), depth, down_C, intrinsics)
    assert set(np.unique(labels)) <= {Steppability.UNKNOWN, *LABELS}
    return LabelImage(state.stamp, labels, depth, X_WC, renderer.intrinsics)


def _heights_of(terrain: Terrain) -> GroundHeights:
    ends = np.array([terrain.start[:2], terrain.goal])
    low, high = ends.min(axis=0) - _MARGIN, ends.max(axis=0) + _MARGIN
    first, count = np.floor(low / _CELL), np.ceil((high - low) / _CELL).astype(int)
    x, y = (_CELL * (first[k] + np.arange(count[k]) + 0.5) for k in range(2))
    heights = GroundTruth(terrain).height(x[:, None], y[None, :])
    return GroundHeights(0.0, first * _CELL, _CELL, heights.astype(np.float32))
