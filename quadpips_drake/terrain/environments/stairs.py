"""Stairs up to a platform, with closed and with open risers, for small and for large robots."""

from quadpips_drake.errors import UserInputError
from quadpips_drake.terrain.environments.difficulty import takes_difficulty
from quadpips_drake.terrain.environments.parts import ground
from quadpips_drake.terrain.terrain import DEFAULT_FRICTION, Box, Terrain, pose

OPEN_THICKNESS = 0.02
"""Of the treads of open stairs [m]."""
_rise = takes_difficulty("rise", "rise of a step", "m", low=0.02, high=0.25)


@_rise
def stairs(*, seed: int = 0, rise: float = 0.05, run: float = 0.20, steps: int = 10, width: float = 3.0) -> Terrain:
    """Stairs up to a platform.

    There are ``steps`` treads, each ``rise`` higher and ``run`` further than the last. Lengths in m. A tread is as thick as
    it rises, so that the risers are closed.
    """
    return _stairs("stairs", rise, run, steps, width, rise)


@_rise
def stairs_10(*, seed: int = 0, rise: float = 0.10, run: float = 0.20, steps: int = 10, width: float = 3.0) -> Terrain:
    """Stairs with steps of 10 cm, as ANYmal C climbs them.

    Otherwise as ``stairs``.
    """
    return _stairs("stairs_10", rise, run, steps, width, rise)


@_rise
def open_stairs(*, seed: int = 0, rise: float = 0.05, run: float = 0.20, steps: int = 10, width: float = 3.0) -> Terrain:
    """Stairs without risers: thin treads that a camera looks through.

    Treads and platform are 2 cm thick, or half the rise if that is less, with nothing between them; their tops are those of
    ``stairs``.
    """
    return _stairs("open_stairs", rise, run, steps, width, min(OPEN_THICKNESS, 0.5 * rise))


@_rise
def open_stairs_10(*, seed: int = 0, rise: float = 0.10, run: float = 0.20, steps: int = 10, width: float = 3.0) -> Terrain:
    """Stairs without risers, with steps of 10 cm.

    Otherwise as ``open_stairs``.
    """
    return _stairs("open_stairs_10", rise, run, steps, width, min(OPEN_THICKNESS, 0.5 * rise))


def _stairs(name: str, rise: float, run: float, steps: int, width: float, thickness: float) -> Terrain:
    if rise <= 0 or run <= 0 or steps < 1:
        raise UserInputError(f"{name}: rise > 0, run > 0 and steps >= 1 are needed")
    lower = 0.5 * (rise - thickness)  # an open tread's top is where a closed one's is
    elements = [ground(14.0)]
    for i in range(steps):
        center = (run * i, 0, rise * (i + 0.5) + lower)
        elements.append(Box(name=f"tread_{i}", size=(run, width, thickness), X_WE=pose(center)))
    # The platform's centre lies `rise / 2` above the last tread's, as in the original world (top 0.525 m at rise 0.05 m).
    end = run * (steps - 0.5)
    elements.append(Box(name="platform", size=(3.0, width, thickness), X_WE=pose((end + 1.5, 0, rise * steps + lower))))
    return Terrain(name, (-0.5 * run - 1.1, 0, 0), (end + 1.0, 0), DEFAULT_FRICTION, tuple(elements))
