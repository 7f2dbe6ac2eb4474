"""What several environments are built of."""

from quadpips_drake.terrain.terrain import Box, pose
from quadpips_drake.values.steppability import Steppability

PLATFORM_THICKNESS = 0.1


def ground(size: float) -> Box:
    """A level square with its top at z = 0."""
    return Box(name="ground", size=(size, size, 0.2), X_WE=pose((0, 0, -0.1)))


def ground_between(name: str, x_from: float, x_to: float, y: float, width: float) -> Box:
    """Level ground with its top at z = 0, ``width`` [m] wide around ``y`` [m]; deeper than a platform."""
    return Box(name=name, size=(x_to - x_from, width, 0.2), X_WE=pose((0.5 * (x_from + x_to), y, -0.1)))


def platform(name: str, x_from: float, x_to: float, width: float) -> Box:
    """A slab with its top at z = 0."""
    size = (x_to - x_from, width, PLATFORM_THICKNESS)
    return Box(name=name, size=size, X_WE=pose((0.5 * (x_from + x_to), 0, -0.5 * PLATFORM_THICKNESS)))


def block(name: str, x_from: float, x_to: float, width: float, top: float) -> Box:
    """A cuboid that stands on level ground and ends at ``top`` [m]."""
    return Box(name=name, size=(x_to - x_from, width, top), X_WE=pose((0.5 * (x_from + x_to), 0, 0.5 * top)))


def pit_floor(x_from: float, x_to: float, width: float, top: float, y: float = 0.0) -> Box:
    """The bottom of a pit, wider than the rest so that a camera does not look past it into the void."""
    size = (x_to - x_from, width + 4.0, PLATFORM_THICKNESS)
    center = (0.5 * (x_from + x_to), y, top - 0.5 * PLATFORM_THICKNESS)
    return Box(name="pit_floor", size=size, X_WE=pose(center), label=Steppability.NON_PASSABLE)
