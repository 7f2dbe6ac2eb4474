"""A trench between two platforms."""

from quadpips_drake.terrain.environments.difficulty import takes_difficulty
from quadpips_drake.terrain.environments.parts import pit_floor, platform
from quadpips_drake.terrain.terrain import DEFAULT_FRICTION, Terrain


@takes_difficulty("width", "width of the trench", "m", low=0.05, high=1.0)
def gap(*, seed: int = 0, width: float = 0.30) -> Terrain:
    """A trench from side to side, to be stepped over.

    It is ``width`` [m] across and 1 m deep.
    """
    elements = (
        platform("start_platform", -3.5, 0.0, 4.0),
        platform("goal_platform", width, width + 3.5, 4.0),
        pit_floor(-3.5, width + 3.5, 4.0, -1.0),
    )
    return Terrain("gap", (-1.5, 0, 0), (width + 1.5, 0), DEFAULT_FRICTION, elements)
