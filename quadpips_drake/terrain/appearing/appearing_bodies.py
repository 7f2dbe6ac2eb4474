"""Elements in a plant that wait far below the ground until they appear: Drake adds no geometry to a running simulation."""

import numpy as np
from pydrake.geometry import (
    FrameId,
    GeometryFrame,
    GeometryId,
    GeometryInstance,
    PerceptionProperties,
    RenderLabel,
    Rgba,
    Role,
    SceneGraph,
    SourceId,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, SpatialInertia

from quadpips_drake.terrain.element_colors import COLORS
from quadpips_drake.terrain.plant_builder import collision_shapes, visual_shape
from quadpips_drake.terrain.terrain import Element

_WAITING = RigidTransform([0.0, 0.0, -200.0])
"""Where they wait, in the world [m]."""
_NAME = "appearing_{:03d}"


class AppearingBodies:
    """Which bodies and frames of a plant belong to elements that may appear; knows indices only.

    Each element is a body without mass, welded to a frame whose place in the world is a parameter of the plant's context.
    """

    def __init__(self, elements: tuple[Element, ...], plant: MultibodyPlant, friction: float):
        """Adds them to ``plant``, not finalised yet, with the Coulomb coefficient ``friction`` [1]."""
        self.elements = elements
        self.bodies: list = []
        """Their BodyIndices in the plant."""
        self._places: list = []
        if not elements:
            return
        instance, coulomb = plant.AddModelInstance("appearing"), CoulombFriction(friction, friction)
        for k, element in enumerate(elements):
            name = _NAME.format(k)
            place = plant.AddFrame(FixedOffsetFrame(f"{name}_place", plant.world_frame(), _WAITING))
            body = plant.AddRigidBody(name, instance, SpatialInertia.Zero())
            plant.WeldFrames(place, body.body_frame(), RigidTransform())
            for i, shape in enumerate(collision_shapes(element)):
                plant.RegisterCollisionGeometry(body, RigidTransform(), shape, f"{name}_{i}", coulomb)
            color = np.array(COLORS[element.label])
            plant.RegisterVisualGeometry(body, RigidTransform(), visual_shape(element), name, color)
            self.bodies.append(body.index())
            self._places.append(place.index())

    def put(self, plant: MultibodyPlant, plant_context, number: int, X_WE: np.ndarray) -> None:
        """Puts the element ``number`` to the pose ``X_WE`` (4, 4) in the world."""
        plant.get_frame(self._places[number]).SetPoseInParentFrame(plant_context, RigidTransform(X_WE))

    def sink(self, plant: MultibodyPlant, plant_context, number: int) -> None:
        """Puts the element ``number`` back to where it waited."""
        plant.get_frame(self._places[number]).SetPoseInParentFrame(plant_context, _WAITING)

    def geometries(self, plant: MultibodyPlant, inspector, number: int) -> set[GeometryId]:
        """What of the element ``number`` can be touched; ``inspector`` is that of the plant's SceneGraph."""
        frame = plant.GetBodyFrameIdOrThrow(self.bodies[number])
        return set(inspector.GetGeometries(frame, Role.kProximity))


def add_appearing_to_camera_scene(elements: tuple[Element, ...], scene: SceneGraph) -> tuple[SourceId, list[FrameId]]:
    """Gives cameras the elements to see; returns who has to say where the frames are, and the frames."""
    source, frames = scene.RegisterSource("appearing"), []
    for k, element in enumerate(elements):
        name, properties = _NAME.format(k), PerceptionProperties()
        properties.AddProperty("phong", "diffuse", Rgba(*COLORS[element.label]))
        properties.AddProperty("label", "id", RenderLabel.kDontCare)
        frame = scene.RegisterFrame(source, GeometryFrame(name))
        geometry = scene.RegisterGeometry(source, frame, GeometryInstance(RigidTransform(), visual_shape(element), name))
        scene.AssignRole(source, geometry, properties)
        frames.append(frame)
    return source, frames
