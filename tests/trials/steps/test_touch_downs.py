"""Touch-downs where there is no ground to stand on are counted, whoever planned them."""

import numpy as np

from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.trials.steps.touch_downs import touch_down_statistics

RADIUS = 0.02


def log_of(*feet: list[tuple[float, float, float, bool]]) -> dict:
    """A log at 100 Hz: for each foot x, y, height of its sole, and whether it is down, sample by sample."""
    samples = np.array([[foot[:3] for foot in row] for row in zip(*feet, strict=True)], float)
    samples[..., 2] += RADIUS
    contacts = np.array([[foot[3] for foot in row] for row in zip(*feet, strict=True)])
    return {"time": 0.01 * np.arange(len(samples)), "foot_positions": samples, "contacts": contacts}


def step(x0: float, x1: float, low: float = 0.0, air: int = 10) -> list:
    """Down at x0, in the air, and down at x1 with the sole at ``low``."""
    return [*[(x0, 0.2, 0.0, True)] * 5, *[(x1, 0.2, 0.05, False)] * air, *[(x1, 0.2, low, True)] * (15 - air)]


def test_feet_in_gaps_are_counted():
    terrain = load_terrain("gaps_symmetric")  # gaps from 0 to 0.10 m and from 1.05 to 1.20 m
    still = [(-1.0, -0.2, 0.0, True)] * 20
    log = log_of(step(-0.3, -0.1), step(-0.3, 0.05, low=-0.07), step(-0.2, 0.3, low=-0.005), still)
    found = touch_down_statistics(log, terrain, RADIUS)
    assert found == {"touch_downs": 3, "unsafe": 1, "deepest_m": 0.07}


def test_a_bounce_is_no_step_and_level_ground_is_safe():
    terrain = load_terrain("flat")
    bounce = step(-0.3, -0.3, air=3)
    found = touch_down_statistics(log_of(bounce, bounce, bounce, step(0.0, 0.1)), terrain, RADIUS)
    assert found == {"touch_downs": 1, "unsafe": 0, "deepest_m": 0.0}
