"""How long each stage of perception takes on one 640x480 image, and the superpixels beside scikit-image's SLIC.

Not part of the tests; run with

    OPENBLAS_NUM_THREADS=1 pytest tests/benchmarks/bench_perception.py --benchmark-columns=min,median,rounds

The comparison needs scikit-image (pip install scikit-image), which is what a user would pick instead.
"""

import numpy as np
import pytest

from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.egocan import draw_egocan, update_memory
from quadpips_drake.perception.region_extraction import extract_regions
from quadpips_drake.perception.superpixels import healthy_pixels, segment_superpixels
from tests.perception.scenes import (
    FOOT_RADIUS,
    INTRINSICS,
    affordance,
    camera_mount,
    look,
    stepping_stones,
    walking_poses,
)

CONFIG = PerceptionConfig()


@pytest.fixture(scope="module")
def moment():
    """A robot that has walked 0.6 m towards stepping stones: memory, its newest depth image and the camera's pose."""
    scene, poses = stepping_stones(rows=7, columns=7), list(walking_poses(0.6, speed=0.4, rate=8.0))
    memory = look(scene, poses, CONFIG, INTRINSICS)
    X_WC = poses[-1][1] @ camera_mount()
    return memory, scene.depth(X_WC, INTRINSICS), X_WC


def perceive(memory, depth, X_WC):
    """From the depth image to the regions."""
    image = affordance(depth, X_WC, memory.stamp + 1.0 / 30.0, CONFIG, INTRINSICS)
    can = draw_egocan(update_memory(memory, image, 0.0, CONFIG.egocan), CONFIG.egocan)
    return extract_regions(segment_superpixels(can, CONFIG.superpixels), FOOT_RADIUS, CONFIG.regions)


def test_depth_image_to_regions(benchmark, moment):
    benchmark.group = "all"
    assert len(benchmark(perceive, *moment).regions) > 30


def test_normals(benchmark, moment):
    benchmark.group = "stages"
    benchmark(affordance, moment[1], moment[2], 0.0, CONFIG, INTRINSICS)


def test_egocan(benchmark, moment):
    benchmark.group = "stages"
    memory, depth, X_WC = moment
    image = affordance(depth, X_WC, memory.stamp + 1.0 / 30.0, CONFIG, INTRINSICS)
    benchmark(update_memory, memory, image, 0.0, CONFIG.egocan)


def test_cap(benchmark, moment):
    benchmark.group = "stages"
    benchmark(draw_egocan, moment[0], CONFIG.egocan)


def test_superpixels(benchmark, moment):
    benchmark.group = "superpixels"
    can = draw_egocan(moment[0], CONFIG.egocan)
    assert len(benchmark(segment_superpixels, can, CONFIG.superpixels).centers) > 30


def test_slic(benchmark, moment):
    segmentation = pytest.importorskip("skimage.segmentation", reason="pip install scikit-image")
    benchmark.group = "superpixels"
    can = draw_egocan(moment[0], CONFIG.egocan)
    healthy = healthy_pixels(can, CONFIG.superpixels)
    channels = np.nan_to_num(can.cap_normals)
    benchmark.pedantic(
        segmentation.slic,
        args=(channels,),
        kwargs={"n_segments": 175, "max_num_iter": 5, "mask": healthy, "channel_axis": -1},
        rounds=5,
    )


def test_regions(benchmark, moment):
    benchmark.group = "stages"
    superpixels = segment_superpixels(draw_egocan(moment[0], CONFIG.egocan), CONFIG.superpixels)
    benchmark(extract_regions, superpixels, FOOT_RADIUS, CONFIG.regions)
