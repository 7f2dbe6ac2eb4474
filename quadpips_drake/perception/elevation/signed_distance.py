"""The signed distance from the ground of an elevation map: Euclidean distance transforms of both signs."""

import numpy as np
from scipy.ndimage import distance_transform_edt

from quadpips_drake.perception.elevation.elevation_config import DistanceConfig
from quadpips_drake.perception.elevation.plane_decomposition import without_holes
from quadpips_drake.values.regions import ElevationMap, SignedDistance

_ABOVE, _BELOW = 0.1, 0.1
"""How far the grid reaches over base and highest cell, and below the lowest one [m]."""


def signed_distance(elevation: ElevationMap, config: DistanceConfig) -> SignedDistance:
    """Returns the distance field around the base, right to half a cell.

    Unknown cells are as high as the lowest of their border. From 0.1 m below the lowest cell (or ``config.below`` the base)
    to 0.1 m above the highest one and the base; where no voxel is ground, or the pose is not known, it is empty.
    """
    base, cell = elevation.X_WB[:3, 3], elevation.cell
    known = np.isfinite(elevation.height)
    if not known.any() or not np.isfinite(base).all():
        return SignedDistance.empty()
    height = without_holes(elevation.height, known, cell, 0.0)[0]
    low = np.maximum(np.floor((base[:2] - config.half_extent) / cell).astype(int) - elevation.first_cell, 0)
    high = np.minimum(np.ceil((base[:2] + config.half_extent) / cell).astype(int) - elevation.first_cell, height.shape)
    if (high - low < 2).any():
        return SignedDistance.empty()
    height = height[low[0] : high[0], low[1] : high[1]]
    bottom = max(float(height.min()) - _BELOW, base[2] - config.below)
    top = max(float(height.max()), base[2]) + _ABOVE
    z = bottom + cell * np.arange(max(2, int(np.ceil((top - bottom) / cell)) + 1))
    ground = z <= height[..., None]
    if not ground.any() or ground.all():
        return SignedDistance.empty()
    # The surface lies between two voxels.
    outside = np.maximum(distance_transform_edt(~ground, sampling=cell) - 0.5 * cell, 0.0)
    inside = np.maximum(distance_transform_edt(ground, sampling=cell) - 0.5 * cell, 0.0)
    origin = np.append((elevation.first_cell + low + 0.5) * cell, bottom)
    return SignedDistance(elevation.stamp, origin, cell, (outside - inside).astype(np.float32))
