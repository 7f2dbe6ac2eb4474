"""One number says how hard an environment is: a keyword of the function that makes it, with a title, a unit and a range.

    @takes_difficulty("width", "width of the trench", "m", low=0.0, high=1.0)
    def gap(*, seed: int = 0, width: float = 0.30) -> Terrain: ...

The default is that of the keyword. Functions of other packages can be marked in the same way.
"""

import inspect
from collections.abc import Callable
from dataclasses import dataclass

from quadpips_drake.errors import UserInputError

_MARK = "difficulty"


@dataclass(frozen=True)
class Difficulty:
    """What the one number of an environment means."""

    parameter: str
    """Keyword of the function that makes the environment."""
    title: str
    """What it is, in words."""
    unit: str
    """m, rad or 1."""
    default: float
    low: float
    """Least value that is taken."""
    high: float
    """Largest value that is taken."""
    larger_is_harder: bool = True

    def __str__(self):
        return self.told()

    def told(self, value: float | None = None) -> str:
        """In words: ``value``, by default that of the environment itself, and the range."""
        value, harder = self.default if value is None else value, "larger" if self.larger_is_harder else "smaller"
        return f"{self.title} {value:.4g}{self._after_a_number} ({self.low:g} to {self.high:g}, {harder} is harder)"

    @property
    def _after_a_number(self) -> str:
        return "" if self.unit == "1" else f" {self.unit}"

    def check(self, terrain: str, value: float) -> float:
        """Returns ``value`` if it can be had of the environment called ``terrain``; raises UserInputError if not."""
        if not self.low <= value <= self.high:
            span = f"{self.low:g} to {self.high:g}{self._after_a_number}"
            raise UserInputError(f"difficulty of terrain '{terrain}': its {self.title} must be {span}, not {value:g}")
        return float(value)


def takes_difficulty(
    parameter: str, title: str, unit: str, *, low: float, high: float, larger_is_harder: bool = True
) -> Callable:
    """Marks the function of an environment: its ``parameter`` is what makes it easy or hard; see ``Difficulty``."""

    def mark(factory: Callable) -> Callable:
        default = inspect.signature(factory).parameters[parameter].default
        setattr(factory, _MARK, Difficulty(parameter, title, unit, default, low, high, larger_is_harder))
        return factory

    return mark


def difficulty_of(factory: Callable) -> Difficulty | None:
    """The difficulty with which a function was marked; None: there is nothing to choose."""
    return getattr(factory, _MARK, None)
