"""A world: two slabs with a gap between them."""

import numpy as np

import quadpips_drake as qp
from quadpips_drake.terrain.terrain import pose


def two_slabs(seed: int = 0) -> qp.Terrain:
    """Two slabs, 5 cm apart."""
    slabs = tuple(qp.Box(name=f"slab_{k}", size=(3.0, 4.0, 0.2), X_WE=pose((3.05 * k, 0.0, -0.1))) for k in range(2))
    return qp.Terrain("two_slabs", np.zeros(3), np.array([2.5, 0.0]), 0.8, slabs)
