"""Superpixels from frame to frame: the warm start and the ids."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest

from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.egocan.egocan import draw_egocan
from quadpips_drake.perception.superpixels.superpixel_tracking import MAX_WANDER, propagate_clusters
from quadpips_drake.perception.superpixels.superpixels import segment_superpixels
from quadpips_drake.values.images import EgocanImage
from tests.perception.scenes import Scene, base_pose, look, stepping_stones, walking_poses

CONFIG = PerceptionConfig()


@pytest.fixture(scope="module")
def walk():
    """Cans (20 Hz) of a robot that walks 0.5 m over stepping stones."""
    scene, memory, cans = stepping_stones(rows=5, columns=3), None, []
    for pose in walking_poses(0.5, speed=0.4, rate=20.0):
        memory = look(scene, [pose], CONFIG, memory=memory)
        cans.append(draw_egocan(memory, CONFIG.egocan))
    return cans


def follow(cans, config=CONFIG.superpixels):
    images = []
    for can in cans:
        images.append(segment_superpixels(can, config, images[-1] if images else None))
    return images


def centers_in_world(image):
    return image.centers @ image.X_WE[:3, :3].T + image.X_WE[:3, 3]


def test_ids_stay_with_the_ground(walk):
    images = follow(walk)
    kept = total = 0
    wandered = {}
    for before, now in pairwise(images):
        assert len(set(now.ids)) == len(now.ids) and now.next_id > now.ids.max()
        shared = set(before.ids) & set(now.ids)
        kept, total = kept + len(shared), total + min(len(before.ids), len(now.ids))
        away = np.linalg.norm(centers_in_world(now) - now.homes, axis=1)
        wandered |= {key: max(wandered.get(key, 0.0), off) for key, off in zip(now.ids, away, strict=True)}
    assert kept / total > 0.95
    assert max(wandered.values()) <= MAX_WANDER
    assert np.median(list(wandered.values())) < 0.7 * MAX_WANDER
    assert len(images[-1].ids) > 35


def test_ids_do_not_come_back_for_other_ground(walk):
    images = follow(walk)
    given = set()
    for before, now in pairwise(images):
        given |= set(before.ids)
        new = set(now.ids) - set(before.ids)
        assert not new & given and all(key >= before.next_id for key in new)


def test_the_warm_start_is_as_good_as_a_cold_one(walk):
    warm, cold = follow(walk)[-1], segment_superpixels(walk[-1], CONFIG.superpixels)
    assert abs(len(warm.centers) - len(cold.centers)) < 0.3 * len(cold.centers)
    assert (warm.assignment >= 0).sum() > 0.99 * (cold.assignment >= 0).sum()
    for image in (warm, cold):
        spread = [np.ptp(image.points[image.assignment == c], axis=0).max() for c in range(len(image.centers))]
        assert np.median(spread) < 0.3 and max(spread) < 0.55
        tilt = np.rad2deg(np.arccos(-image.normals[:, 1].clip(-1.0, 1.0)))
        assert np.quantile(tilt, 0.9) < 1.0 and tilt.max() < 15.0


def test_clusters_move_with_the_base():
    """A superpixel stays where it is in the world, while the can moves and turns."""
    before = segment_superpixels(
        draw_egocan(look(Scene([]), [(0.0, base_pose(), 0.0)], CONFIG), CONFIG.egocan), CONFIG.superpixels
    )
    can = draw_egocan(look(Scene([]), [(0.05, base_pose(x=0.1, y=0.03, yaw=0.2), 0.2)], CONFIG), CONFIG.egocan)
    moved = propagate_clusters(before, can)
    p_W = moved[:, 2:5] @ can.X_WE[:3, :3].T + can.X_WE[:3, 3]
    np.testing.assert_allclose(p_W, before.clusters[:, :3], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(moved[:, 5:8], axis=1), 1.0)
    pixel = can.cap_pixel
    np.testing.assert_allclose((moved[:, 0] - 128) * pixel, moved[:, 2], atol=0.51 * pixel)
    np.testing.assert_allclose((moved[:, 1] - 128) * pixel, moved[:, 4], atol=0.51 * pixel)


@pytest.mark.parametrize("trouble", ["jump", "turn", "back in time", "other size", "nan pose"])
def test_a_break_starts_afresh(walk, trouble):
    before = follow(walk[:3])[-1]
    X_WE = np.array(walk[3].X_WE)
    if trouble == "jump":
        X_WE[0, 3] += 0.7
    elif trouble == "turn":
        X_WE[:3, :3] = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]) @ X_WE[:3, :3]
    elif trouble == "nan pose":
        X_WE[0, 3] = np.nan
    can = dataclasses.replace(walk[3], X_WE=X_WE)
    if trouble == "back in time":
        can = dataclasses.replace(walk[3], stamp=before.stamp - 0.1)
    if trouble == "other size":
        can = dataclasses.replace(can, **{n: getattr(can, n)[:200] for n in ("cap_height", "cap_normals", "cap_labels")})
    now = segment_superpixels(can, CONFIG.superpixels, before)
    if trouble == "nan pose":
        assert len(now.centers) == 0
    else:
        np.testing.assert_array_equal(now.assignment, segment_superpixels(can, CONFIG.superpixels).assignment)
        assert len(now.ids) and now.ids.min() >= before.next_id
    assert now.next_id >= before.next_id


def test_ids_are_not_given_again_after_an_empty_can(walk):
    before = follow(walk[:2])[-1]
    gone = segment_superpixels(EgocanImage.empty(), CONFIG.superpixels, before)
    again = segment_superpixels(walk[2], CONFIG.superpixels, gone)
    assert len(gone.ids) == 0 and again.ids.min() >= before.next_id
