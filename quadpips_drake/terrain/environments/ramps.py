"""Ramps: up to a platform, over one, and down from one."""

import math

import numpy as np

from quadpips_drake.errors import UserInputError
from quadpips_drake.terrain.environments.difficulty import takes_difficulty
from quadpips_drake.terrain.environments.parts import PLATFORM_THICKNESS, ground
from quadpips_drake.terrain.terrain import DEFAULT_FRICTION, Box, Terrain, pose


@takes_difficulty("angle", "slope", "rad", low=0.02, high=0.7)
def ramp_10(*, seed: int = 0, angle: float = 0.175, length: float = 3.0, width: float = 3.0) -> Terrain:
    """A ramp of 10 degrees up to a platform.

    ``angle`` of the ramp in rad, ``length`` and ``width`` in m. As in the original world the mid-plane of the 0.1 m thick
    ramp starts on the ground, so that its top begins with a lip of 0.049 m.
    """
    if not 0 < angle < 1.2:
        raise UserInputError("ramp_10: angle must be between 0 and 1.2 rad")
    run, climb = length * math.cos(angle), length * math.sin(angle)
    size = (length, width, PLATFORM_THICKNESS)
    level = (3.0, width, PLATFORM_THICKNESS)
    elements = (
        ground(14.0),
        Box(name="ramp", size=size, X_WE=pose((0, 0, 0.5 * climb), (0, -angle, 0))),
        Box(name="platform", size=level, X_WE=pose((0.5 * run + 1.5, 0, climb))),
    )
    return Terrain("ramp_10", (round(-0.5 * run - 0.8, 1), 0, 0), (round(0.5 * run + 1.1, 1), 0), DEFAULT_FRICTION, elements)


@takes_difficulty("angle", "slope", "rad", low=0.02, high=0.7)
def slope(*, seed: int = 0, angle: float = 0.2618, length: float = 3.0, width: float = 6.0) -> Terrain:
    """A slope of 15 degrees up to a platform, and another one down behind it.

    ``angle`` in rad, ``length`` of either slope and ``width`` in m. Slopes and platform join without a lip.
    """
    if not 0 < angle < 1.2:
        raise UserInputError("slope: angle must be between 0 and 1.2 rad")
    run, climb = length * math.cos(angle), length * math.sin(angle)
    top = 2.0
    tilted = 0.5 * PLATFORM_THICKNESS * np.array([math.sin(angle), math.cos(angle)])  # from mid-plane to top
    up = (0.5 * run + tilted[0], 0, 0.5 * climb - tilted[1])
    down = (1.5 * run + top - tilted[0], 0, up[2])
    elements = (
        ground(20.0),
        Box(name="up", size=(length, width, PLATFORM_THICKNESS), X_WE=pose(up, (0, -angle, 0))),
        Box(
            name="platform",
            size=(top, width, PLATFORM_THICKNESS),
            X_WE=pose((run + 0.5 * top, 0, climb - 0.5 * PLATFORM_THICKNESS)),
        ),
        Box(name="down", size=(length, width, PLATFORM_THICKNESS), X_WE=pose(down, (0, angle, 0))),
    )
    return Terrain("slope", (-0.7, 0, 0), (round(run + 0.5 * top, 2), 0), DEFAULT_FRICTION, elements)


@takes_difficulty("angle", "slope", "rad", low=0.02, high=0.7)
def down_ramp(*, seed: int = 0, angle: float = 0.45, length: float = 3.0, width: float = 3.0) -> Terrain:
    """A ramp of 26 degrees down from a platform to a lower one.

    ``angle`` of the ramp in rad, ``length`` and ``width`` in m. Nothing lies beside or below them.
    """
    if not 0 < angle < 1.2:
        raise UserInputError("down_ramp: angle must be between 0 and 1.2 rad")
    run, climb = length * math.cos(angle), length * math.sin(angle)
    # The mid-planes of ramp and platforms meet: at the middle of the world's ramp, x = 3, and half a run before and after.
    middle, level = -0.5 * PLATFORM_THICKNESS, (3.0, width, PLATFORM_THICKNESS)
    elements = (
        Box(name="platform", size=level, X_WE=pose((0.175, 0, middle))),
        Box(name="ramp", size=(length, width, PLATFORM_THICKNESS), X_WE=pose((3.0, 0, middle - 0.5 * climb), (0, angle, 0))),
        Box(name="lower_platform", size=level, X_WE=pose((3.0 + 0.5 * run + 1.5, 0, middle - climb))),
    )
    return Terrain("down_ramp", (-0.7, 0, 0), (6.5, 0), DEFAULT_FRICTION, elements)
