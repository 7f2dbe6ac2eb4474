"""What footholds cost by their labels: steppability in the search (Asselmeier et al., arXiv 2501.00112, eqs. 2-5).

Each foothold is projected into the newest label image by five points, its centre and a foot radius away in x and y,

    units(foothold) = sum over the points of 1 steppable, 5 out of the frame, 100 passable, 1000 non-passable,
    cost(stance) = weight (sum over its four feet of units - 20).

So a label makes a foothold dear, not impossible: what hides the ground may be all that was labelled.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.values.images import LabelImage
from quadpips_drake.values.steppability import Steppability

UNITS = {
    Steppability.STEPPABLE.name.lower(): 1.0,
    "out_of_frame": 5.0,
    Steppability.PASSABLE.name.lower(): 100.0,
    Steppability.NON_PASSABLE.name.lower(): 1000.0,
}
"""Cost of a point, eq. 4."""
_POINTS = 5
_STEPPABLE, _OUT = UNITS["steppable"], UNITS["out_of_frame"]
_LEAST = 4 * _POINTS * _STEPPABLE
"""A stance on steppable ground that is in the image."""
_UNSEEN = 4 * _POINTS * _OUT
"""A stance out of the frame."""
_BEHIND = 0.05
"""A point so far behind what was measured is hidden by it [m]."""
_NEAR = 1e-3
"""Nearer points are behind the camera [m]."""


class FootholdLabels(NamedTuple):
    """The mask, taken once before the search; a NamedTuple of read-only arrays, so that numba takes it as it is."""

    weight: float
    """Cost of one unit [m]; 0: labels cost nothing."""
    units: np.ndarray
    """Cost of a point by its label, (4,); 0: as out of the frame."""
    unseen: np.ndarray
    """Cost of a point out of the frame by the region that it is on, (n,)."""
    behind: float
    """A point so much further away than what was measured is out of the frame [m]; inf: it has the label in front of it."""
    labels: np.ndarray
    """Steppability, uint8 (height, width); without a pixel all points are out of the frame."""
    depth: np.ndarray
    """[m], float32 (height, width)."""
    X_CW: np.ndarray
    """The world in the optical frame, (4, 4)."""
    camera: np.ndarray
    """fx, fy, cx, cy [pixels], (4,)."""


def foothold_labels(config: FootholdConfig, regions: list, image: LabelImage | None = None) -> FootholdLabels:
    """Makes the mask of a search over ``regions``.

    Without an ``image``, or one that does not say where it was taken, the labels of the regions take its place.
    """
    units = np.array([0.0 if config.steppability_unknown == "out_of_frame" else UNITS[config.steppability_unknown]])
    units = np.append(units, [UNITS[Steppability(label).name.lower()] for label in (1, 2, 3)])
    by_region = np.array([units[region.label] or _OUT for region in regions])
    counts = config.steppability == "penalty"
    usable = counts and _is_usable(image)
    unseen = by_region if not usable or config.steppability_unseen == "region" else np.full(len(regions), _OUT)
    nothing = np.zeros((0, 0), np.float32)
    hides = usable and config.steppability_occluded == "out_of_frame" and image.depth is not None
    k = image.intrinsics if usable else None
    return FootholdLabels(
        weight=float(config.steppability_weight) if counts else 0.0,
        units=_kept(units),
        unseen=_kept(unseen),
        behind=_BEHIND if hides and image.depth.shape == image.labels.shape else np.inf,
        labels=_kept(image.labels if usable else nothing, np.uint8),
        depth=_kept(image.depth if hides else nothing, np.float32),
        X_CW=_kept(np.linalg.inv(image.X_WC) if usable else np.eye(4)),
        camera=_kept(np.array([k.fx, k.fy, k.cx, k.cy] if usable else [1.0, 1.0, 0.0, 0.0])),
    )


def _is_usable(image: LabelImage | None) -> bool:
    """Whether an image has pixels and is known to have been taken somewhere."""
    if image is None or not image.labels.size or image.X_WC is None or image.intrinsics is None:
        return False
    return bool(np.isfinite(image.X_WC).all())


def _kept(array, dtype=np.float64) -> np.ndarray:
    """``array`` as the kernels take it, and nobody writes to it: for other arrays they would be compiled again."""
    view = np.ascontiguousarray(array, dtype).view()
    view.flags.writeable = False
    return view


@njit(cache=True)
def _units_at(x, y, z, region, mask):
    """Returns what a point of the ground in W costs."""
    X, camera = mask.X_CW, mask.camera
    depth = X[2, 0] * x + X[2, 1] * y + X[2, 2] * z + X[2, 3]
    if depth > _NEAR:
        rows, columns = mask.labels.shape
        u = camera[0] * (X[0, 0] * x + X[0, 1] * y + X[0, 2] * z + X[0, 3]) / depth + camera[2] + 0.5
        v = camera[1] * (X[1, 0] * x + X[1, 1] * y + X[1, 2] * z + X[1, 3]) / depth + camera[3] + 0.5
        if 0.0 <= u < columns and 0.0 <= v < rows:
            i, j = int(v), int(u)
            hidden = False
            if mask.behind < np.inf:
                hidden = mask.depth[i, j] > 0.0 and depth > mask.depth[i, j] + mask.behind
            label = mask.labels[i, j]
            if not hidden and label < len(mask.units) and mask.units[label] > 0.0:
                return mask.units[label]
    return mask.unseen[region]


@njit(cache=True)
def foothold_units(points, normals, regions, k, radius, mask):
    """Returns what a foothold costs by its labels [1]: the sum of five points, those beside its centre on its plane.

    Args:
        points, normals, regions: of some footholds, (n, 3) in W [m], (n, 3), (n,) indices of regions.
        k: which of them.
        radius: of the foot [m].
    """
    x, y, z, region = points[k, 0], points[k, 1], points[k, 2], regions[k]
    slope_x, slope_y = -radius * normals[k, 0] / normals[k, 2], -radius * normals[k, 1] / normals[k, 2]
    total = _units_at(x, y, z, region, mask)
    total += _units_at(x + radius, y, z + slope_x, region, mask)
    total += _units_at(x - radius, y, z - slope_x, region, mask)
    total += _units_at(x, y + radius, z + slope_y, region, mask)
    return total + _units_at(x, y - radius, z - slope_y, region, mask)


@njit(cache=True)
def label_cost(units, mask):
    """Returns the cost of a stance by the ``units`` of its four feet together [m]."""
    return mask.weight * (units - _LEAST)


def cost_beyond_unseen(costs, weight: float):
    """How much more than stances on unseen ground these stances cost by their labels [m]: that of ground known to be bad."""
    return np.maximum(costs - weight * (_UNSEEN - _LEAST), 0.0)
