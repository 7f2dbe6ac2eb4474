"""A noise model of a depth camera."""

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged

_STAMP_RESOLUTION = 1e-6
_LARGEST = 10.0
"""What claims to be further away is no measurement but a saturated pixel, and gets no noise [m]."""


@configuration
class DepthNoiseConfig:
    """Gaussian noise whose deviation grows with the squared depth, as that of stereo cameras does, and lost pixels.

    The default is no noise, as in the benchmark's simulator, whose plugin ignores its noise tag. A RealSense D435 has
    roughly sigma 0.001, sigma_growth 0.004 and dropout 0.02.
    """

    sigma: float = ranged(0.0, 0.0, 1.0)
    """Standard deviation at zero depth [m]."""
    sigma_growth: float = ranged(0.0, 0.0, 1.0)
    """What the standard deviation grows by with the squared depth [1/m]."""
    dropout: float = ranged(0.0, 0.0, 1.0)
    """Probability that a pixel measures nothing."""

    @property
    def enabled(self) -> bool:
        return self.sigma > 0.0 or self.sigma_growth > 0.0 or self.dropout > 0.0


def add_depth_noise(depth: np.ndarray, stamp: float, seed: int, config: DepthNoiseConfig) -> np.ndarray:
    """Returns ``depth`` [m], float32 (height, width), with noise; lost pixels become NaN.

    The noise is a function of ``seed`` (not negative) and of the time ``stamp`` [s, to the microsecond] alone, so that it
    needs no memory and a repeated evaluation repeats it.
    """
    if not config.enabled:
        return depth.copy()
    frame = max(round(stamp / _STAMP_RESOLUTION), 0)
    generator = np.random.Generator(np.random.SFC64(np.random.SeedSequence([seed, frame])))
    noisy = depth.copy()
    measured = (depth > 0.0) & (depth < _LARGEST)
    if config.sigma > 0.0 or config.sigma_growth > 0.0:
        normal = generator.standard_normal(depth.shape, dtype=np.float32)
        deviation = np.float32(config.sigma) + np.float32(config.sigma_growth) * np.where(measured, depth, 0.0) ** 2
        # Infinite or zero depth means "no measurement" and must stay that.
        noisy = np.where(measured, depth + deviation * normal, depth)
    if config.dropout > 0.0:
        noisy[generator.random(depth.shape, dtype=np.float32) < config.dropout] = np.nan
    return noisy
