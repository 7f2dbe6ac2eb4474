"""How long each stage of perception takes on one 640x480 image, and the superpixels beside scikit-image's SLIC.

Not part of the tests; run with

    OPENBLAS_NUM_THREADS=1 pytest tests/benchmarks/bench_perception.py --benchmark-columns=min,median,rounds

The comparison is with scikit-image, which is what a user would pick instead.
"""

import dataclasses
import time

import numpy as np
import pytest
from skimage.segmentation import slic

from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.egocan.egocan import draw_egocan, update_memory
from quadpips_drake.perception.regions.region_extraction import extract_regions
from quadpips_drake.perception.superpixels.superpixels import healthy_pixels, segment_superpixels
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
    can = draw_egocan(update_memory(memory, [image], 0.0, CONFIG.egocan), CONFIG.egocan)
    return extract_regions(segment_superpixels(can, CONFIG.superpixels), FOOT_RADIUS, CONFIG.regions)


def test_depth_image_to_regions(benchmark, moment):
    benchmark.group = "all"
    assert len(benchmark(perceive, *moment).regions) > 30


def test_normals(benchmark, moment):
    benchmark.group = "stages"
    image = benchmark(affordance, moment[1], moment[2], 0.0, CONFIG, INTRINSICS)
    assert np.isfinite(image.normals).any()


def test_egocan(benchmark, moment):
    benchmark.group = "stages"
    memory, depth, X_WC = moment
    image = affordance(depth, X_WC, memory.stamp + 1.0 / 30.0, CONFIG, INTRINSICS)
    benchmark(update_memory, memory, [image], 0.0, CONFIG.egocan)


def test_cap(benchmark, moment):
    benchmark.group = "stages"
    can = benchmark(draw_egocan, moment[0], CONFIG.egocan)
    assert len(segment_superpixels(can, CONFIG.superpixels).centers) > 30


def frames(moment):
    """Two caps, 50 ms apart."""
    memory = moment[0]
    can = draw_egocan(memory, CONFIG.egocan)
    X_WE = np.array(can.X_WE)
    X_WE[0, 3] += 0.02
    return can, draw_egocan(dataclasses.replace(memory, stamp=memory.stamp + 0.05, X_WE=X_WE), CONFIG.egocan)


def slic_of(can):
    """scikit-image's SLIC on the healthy pixels of the same floor image (its normals), as many clusters and rounds."""
    mask = healthy_pixels(can, CONFIG.superpixels)
    channels = np.nan_to_num(can.cap_normals)
    segments = CONFIG.superpixels.num_superpixels
    return lambda: slic(channels, segments, max_num_iter=CONFIG.superpixels.iterations, mask=mask, channel_axis=-1)


def test_superpixels(benchmark, moment):
    benchmark.group = "superpixels"
    can, _ = frames(moment)
    assert len(benchmark(segment_superpixels, can, CONFIG.superpixels).centers) > 30


def test_superpixels_warm(benchmark, moment):
    benchmark.group = "superpixels"
    first, second = frames(moment)
    previous = segment_superpixels(first, CONFIG.superpixels)
    assert len(benchmark(segment_superpixels, second, CONFIG.superpixels, previous).centers) > 30


def test_slic(benchmark, moment):
    benchmark.group = "superpixels"
    labels = benchmark.pedantic(slic_of(frames(moment)[0]), rounds=5, warmup_rounds=1)
    assert labels.max() > 30


def test_ratio_to_slic(moment, capsys):
    """Turn by turn, in CPU time of one thread, so that other load on the machine matters little."""
    first, second = frames(moment)
    previous = segment_superpixels(first, CONFIG.superpixels)
    runs = {
        "SLIC of scikit-image": slic_of(first),
        "from a grid of seeds": lambda: segment_superpixels(first, CONFIG.superpixels),
        "from the last frame": lambda: segment_superpixels(second, CONFIG.superpixels, previous),
    }
    seconds = {name: [] for name in runs}
    for _ in range(15):
        for name, run in runs.items():
            start = time.thread_time()
            run()
            seconds[name].append(time.thread_time() - start)
    median = {name: 1000 * np.median(values) for name, values in seconds.items()}
    reference = median["SLIC of scikit-image"]
    with capsys.disabled():
        healthy = int(healthy_pixels(first, CONFIG.superpixels).sum())
        print(f"\nsuperpixels, {healthy} of {first.cap_height.size} pixels, CPU time of one thread (median of 15)")
        for name, value in median.items():
            print(f"  {name:22} {value:7.2f} ms, {reference / value:5.1f} times as fast as SLIC")
    assert reference / max(median["from a grid of seeds"], median["from the last frame"]) > 5


def test_ids_kept(moment, capsys):
    """Share of the ids that are kept from frame to frame (20 Hz) on a walk over stepping stones."""
    scene, memory, image, kept, total = stepping_stones(rows=7, columns=7), None, None, 0, 0
    for pose in walking_poses(0.8, speed=0.4, rate=20.0):
        memory = look(scene, [pose], CONFIG, memory=memory)
        last, image = image, segment_superpixels(draw_egocan(memory, CONFIG.egocan), CONFIG.superpixels, image)
        if last is not None:
            kept, total = kept + len(np.intersect1d(last.ids, image.ids)), total + len(last.ids)
    with capsys.disabled():
        print(f"\nids kept from frame to frame: {100 * kept / total:.1f} % of {total}; {image.next_id} given in all")
    assert kept > 0.9 * total


def test_regions(benchmark, moment):
    benchmark.group = "stages"
    superpixels = segment_superpixels(draw_egocan(moment[0], CONFIG.egocan), CONFIG.superpixels)
    assert len(benchmark(extract_regions, superpixels, FOOT_RADIUS, CONFIG.regions).regions) > 30
