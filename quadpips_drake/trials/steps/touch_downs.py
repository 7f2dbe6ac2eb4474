"""Where feet really came down: counted from the log, whoever planned, against the true terrain."""

import numpy as np

from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.terrain.truth import GroundTruth

_OFF = 0.05
"""A foot that was off the ground for so long has been lifted [s]; shorter, it only bounced."""
_BELOW = 0.02
"""A foot this far below walkable ground is not on it [m]: soles sink in by a few millimetres."""


def touch_down_statistics(arrays: dict, terrain: Terrain, foot_radius: float) -> dict:
    """Counts touch-downs, and those where there is no ground to stand on.

    Args:
        arrays: of the log: ``time`` (n,), ``foot_positions``, centres in W [m], (n, 4, 3), ``contacts`` (n, 4).
        terrain: the true one.
        foot_radius: [m].

    Returns:
        ``touch_downs``; ``unsafe``, how many of them were over no walkable ground or more than 2 cm below it;
        ``deepest_m``, how far below walkable ground a sole has been at most, in the air, too.
    """
    time, contacts = arrays["time"], arrays["contacts"]
    soles = arrays["foot_positions"] - [0.0, 0.0, foot_radius]
    truth, x, y = GroundTruth(terrain), soles[..., 0].ravel(), soles[..., 1].ravel()
    depth = (truth.nearest_walkable_height(x, y) - soles[..., 2].ravel()).reshape(contacts.shape)
    has_ground = np.isfinite(truth.height(x, y, walkable_only=True)).reshape(contacts.shape)
    counts = {"touch_downs": 0, "unsafe": 0}
    for leg in range(contacts.shape[1]):
        for k in _touch_downs(time, contacts[:, leg]):
            counts["touch_downs"] += 1
            counts["unsafe"] += bool(not has_ground[k, leg] or depth[k, leg] > _BELOW)
    return counts | {"deepest_m": round(float(max(depth.max(), 0.0)), 4)}


def _touch_downs(time: np.ndarray, down: np.ndarray) -> list[int]:
    """Samples at which a foot comes down that has been lifted."""
    changes = np.flatnonzero(down[1:] != down[:-1]) + 1
    found, lifted = [], None
    for k in changes:
        if not down[k]:
            lifted = time[k]
        elif lifted is not None and time[k] - lifted >= _OFF - 1e-9:
            found.append(int(k))
    return found
