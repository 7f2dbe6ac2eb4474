"""What is different from what the controllers believe: load, masses, friction, drives that are late."""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import SpatialInertia, UnitInertia

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.terrain.terrain import MAX_FRICTION

_DENSITY = 2000.0
"""Of the payload, for its size [kg/m^3]."""


@configuration
class ModelErrorConfig:
    """Differences between the simulated world and what the controllers believe; none by default."""

    friction: float | None = ranged(None, 0.001, MAX_FRICTION)
    """Friction coefficient of the ground [1]; null: the terrain's."""
    payload: float = ranged(0.0, 0.0, 1000.0)
    """Mass fixed to the base [kg], a cube."""
    payload_position: list[float] = ranged([0.0, 0.0, 0.1], -2.0, 2.0)
    """Its centre in the base frame B [m]."""
    base_mass_factor: float = ranged(1.0, 0.1, 10.0)
    """True mass (and inertia) of the base as part of the believed one [1]."""
    actuator_delay: float = ranged(0.0, 0.0, 0.1)
    """How late commands reach the drives [s]; rounded to steps of the physics."""


def add_payload(plant: MultibodyPlant, robot, config: ModelErrorConfig) -> None:
    """Welds the payload to the base of ``robot`` in a plant that is not finalised; it collides with nothing."""
    if config.payload <= 0.0:
        return
    edge = float(np.cbrt(config.payload / _DENSITY))
    inertia = SpatialInertia(config.payload, np.zeros(3), UnitInertia.SolidCube(edge))
    body = plant.AddRigidBody("payload", plant.AddModelInstance("payload"), inertia)
    base = plant.GetBodyByName("base", plant.GetModelInstanceByName(robot.name))
    plant.WeldFrames(base.body_frame(), body.body_frame(), RigidTransform(np.array(config.payload_position)))
    if plant.geometry_source_is_registered():
        from pydrake.geometry import Box

        color = np.array([0.85, 0.35, 0.15, 1.0])
        plant.RegisterVisualGeometry(body, RigidTransform(), Box(edge, edge, edge), "payload", color)


def set_base_mass(plant: MultibodyPlant, plant_context, robot, config: ModelErrorConfig) -> None:
    """Scales mass and inertia of the base in a context of the plant."""
    if config.base_mass_factor == 1.0:
        return
    base = plant.GetBodyByName("base", plant.GetModelInstanceByName(robot.name))
    believed = base.default_spatial_inertia()
    scaled = SpatialInertia(believed.get_mass() * config.base_mass_factor, believed.get_com(), believed.get_unit_inertia())
    base.SetSpatialInertiaInBodyFrame(plant_context, scaled)
