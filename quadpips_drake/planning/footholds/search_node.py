"""What the foothold search keeps of a contact-mode family, and what comes of a search."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from quadpips_drake.planning.footholds.stance_rules import REJECTIONS


class Stances(NamedTuple):
    """Full stances, one a row."""

    feet: np.ndarray
    """Ground points in W [m], (k, 4, 3)."""
    normals: np.ndarray
    """(k, 4, 3)."""
    regions: np.ndarray
    """Indices into the region table, (k, 4)."""
    p_WB: np.ndarray
    """Nominal base [m], (k, 3)."""
    rpy_WB: np.ndarray
    """[rad], (k, 3)."""


@dataclass(slots=True)
class SearchNode:
    """A contact-mode family, with the full stance that led to it.

    The family is the phase and what the legs stand on that do not swing in it; the swinging legs only matter as the places
    where they lift off. Nodes with the same family are merged: the cheaper way to it wins.

    Few nodes are ever looked at closely, so a node only says which row of its ``siblings`` its stance is.
    """

    siblings: Stances
    row: int
    phase: int
    cost: float
    to_go: float
    parent: int
    depth: int
    family: bytes
    """Identity of the family; see ``identities``."""
    arrives: bool
    """Whether the base is at the waypoint."""
    deviation: float
    """See ``stance_deviation``, without slack [m^2]."""
    bad_ground: float = 0.0
    """Part of the cost that is due to labels worse than unseen and to experience, on the way here [m]."""
    swung: int = -1
    """Phase whose legs swung to come here, -1 at the start."""

    @property
    def feet(self) -> np.ndarray:
        return self.siblings.feet[self.row]

    @property
    def normals(self) -> np.ndarray:
        return self.siblings.normals[self.row]

    @property
    def regions(self) -> np.ndarray:
        return self.siblings.regions[self.row]

    @property
    def p_WB(self) -> np.ndarray:
        return self.siblings.p_WB[self.row]

    @property
    def rpy_WB(self) -> np.ndarray:
        return self.siblings.rpy_WB[self.row]


@dataclass
class SearchResult:
    """Outcome of the search for one waypoint."""

    node: int = -1
    complete: bool = False
    expansions: int = 0
    refused: np.ndarray = field(default_factory=lambda: np.zeros(len(REJECTIONS), dtype=np.int64))
    combinations: int = 0
    reason: str = ""
    time_limit_hit: bool = False
