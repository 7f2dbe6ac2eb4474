"""Up a ramp, over round stones, down a ramp: placed as in the original world, walked in -x."""

import math

import numpy as np

from quadpips_drake.terrain.environments.difficulty import takes_difficulty
from quadpips_drake.terrain.environments.parts import ground_between, pit_floor
from quadpips_drake.terrain.terrain import DEFAULT_FRICTION, Box, Cylinder, Terrain, pose

_THICKNESS, _WIDTH = 0.0335, 1.898
_LONG, _SHORT = 1.998, 0.6663
"""Lengths of the plates [m]."""
_TILT = math.radians(1.47)
"""Of the stones, to the same side as the platforms [rad]."""
_STONE_TOP, _STONE_LENGTH = 0.252, 1.0
_STONES = (
    (-4.578, 7.706), (-4.752, 8.070), (-4.901, 7.795), (-4.666, 7.354), (-5.017, 7.526), (-5.216, 8.018), (-5.336, 7.771),
    (-5.311, 7.437), (-4.858, 7.091), (-5.579, 7.392), (-5.666, 7.857), (-5.507, 8.080), (-5.824, 7.600), (-5.161, 7.092),
    (-5.567, 6.979), (-5.788, 7.123), (-5.749, 8.003), (-5.893, 7.840), (-4.491, 7.028), (-4.480, 7.357), (-4.480, 7.966),
)  # fmt: skip
"""Centres of their tops, x and y [m]."""
_radius = takes_difficulty("radius", "radius of the stones", "m", low=0.04, high=0.16, larger_is_harder=False)


@_radius
def ramped_stepping_stones(*, seed: int = 0, radius: float = 0.1115) -> Terrain:
    """Up a ramp, over 21 round stones that stand anyhow, down 28 degrees.

    The ramp rises by 12 degrees to 0.23 m; the stones, columns of ``radius`` [m], end at 0.25 m, over a pit of 0.7 m.
    """
    return _ramped("ramped_stepping_stones", radius, (-7.5809, 7.4613, -0.2401), -0.492)


@_radius
def ramped_stepping_stones_easy(*, seed: int = 0, radius: float = 0.1115) -> Terrain:
    """Up a ramp, over 21 round stones that stand anyhow, down 12 degrees.

    As ``ramped_stepping_stones`` except for the last ramp.
    """
    return _ramped("ramped_stepping_stones_easy", radius, (-7.6677, 7.4613, 0.0168), -0.2126)


def _ramped(name: str, radius: float, down_xyz, down_pitch: float) -> Terrain:
    def plate(title: str, length: float, xyz, pitch: float) -> Box:
        return Box(name=title, size=(length, _WIDTH, _THICKNESS), X_WE=pose(xyz, (0, pitch, 0)))

    elements = [
        ground_between("start_ground", -4.0, 3.0, 7.5, 6.0),
        ground_between("goal_ground", -11.0, -6.5, 7.5, 6.0),
        pit_floor(-11.0, 3.0, 6.0, -0.7, 7.5),
        plate("up", _LONG, (-2.7145, 7.3040, 0.0), 0.2126),
        plate("platform", _SHORT, (-4.0201, 7.3027, 0.2049), -0.017),
        plate("far_platform", _SHORT, (-6.3707, 7.4544, 0.2345), -0.017),
        plate("down", _LONG, down_xyz, down_pitch),
    ]
    axis = np.array([-math.sin(_TILT), 0.0, math.cos(_TILT)])
    for k, (x, y) in enumerate(_STONES):
        center = np.array([x, y, _STONE_TOP]) - 0.5 * _STONE_LENGTH * axis
        X_WE = pose(center, (0, -_TILT, 0))
        elements.append(Cylinder(name=f"stone_{k}", radius=radius, length=_STONE_LENGTH, X_WE=X_WE))
    return Terrain(name, (0.5, 7.5, -math.pi), (-8.0, 7.5), DEFAULT_FRICTION, tuple(elements))
