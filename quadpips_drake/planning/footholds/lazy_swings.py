"""Swings that are tested for clearance when it is their turn: the search looks at few of its edges."""

from collections import Counter
from collections.abc import Callable, Iterable

from quadpips_drake.planning.footholds.search_node import SearchNode

_STUCK_AFTER = 3
"""A foot is stuck if so many of its swings were found blocked [1]: it stands too close to something high."""


class LazySwings:
    """Which swings clear the ground; each is tested once, by what the caller of the search has for it."""

    def __init__(self, clears: Callable, duration: float):
        """
        Args:
            clears: see ``search_footholds``.
            duration: of a swing [s].
        """
        self._clears, self._duration = clears, duration
        self._tested: dict = {}
        self._blocked: Counter = Counter()

    def blocked_from(self, before: SearchNode) -> set[int]:
        """Legs that are known to have blocked swings from a stance."""
        if not self._blocked:
            return set()
        feet = before.feet
        return {leg for leg in range(4) if (leg, feet[leg].tobytes()) in self._blocked}

    def may_clear(self, legs: Iterable[int], before: SearchNode, after: SearchNode, blocked: set[int]) -> bool:
        """False if one of these swings is known to be blocked; ``blocked`` is ``blocked_from`` the stance before."""
        return all(self._tested.get(_swing(leg, before, after), True) for leg in legs if leg in blocked)

    def clear(self, legs: Iterable[int], before: SearchNode, after: SearchNode) -> bool:
        """Whether all of them clear the ground."""
        return all(self._test(leg, before, after) for leg in legs)

    def stuck_feet(self, node: SearchNode) -> int:
        """How many feet of a stance stand where several swings were found blocked."""
        if not self._blocked:
            return 0
        feet = node.feet
        return sum(self._blocked[leg, feet[leg].tobytes()] >= _STUCK_AFTER for leg in range(4))

    def _test(self, leg, before, after) -> bool:
        swing = _swing(leg, before, after)
        if swing not in self._tested:
            start, end = ((node.feet[leg], node.normals[leg]) for node in (before, after))
            self._tested[swing] = self._clears(self._duration, start, end)
            if not self._tested[swing]:
                self._blocked[swing[:2]] += 1
        return self._tested[swing]


def _swing(leg: int, before: SearchNode, after: SearchNode) -> tuple:
    """Identity of the swing of one leg between two stances."""
    return int(leg), before.feet[leg].tobytes(), after.feet[leg].tobytes()
