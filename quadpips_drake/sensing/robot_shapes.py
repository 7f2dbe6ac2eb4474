"""The visible shapes of a robot, as plain arrays."""

from functools import cache
from typing import NamedTuple

import numpy as np
from pydrake.geometry import Box, Capsule, Cylinder, Role, SceneGraph, Sphere
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from quadpips_drake.errors import UserInputError
from quadpips_drake.robots.robot_model import LINK_NAMES, RobotModel

ROUND_BOX, CYLINDER = 0, 1


class RobotShapes(NamedTuple):
    """n primitives fixed to links. A sphere or capsule is a box or line without extent, rounded by its radius."""

    kind: np.ndarray
    """ROUND_BOX or CYLINDER (axis z), int64 (n,)."""
    link: np.ndarray
    """Index of the link that carries the shape (0: base, 1 + j: moved by joint j), int64 (n,)."""
    half_size: np.ndarray
    """Half extents of the core before rounding [m]; of a cylinder: radius, radius, half length; (n, 3)."""
    rounding: np.ndarray
    """Radius by which the core is rounded [m], (n,)."""
    R_LG: np.ndarray
    """Orientation of the shape in its link, (n, 3, 3)."""
    p_LG: np.ndarray
    """Centre of the shape in its link [m], (n, 3)."""


@cache
def load_robot_shapes(robot: RobotModel) -> RobotShapes:
    """Reads all shapes with a perception role from the robot's URDF."""
    plant, scene_graph = MultibodyPlant(time_step=1e-3), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    Parser(plant).AddModels(str(robot.urdf_path))
    plant.Finalize()
    inspector = scene_graph.model_inspector()
    shapes = []
    for link, name in enumerate(LINK_NAMES):
        frame = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName(name).index())
        for geometry in inspector.GetGeometries(frame, Role.kPerception):
            kind, half_size, rounding = _describe(inspector.GetShape(geometry), inspector.GetName(geometry))
            pose = inspector.GetPoseInFrame(geometry)
            shapes.append((kind, link, half_size, rounding, pose.rotation().matrix(), pose.translation()))
    kind, link, half_size, rounding, rotation, position = (np.array(column) for column in zip(*shapes, strict=True))
    return RobotShapes(kind, link, half_size.astype(float), rounding.astype(float), rotation, position)


def trunk_corners(robot: RobotModel) -> np.ndarray:
    """Returns the lower corners of the box along the axes of B around all shapes of the base, (4, 3) [m]."""
    shapes = load_robot_shapes(robot)
    base = shapes.link == 0
    half = np.einsum("nij,nj->ni", np.abs(shapes.R_LG[base]), shapes.half_size[base]) + shapes.rounding[base, None]
    low, high = (shapes.p_LG[base] - half).min(axis=0), (shapes.p_LG[base] + half).max(axis=0)
    return np.array([[x, y, low[2]] for x in (low[0], high[0]) for y in (low[1], high[1])])


def _describe(shape, name: str):
    """Returns kind, half extents and rounding of a Drake shape."""
    if isinstance(shape, Sphere):
        return ROUND_BOX, np.zeros(3), shape.radius()
    if isinstance(shape, Capsule):
        return ROUND_BOX, np.array([0.0, 0.0, 0.5 * shape.length()]), shape.radius()
    if isinstance(shape, Cylinder):
        return CYLINDER, np.array([shape.radius(), shape.radius(), 0.5 * shape.length()]), 0.0
    if isinstance(shape, Box):
        return ROUND_BOX, 0.5 * np.array(shape.size()), 0.0
    raise UserInputError(f"visual '{name}': a robot may consist of boxes, cylinders, capsules and spheres only")
