"""Up a ramp with a divot, over a narrow beam, down a ramp: plates as in the original world, walked in -x."""

import math

from quadpips_drake.terrain.environments.difficulty import takes_difficulty
from quadpips_drake.terrain.environments.parts import ground_between, pit_floor
from quadpips_drake.terrain.terrain import DEFAULT_FRICTION, Box, Terrain, pose

_THICKNESS = 0.0335
_WIDTH = 1.898
_LONG, _MIDDLE, _SHORT = 1.998, 0.7157, 0.6663
"""Lengths of the plates [m]."""
_PLATES = {
    "up": (_LONG, (-1.9971, 0.4967, 0.0), (0, 0.2126, 0)),
    "riser": (_LONG, (-2.9454, 0.4953, -0.7719), (math.pi, -1.536, math.pi)),
    "divot": (_MIDDLE, (-3.2888, 0.4957, 0.0250), (0, -0.548, 0)),
    "divot_wall": (_MIDDLE, (-3.1999, 0.4954, -0.0329), (math.pi, -1.542, math.pi)),
    "up_again": (_SHORT, (-3.5400, 0.4945, 0.3796), (0, 0.2126, 0)),
    "platform": (_SHORT, (-4.1954, 0.4967, 0.4443), (0, -0.017, 0)),
    "near_wall": (_SHORT, (-4.5008, 0.4944, 0.1177), (math.pi, -1.541, math.pi)),
    "far_wall": (_SHORT, (-5.8886, 0.3601, 0.0902), (math.pi, -1.541, math.pi)),
    "far_platform": (_SHORT, (-6.2123, 0.3579, 0.4098), (0, -0.017, 0)),
}
"""Length [m], centre [m] and roll, pitch, yaw [rad]. Walls are plates that stand on edge."""
_BEAM = (1.387, (-5.1983, 0.4938, 0.4268), (0, -0.017, 0))
_width = takes_difficulty("width", "width of the beam", "m", low=0.08, high=1.2, larger_is_harder=False)


@_width
def ramped_balance_beam(*, seed: int = 0, width: float = 0.374) -> Terrain:
    """Up a ramp with a divot, over a beam of 0.37 m, down 25 degrees.

    The ramp rises by 12 degrees to 0.23 m; behind the divot, a step of 10 cm, to 0.47 m. The beam is 1.39 m long and
    ``width`` [m] wide.
    """
    down = (2.0, 1.9), (-7.4437, 0.3553, -0.0128), (0, -0.4328, 0)
    return _ramped("ramped_balance_beam", width, *down)


@_width
def ramped_balance_beam_easy(*, seed: int = 0, width: float = 0.374) -> Terrain:
    """Up a ramp with a divot, over a beam of 0.37 m, down 12 degrees.

    As ``ramped_balance_beam`` except for the last ramp.
    """
    return _ramped("ramped_balance_beam_easy", width, (2.0, 1.9), (-7.5225, 0.3553, 0.1973), (0, -0.2126, 0))


def _ramped(name: str, width: float, down_size, down_xyz, down_rpy) -> Terrain:
    elements = [
        ground_between("start_ground", -2.0, 3.0, 0.5, 6.0),
        ground_between("goal_ground", -11.0, -6.0, 0.5, 6.0),
        pit_floor(-11.0, 3.0, 6.0, -0.95, 0.5),
    ]
    for plate, (length, xyz, rpy) in _PLATES.items():
        elements.append(Box(name=plate, size=(length, _WIDTH, _THICKNESS), X_WE=pose(xyz, rpy)))
    length, xyz, rpy = _BEAM
    elements.append(Box(name="beam", size=(length, width, _THICKNESS), X_WE=pose(xyz, rpy)))
    elements.append(Box(name="down", size=(*down_size, _THICKNESS), X_WE=pose(down_xyz, down_rpy)))
    return Terrain(name, (0.0, 0.5, -math.pi), (-8.5, 0.5), DEFAULT_FRICTION, tuple(elements))
