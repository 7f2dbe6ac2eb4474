"""Level ground."""

from quadpips_drake.terrain.environments.parts import ground
from quadpips_drake.terrain.terrain import DEFAULT_FRICTION, Terrain


def flat(*, seed: int = 0, size: float = 16.0, distance: float = 3.0) -> Terrain:
    """Level ground. It is a square of ``size`` [m]; the goal lies ``distance`` [m] ahead of the start."""
    return Terrain("flat", (0, 0, 0), (distance, 0), DEFAULT_FRICTION, (ground(size),))
