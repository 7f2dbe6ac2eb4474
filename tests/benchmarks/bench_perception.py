"""How long each stage of perception takes on one 640x480 image, and the superpixels beside scikit-image's SLIC.

Not part of the tests; run with

    OPENBLAS_NUM_THREADS=1 pytest tests/benchmarks/bench_perception.py --benchmark-columns=min,median,rounds

The comparison is with scikit-image, which is what a user would pick instead.
"""

import dataclasses
import time
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
import torch
from skimage.segmentation import slic

from quadpips_drake.learning.model_files import as_runnable, load_network
from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.egocan.egocan import draw_egocan, update_memory
from quadpips_drake.perception.regions.region_extraction import extract_regions
from quadpips_drake.perception.steppability.features import make_features, scaled_intrinsics
from quadpips_drake.perception.steppability.label_edges import move_borders_to_edges
from quadpips_drake.perception.steppability.model import SteppabilityModel, load_model
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
    assert benchmark(update_memory, memory, [image], 0.0, CONFIG.egocan).stamp == image.stamp


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
    first, second = frames(moment)
    previous = segment_superpixels(first, CONFIG.superpixels)
    runs = {
        "SLIC of scikit-image": slic_of(first),
        "from a grid of seeds": lambda: segment_superpixels(first, CONFIG.superpixels),
        "from the last frame": lambda: segment_superpixels(second, CONFIG.superpixels, previous),
    }
    median = {name: 1000 * value for name, value in thread_times(runs, rounds=15).items()}
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


def test_steppability(moment, capsys):
    """The stage from depth to labels and its parts, beside the same network in PyTorch; turn by turn, as above."""
    _, depth, X_WC = moment
    model, down = load_model(), -X_WC[2, :3]
    with resources.as_file(resources.files("quadpips_drake.perception.steppability") / "weights") as weights:
        torch_model = SteppabilityModel(as_runnable(load_network(Path(weights))[0]))
    torch.set_num_threads(1)
    features = make_features(depth[::2, ::2], down, scaled_intrinsics(INTRINSICS, 2))
    labels = model.segment(depth, down, INTRINSICS)
    runs = {
        "depth to labels, in PyTorch": lambda: torch_model.segment(depth, down, INTRINSICS),
        "depth to labels": lambda: model.segment(depth, down, INTRINSICS),
        "  of it features": lambda: make_features(depth[::2, ::2], down, scaled_intrinsics(INTRINSICS, 2)),
        "  of it the network": lambda: model.network(features),
        "borders": lambda: move_borders_to_edges(labels, depth, down, INTRINSICS),
    }
    median = {name: 1000 * value for name, value in thread_times(runs, rounds=25).items()}
    with capsys.disabled():
        print("\nsteppability, 640x480, CPU time of one thread (median of 25)")
        for name, value in median.items():
            print(f"  {name:28} {value:7.2f} ms")
    assert median["depth to labels"] < 0.5 * median["depth to labels, in PyTorch"]


def thread_times(runs: dict, rounds: int) -> dict:
    """Median CPU time [s] of one thread for each of ``runs``, turn by turn, so that other load matters little."""
    seconds = {name: [] for name in runs}
    for _ in range(rounds):
        for name, run in runs.items():
            start = time.thread_time()
            run()
            seconds[name].append(time.thread_time() - start)
    return {name: float(np.median(values)) for name, values in seconds.items()}
