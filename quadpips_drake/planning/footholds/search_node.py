"""What the foothold search keeps of a contact-mode family, and what comes of a search."""

from dataclasses import dataclass, field

import numpy as np

from quadpips_drake.planning.footholds.stance_rules import REJECTIONS


@dataclass(slots=True)
class SearchNode:
    """A contact-mode family, with the full stance that led to it.

    The family is the phase and what the legs stand on that do not swing in it; the swinging legs only matter as the places
    where they lift off. Nodes with the same family are merged: the cheaper way to it wins.
    """

    phase: int
    feet: np.ndarray
    normals: np.ndarray
    regions: np.ndarray
    p_WB: np.ndarray
    rpy_WB: np.ndarray
    cost: float
    to_go: float
    parent: int
    depth: int
    family: tuple
    """Identity of the family; see ``FamilySearch._families``."""
    bad_ground: float = 0.0
    """Part of the cost that is due to labels worse than unseen and to experience, on the way here [m]."""
    swung: int = -1
    """Phase whose legs swung to come here, -1 at the start."""


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
