"""What a terrain is: rigid elements fixed in the world, friction, where the robot starts and where it shall go.

Frames: W world (z up, against gravity), E of an element (its centre and axes).
"""

import hashlib
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from quadpips_drake.errors import UserInputError
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.steppability import Steppability

MIN_SIZE = 1e-3
"""Smallest edge length or radius of an element [m]."""
MAX_EXTENT = 1000.0
"""Largest size of an element, and largest distance of one from the origin along an axis [m]."""
DEFAULT_FRICTION = 1.0
"""Coulomb coefficient of a terrain that says nothing else [1]."""
MAX_FRICTION = 100.0
GOAL_TOLERANCE = 0.30
"""A robot whose base is this close to the goal, in xy, has reached it, unless a trial says otherwise [m]."""
MAX_ELEMENTS = 5000
"""Elements in a terrain, where each triangle of a mesh counts as one."""
_SIGNS = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1], indexing="ij")).reshape(3, -1).T
"""Of the coordinates of a box's corners, (8, 3)."""


def pose(xyz=(0.0, 0.0, 0.0), rpy=(0.0, 0.0, 0.0)) -> np.ndarray:
    """Returns the homogeneous matrix (4, 4) of position ``xyz`` [m] and roll, pitch, yaw ``rpy`` [rad]."""
    return RigidTransform(RollPitchYaw(np.asarray(rpy, float)), np.asarray(xyz, float)).GetAsMatrix4()


@dataclass(frozen=True, eq=False, kw_only=True)
class Element(ImmutableValue):
    """A rigid body of the terrain; made as Box, Cylinder, Sphere or Mesh."""

    X_WE: np.ndarray = field(default_factory=lambda: np.eye(4))
    """Pose of the element's frame in the world, homogeneous matrix (4, 4)."""
    label: Steppability = Steppability.STEPPABLE
    """True steppability. A pit floor, or anything else that no foot shall use, is NON_PASSABLE."""
    name: str = ""
    """For messages and visualisers; need not be unique."""

    def __post_init__(self):
        object.__setattr__(self, "X_WE", np.array(self.X_WE, float))
        if self.X_WE.shape != (4, 4) or not np.isfinite(self.X_WE).all():
            raise UserInputError(f"{self.title}: the pose must consist of finite numbers")
        if np.abs(self.X_WE[:3, 3]).max() > MAX_EXTENT:
            raise UserInputError(f"{self.title}: its position must lie within {MAX_EXTENT:g} m of the origin")
        super().__post_init__()

    @property
    def title(self) -> str:
        """Kind and name, for messages."""
        return f"{type(self).__name__.lower()} '{self.name}'" if self.name else type(self).__name__.lower()

    @property
    def is_walkable(self) -> bool:
        """Whether feet are meant to stand on this element."""
        return self.label in (Steppability.STEPPABLE, Steppability.UNKNOWN)

    @property
    def rpy(self) -> np.ndarray:
        """Roll, pitch, yaw of E in W [rad], (3,)."""
        return RollPitchYaw(RigidTransform(self.X_WE).rotation()).vector()

    def corners(self) -> np.ndarray:
        """Points in W [m], (n, 3), whose convex hull contains the element."""
        raise NotImplementedError

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest x, y, z in W [m] of a box around the element."""
        corners = self.corners()
        return corners.min(axis=0), corners.max(axis=0)

    def _to_world(self, p_E: np.ndarray) -> np.ndarray:
        return p_E @ self.X_WE[:3, :3].T + self.X_WE[:3, 3]


@dataclass(frozen=True, eq=False, kw_only=True)
class Box(Element):
    """A cuboid around the origin of E."""

    size: np.ndarray
    """Length, width, height along the axes of E [m], (3,)."""

    def __post_init__(self):
        object.__setattr__(self, "size", np.array(self.size, float))
        if self.size.shape != (3,):
            raise UserInputError(f"{self.title}: size must be three numbers [length, width, height]")
        _check_size(self, "size", self.size)
        super().__post_init__()

    def corners(self) -> np.ndarray:
        return self._to_world(0.5 * _SIGNS * self.size)


@dataclass(frozen=True, eq=False, kw_only=True)
class Cylinder(Element):
    """A circular cylinder around the z axis of E, with its middle at the origin of E."""

    radius: float
    """[m]"""
    length: float
    """[m]"""

    def __post_init__(self):
        _check_size(self, "radius", self.radius)
        _check_size(self, "length", self.length)
        super().__post_init__()

    def corners(self) -> np.ndarray:
        axis = self.X_WE[:3, 2]
        # Extent of a disc with unit normal `axis` along each world axis, plus that of the axis itself.
        half = self.radius * np.sqrt(np.clip(1 - axis**2, 0, None)) + 0.5 * self.length * np.abs(axis)
        return self.X_WE[:3, 3] + _SIGNS * half


@dataclass(frozen=True, eq=False, kw_only=True)
class Sphere(Element):
    """A sphere around the origin of E."""

    radius: float
    """[m]"""

    def __post_init__(self):
        _check_size(self, "radius", self.radius)
        super().__post_init__()

    def corners(self) -> np.ndarray:
        return self.X_WE[:3, 3] + _SIGNS * self.radius


@dataclass(frozen=True, eq=False, kw_only=True)
class Mesh(Element):
    """A surface of triangles; what lies under a triangle counts as solid."""

    vertices: np.ndarray
    """In E [m], (n, 3)."""
    triangles: np.ndarray
    """Indices into ``vertices``, int (m, 3), counter-clockwise seen from outside."""
    path: str = ""
    """The file that it came from."""
    scale: float = 1.0
    """Factor that was applied to the file's vertices."""

    def __post_init__(self):
        object.__setattr__(self, "vertices", np.array(self.vertices, float).reshape(-1, 3))
        object.__setattr__(self, "triangles", np.array(self.triangles, np.int64).reshape(-1, 3))
        if not 1 <= len(self.triangles) <= MAX_ELEMENTS:
            raise UserInputError(f"{self.title}: it must have 1 to {MAX_ELEMENTS} triangles, not {len(self.triangles)}")
        if not np.isfinite(self.vertices).all() or np.abs(self.vertices).max() > MAX_EXTENT:
            raise UserInputError(f"{self.title}: vertices must be finite and within {MAX_EXTENT:g} m")
        if self.triangles.min() < 0 or self.triangles.max() >= len(self.vertices):
            raise UserInputError(f"{self.title}: a triangle names a vertex that does not exist")
        super().__post_init__()

    def corners(self) -> np.ndarray:
        return self._to_world(self.vertices)


