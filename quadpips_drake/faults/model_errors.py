"""What is different from what the controllers believe: load, masses, friction, drives that are late."""

from dataclasses import dataclass, field

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import SpatialInertia, UnitInertia

from quadpips_drake.errors import UserInputError
from quadpips_drake.terrain.terrain import MAX_FRICTION

_DENSITY = 2000.0
"""Of the payload, for its size [kg/m^3]."""


@dataclass
class ModelErrorConfig:
    """Differences between the simulated world and what the controllers believe; none by default."""

    friction: float | None = None
    """Friction coefficient of the ground [1]; null: the terrain's."""
    payload: float = 0.0
    """Mass fixed to the base [kg], a cube."""
    payload_position: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.1])
    """Its centre in the base frame B [m]."""
    base_mass_factor: float = 1.0
    """True mass (and inertia) of the base as part of the believed one [1]."""
    actuator_delay: float = 0.0
    """How late commands reach the drives [s]; rounded to steps of the physics."""

    def __post_init__(self):
        if self.friction is not None and not 0.0 < self.friction <= MAX_FRICTION:
            raise UserInputError(f"friction must be above 0 and at most {MAX_FRICTION:g}, not {self.friction}")
        if not (self.payload >= 0.0 and len(self.payload_position) == 3):
            raise UserInputError("payload must not be negative, payload_position three numbers")
        if not 0.1 <= self.base_mass_factor <= 10.0:
            raise UserInputError(f"base_mass_factor must be 0.1..10, not {self.base_mass_factor}")
        if not 0.0 <= self.actuator_delay <= 0.1:
            raise UserInputError(f"actuator_delay must be 0..0.1 s, not {self.actuator_delay}")


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
