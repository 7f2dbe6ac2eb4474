"""What can be put in the robot's way: a stock of elements, because Drake adds no geometry to a running simulation."""

from quadpips_drake.errors import UserInputError
from quadpips_drake.terrain.appearing.appearances import Appearance, parse_appearance
from quadpips_drake.terrain.terrain import Element

KINDS = {"block": "box:0.3,0.3,0.2", "step": "box:0.5,0.5,0.06", "wall": "box:0.1,1.2,0.5", "post": "cylinder:0.08,0.8"}
"""Name and size of each, as ``--spawn`` has it."""
OF_EACH = 3
"""How many there are."""


class Stock:
    """Counts what has been taken."""

    def __init__(self):
        self._left = {kind: list(range(k * OF_EACH, (k + 1) * OF_EACH)) for k, kind in enumerate(KINDS)}

    @property
    def elements(self) -> tuple[Element, ...]:
        """All of them, in the order of their numbers."""
        return tuple(_appearance(kind, 0.0, 0.0, 0.0).elements[0] for kind in KINDS for _ in range(OF_EACH))

    def left(self) -> dict[str, int]:
        """How many there still are of each kind."""
        return {kind: len(numbers) for kind, numbers in self._left.items()}

    def offer(self, kind: str, x: float, y: float, time: float) -> tuple[Appearance, int]:
        """The next one of a kind at x, y [m] and ``time`` [s], and its number; it is there until it is taken.

        Raises:
            UserInputError: there is none.
        """
        if not self._left[kind]:
            raise UserInputError(f"all {OF_EACH} of the kind '{kind}' are there already; begin anew to have them back")
        return _appearance(kind, x, y, time), self._left[kind][0]

    def take(self, kind: str) -> None:
        """Takes what was offered."""
        self._left[kind].pop(0)


def _appearance(kind: str, x: float, y: float, time: float) -> Appearance:
    return parse_appearance(f"{KINDS[kind]}@{x:.3f},{y:.3f}@{time:.3f}")
