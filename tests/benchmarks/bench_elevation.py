"""How long an elevation map and its decomposition into regions take on one 640x480 image.

Not part of the tests; run with

    OMP_NUM_THREADS=1 pytest tests/benchmarks/bench_elevation.py

Asserted is the CPU time of one thread, which other load on the machine changes little: at most 40 ms in the median, the
25 Hz of QuadPiPS' rivals.
"""

import time
from functools import cache

import numpy as np
import pytest

from quadpips_drake.perception.elevation.elevation_config import PRESETS, ElevationConfig
from quadpips_drake.perception.elevation.elevation_mapping import DepthView, begin_map, update_map
from quadpips_drake.perception.elevation.plane_decomposition import decompose_planes
from quadpips_drake.perception.elevation.signed_distance import signed_distance
from tests.perception.scenes import FEET, FOOT_RADIUS, INTRINSICS, Scene, camera_mount, stepping_stones, walking_poses

BUDGET = 0.040
"""[s]"""
SCENES = {
    "floor": Scene([]),
    "stepping stones": stepping_stones(rows=4, columns=5),
    "stones of 15 cm": stepping_stones(size=0.15, gap=0.15, rows=6, columns=9, floor=-1.0),
}


def noisy(depth, rng):
    """A D435's noise."""
    sigma = 0.001 + 0.004 * np.where(depth < 10.0, depth, 0.0) ** 2
    depth = (depth + sigma * rng.standard_normal(depth.shape)).astype(np.float32)
    depth[rng.random(depth.shape) < 0.02] = np.nan
    return depth


@cache
def images(name):
    """(time [s], X_WB, view) of a robot that walks towards the scene."""
    rng, seen = np.random.default_rng(0), []
    for stamp, X_WB, _ in walking_poses(0.7, speed=0.4, rate=5.0):
        X_WC = X_WB @ camera_mount()
        seen.append((stamp, X_WB, DepthView(X_WC, INTRINSICS, noisy(SCENES[name].depth(X_WC, INTRINSICS), rng))))
    return seen


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("name", SCENES)
def test_map_and_planes(name, preset, capsys):
    config = ElevationConfig(preset=preset).filled()
    elevation, found, seconds = None, None, {"map": [], "planes": [], "both": [], "distance": []}
    for stamp, X_WB, view in images(name):
        start = time.thread_time()
        if elevation is None:
            elevation = begin_map(stamp, [view], X_WB, FEET, config.map)
        else:
            elevation = update_map(elevation, stamp, [view], X_WB, config.map)
        mapped = time.thread_time()
        found = decompose_planes(elevation, FOOT_RADIUS, config.planes, found)
        end = time.thread_time()
        signed_distance(elevation, config.distance)
        ways = (mapped - start, end - mapped, end - start, time.thread_time() - end)
        for way, value in zip(seconds, ways, strict=True):
            seconds[way].append(value)
    median = {way: float(np.median(values)) for way, values in seconds.items()}
    with capsys.disabled():
        text = ", ".join(f"{way} {1e3 * value:.1f} ms" for way, value in median.items())
        print(f"\n{name}, {preset}: {text}; {len(found.regions.regions)} regions")
    assert found.regions.regions and median["both"] < BUDGET
