"""Which way a robot has to look in an environment, beside straight ahead.

    @wants_cameras("left", "right")
    def parallel_beams(*, seed: int = 0) -> Terrain: ...

Cameras are named as in robot.yaml. A trial gives the robot those of them that it has, unless its configuration says
otherwise.
"""

from collections.abc import Callable

_MARK = "cameras"


def wants_cameras(*names: str) -> Callable:
    """Marks the function of an environment whose ground lies beside the robot rather than in front of it."""

    def mark(factory: Callable) -> Callable:
        setattr(factory, _MARK, names)
        return factory

    return mark


def cameras_of(factory: Callable) -> tuple[str, ...]:
    """The names with which a function was marked; empty: the front camera is enough."""
    return getattr(factory, _MARK, ())