@dataclass(frozen=True, eq=False)
class Terrain(ImmutableValue):
    """Elements fixed in the world, with a start and a goal for the robot."""

    name: str
    start: np.ndarray
    """x, y [m] and yaw [rad] of the robot's base in W, (3,)."""
    goal: np.ndarray
    """x, y [m] in W that the torso shall reach, (2,)."""
    friction: float
    """Coulomb friction coefficient of all elements (static and dynamic)."""
    elements: tuple[Element, ...]

    def __post_init__(self):
        for key, length in (("start", 3), ("goal", 2)):
            value = np.array(getattr(self, key), float)
            object.__setattr__(self, key, value)
            meaning = "x, y, yaw" if length == 3 else "x, y"
            if value.shape != (length,) or not np.isfinite(value).all() or np.abs(value).max() > MAX_EXTENT:
                raise UserInputError(f"{key} of terrain '{self.name}' must be {length} finite numbers ({meaning})")
        if not 0 < self.friction <= MAX_FRICTION:
            raise UserInputError(f"friction of terrain '{self.name}' must be above 0 and at most {MAX_FRICTION:g}")
        object.__setattr__(self, "elements", tuple(self.elements))
        if not self.elements:
            raise UserInputError(f"terrain '{self.name}' has no elements: give at least one box, cylinder, sphere or mesh")
        count = sum(len(element.triangles) if isinstance(element, Mesh) else 1 for element in self.elements)
        if count > MAX_ELEMENTS:
            raise UserInputError(
                f"terrain '{self.name}' has {count} elements and triangles; at most {MAX_ELEMENTS} are allowed"
            )
        super().__post_init__()

    @cached_property
    def element_bounds(self) -> np.ndarray:
        """Lowest and highest x, y, z in W [m] of a box around each element, (n, 2, 3)."""
        bounds = np.array([element.bounds() for element in self.elements])
        bounds.flags.writeable = False
        return bounds

    @cached_property
    def fingerprint(self) -> str:
        """Hash of all elements: the same for terrains in which everything lies at the same place, whatever their names."""
        digest = hashlib.sha256()
        for element in self.elements:
            digest.update(type(element).__name__.encode())
            for key, value in sorted(vars(element).items()):
                if key not in ("name", "path"):
                    digest.update(key.encode() + np.ascontiguousarray(value, float).tobytes())
        return digest.hexdigest()[:16]

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest x, y, z [m] of all elements."""
        return self.element_bounds[:, 0].min(axis=0), self.element_bounds[:, 1].max(axis=0)


def _check_size(element: Element, key: str, value):
    value = np.asarray(value, float)
    if not np.isfinite(value).all() or value.min() < MIN_SIZE or value.max() > MAX_EXTENT:
        raise UserInputError(f"{element.title}: {key} must be between {MIN_SIZE:g} and {MAX_EXTENT:g} m")
