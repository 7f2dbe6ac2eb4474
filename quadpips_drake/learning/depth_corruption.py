"""Makes rendered depth images look measured: the domain alignment of QuadPiPS section V-B.6."""

from dataclasses import field

import cv2
import numpy as np
from numba import njit

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.sensing.depth_noise import DepthNoiseConfig, add_depth_noise

BINS = 12
"""Grey levels of the oil-paint filter."""


@configuration
class CorruptionConfig:
    """Strengths are drawn anew for every image, uniformly up to the values here."""

    boundary_width: int = ranged(3, 0, 20)
    """Most dilations by a 3 x 3 square of the boundaries of objects [pixels]."""
    boundary_jump: float = ranged(0.03, 1e-4, 10.0)
    """Relative difference of neighbouring depths that counts as a boundary, besides changes of the label."""
    boundary_noise: float = ranged(0.012, 0.0, 1.0)
    """Largest standard deviation of the noise at boundaries, relative to the depth."""
    oil_radius: int = ranged(2, 0, 8)
    """Half width of the window of the oil-paint filter [pixels]."""
    boundary_voids: float = ranged(0.25, 0.0, 1.0)
    """Largest share of the boundary pixels that is lost, in connected groups."""
    surface_voids: float = ranged(0.04, 0.0, 1.0)
    """Largest share of all pixels that is lost, in connected groups."""
    blots: float = ranged(0.3, 0.0, 1.0)
    """Probability of one or two large holes, like those that the self-filter leaves where legs are."""
    noise: DepthNoiseConfig = field(default_factory=lambda: DepthNoiseConfig(0.001, 0.004, 0.02))
    """Largest noise of the whole image; half of the images have none."""


def corrupt_depth(
    depth: np.ndarray, labels: np.ndarray, rng: np.random.Generator, config: CorruptionConfig | None = None
) -> np.ndarray:
    """Returns ``depth`` [m] as a sensor might have measured it, float32 (height, width), NaN where it measures nothing.

    In order: noise of the whole image; Gaussian noise and an oil-paint filter at dilated boundaries of objects; connected
    holes on boundaries and on surfaces; large holes. ``labels`` (height, width), the truth, only helps to find boundaries.
    """
    config = config or CorruptionConfig()
    noisy = _sensor_noise(depth, rng, config.noise)
    border = object_boundaries(depth, labels, config.boundary_jump, int(rng.integers(1, config.boundary_width + 1)))
    deviation = rng.uniform(0, config.boundary_noise)
    rows, columns = np.nonzero(border & np.isfinite(noisy))
    noisy[rows, columns] *= 1 + deviation * rng.standard_normal(len(rows)).astype(np.float32)
    if config.oil_radius > 0:
        noisy[rows, columns] = oil_paint(noisy, rows, columns, int(rng.integers(1, config.oil_radius + 1)), BINS)
    noisy[border & _blobs(depth.shape, rng, rng.uniform(0, config.boundary_voids))] = np.nan
    noisy[_blobs(depth.shape, rng, rng.uniform(0, config.surface_voids))] = np.nan
    if rng.random() < config.blots:
        for _ in range(rng.integers(1, 3)):
            noisy[_blot(depth.shape, rng)] = np.nan
    return noisy


def object_boundaries(depth: np.ndarray, labels: np.ndarray, jump: float, width: int) -> np.ndarray:
    """Returns where labels change or depths jump by more than ``jump`` times the depth, dilated ``width`` times; bool."""
    filled = np.where(np.isfinite(depth), depth, 1e3).astype(np.float32)
    kernel = np.ones((3, 3), np.uint8)
    largest, smallest = cv2.dilate(filled, kernel), cv2.erode(filled, kernel)
    edge = largest - smallest > jump * smallest
    edge |= cv2.dilate(labels, kernel) != cv2.erode(labels, kernel)
    return cv2.dilate(edge.astype(np.uint8), kernel, iterations=max(width - 1, 0)).astype(bool)


@njit(cache=True)
def oil_paint(depth, rows, columns, radius, bins):
    """Returns, for each pixel, the mean of the most frequent of ``bins`` depth levels in the window around it."""
    height, width = depth.shape
    result = np.empty(len(rows), np.float32)
    for i in range(len(rows)):
        r0, r1 = max(rows[i] - radius, 0), min(rows[i] + radius + 1, height)
        c0, c1 = max(columns[i] - radius, 0), min(columns[i] + radius + 1, width)
        low, high = np.inf, -np.inf
        for r in range(r0, r1):
            for c in range(c0, c1):
                if np.isfinite(depth[r, c]):
                    low, high = min(low, depth[r, c]), max(high, depth[r, c])
        counts = np.zeros(bins, np.int64)
        sums = np.zeros(bins)
        scale = bins / max(high - low, 1e-6)
        for r in range(r0, r1):
            for c in range(c0, c1):
                if np.isfinite(depth[r, c]):
                    k = min(int((depth[r, c] - low) * scale), bins - 1)
                    counts[k] += 1
                    sums[k] += depth[r, c]
        best = np.argmax(counts)
        result[i] = sums[best] / counts[best] if counts[best] > 0 else np.nan
    return result


def _sensor_noise(depth: np.ndarray, rng, limits: DepthNoiseConfig) -> np.ndarray:
    if rng.random() < 0.5:
        return depth.copy()
    strength = rng.random()
    drawn = DepthNoiseConfig(limits.sigma * rng.random(), limits.sigma_growth * strength**1.5, limits.dropout * rng.random())
    return add_depth_noise(depth, 0.0, int(rng.integers(2**31)), drawn)


def _blobs(shape, rng, share: float) -> np.ndarray:
    """Random connected groups of pixels that cover about ``share`` of the image; bool. Smooth noise above a threshold."""
    cell = int(rng.integers(3, 9))
    coarse = rng.standard_normal((-(-shape[0] // cell) + 1, -(-shape[1] // cell) + 1)).astype(np.float32)
    smooth = cv2.resize(coarse, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC)
    return smooth > np.quantile(smooth[::4, ::4], 1.0 - share) if share > 0 else np.zeros(shape, bool)


def _blot(shape, rng) -> np.ndarray:
    """A large tilted ellipse; bool."""
    height, width = shape
    center = (int(rng.uniform(0, width)), int(rng.uniform(0.4 * height, height)))
    axes = (int(rng.uniform(0.03, 0.10) * width), int(rng.uniform(0.1, 0.35) * height))
    mask = np.zeros(shape, np.uint8)
    cv2.ellipse(mask, center, axes, rng.uniform(-30, 30), 0, 360, 1, -1)
    return mask.astype(bool)
