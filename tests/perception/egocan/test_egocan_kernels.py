"""The kernels of the egocan against readable versions, place by place."""

import dataclasses
from itertools import product

import numpy as np
import pytest

from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.egocan import egocan_kernels, ground_kernels
from quadpips_drake.perception.egocan import view_kernels as views
from quadpips_drake.perception.egocan.egocan import draw_egocan, egocan_frame
from quadpips_drake.perception.egocan.ground_memory import GroundMemory, scroll_to
from quadpips_drake.values.images import AffordanceImage
from tests.perception.egocan import egocan_reference as reference
from tests.perception.scenes import SMALL, Scene, base_pose, camera_mount, look, rotation, stepping_stones, walking_poses

CONFIG = PerceptionConfig()


def rough_image(seed, shape=(SMALL.height, SMALL.width)):
    """Depths of 0.3 to 2 m, with pixels that are lost, zero, and out of range."""
    rng = np.random.default_rng(seed)
    depth = rng.uniform(0.3, 2.0, shape).astype(np.float32)
    depth[rng.random(shape) < 0.2] = rng.choice([np.nan, np.inf, 0.0])
    return depth


@pytest.mark.parametrize("columns", [256, 37])
def test_points_go_to_the_pixel_of_the_cylinder_in_whose_direction_they_lie(columns):
    """So exactly, although most arc tangents are spared."""
    config = dataclasses.replace(CONFIG.egocan, cylinder_width=columns, cylinder_height=40, cylinder_stride=1, v_fov=1.2)
    rng = np.random.default_rng(columns)
    X_WC = np.eye(4)
    X_WC[:3, :3], X_WC[:3, 3] = rotation(0.3, -0.5, 2.0) @ camera_mount()[:3, :3], [0.3, -0.2, 0.6]
    labels = rng.integers(0, 4, (SMALL.height, SMALL.width)).astype(np.uint8)
    normals = rng.standard_normal((*labels.shape, 3)).astype(np.float32)
    image = AffordanceImage(0.0, X_WC, SMALL, rough_image(columns), normals, labels)
    X_WE = egocan_frame(np.array([0.25, -0.1, 0.55]), -1.2)  # behind it: the last column and the first meet there
    points, found = np.full((40, columns, 3), np.nan, np.float32), np.zeros((40, columns), np.uint8)
    canvas = (X_WE, config.v_fov, np.full((40, columns), np.inf, np.float32), points, points.copy(), found)
    camera = views.pack_camera(X_WC, SMALL)
    egocan_kernels.add_to_cylinder(image.depth, image.normals, image.labels, camera, 1, *canvas)
    expected, expected_labels = reference.cylinder_of(image, X_WE, config)
    known = np.isfinite(expected[..., 0])
    assert known.sum() > 150 and known[:, 0].any() and known[:, -1].any()
    np.testing.assert_array_equal(points, expected)
    np.testing.assert_array_equal(found, expected_labels)


def test_a_row_of_places_is_located_as_each_place_by_itself():
    depth, rng = rough_image(3), np.random.default_rng(4)
    camera = views.pack_camera(base_pose(yaw=0.4) @ camera_mount(), SMALL)
    pixel, distance = np.empty(300, np.int32), np.empty(300)
    seen = {views.HIDDEN: 0, views.EXPOSED: 0, views.THROUGH: 0}
    for x in np.arange(-0.5, 2.0, 0.05):
        heights = rng.uniform(-0.4, 0.8, 300).astype(np.float32)
        heights[rng.random(300) < 0.2] = np.nan
        views.locate_row(x, -150.0, 0.01, heights, camera, *depth.shape, pixel, distance)
        for k in range(300):
            found = ground_kernels._seen(depth.ravel(), pixel[k], SMALL.width, distance[k], 0.04)
            assert found == views.look_at(x, (-150.0 + k) * 0.01, heights[k], depth, camera, 0.04)
            seen[found] += 1
    assert min(seen.values()) > 30, seen


def test_measurements_are_counted_and_vote_by_the_rules():
    for new, label, votes, count, missed, same in product(
        range(4), range(4), range(6), (1, 2, 9, 19, 20), (0, 1, 10, 18), (True, False)
    ):
        cell = [np.full((1, 1), value, np.uint8) for value in (label, votes, count, missed)]
        ground_kernels._note(0, 0, np.uint8(new), same, *cell)
        expected = reference.note(new, same, label, votes, count, missed)
        assert tuple(int(array[0, 0]) for array in cell) == expected, (new, same, label, votes, count, missed)


def test_cells_average_what_they_hold_with_what_is_new():
    rng, n = np.random.default_rng(5), 37
    R = rotation(0.2, 0.5, -1.0)
    sums, z = rng.standard_normal((3, n)).astype(np.float32), rng.uniform(0.0, 1.0, n)
    old, counts = rng.standard_normal((4, n)), rng.integers(0, 4, n)
    old[:, counts == 0] = np.nan  # unknown before
    shares, new_z, now = np.where(counts > 0, 1.0 / (counts + 1.0), 1.0), z.copy(), old.copy()
    ground_kernels._average(n - 1, R, sums, now, new_z, shares)
    for k in range(n - 1):
        height, normal = reference.average(z[k], R @ sums[:, k], old[0, k], old[1:, k], counts[k])
        assert new_z[k] == pytest.approx(height, abs=1e-12)
        np.testing.assert_allclose(now[1:, k], normal, atol=1e-12)
    assert new_z[-1] == z[-1], "beyond the size"


@pytest.mark.parametrize("shift", [(0, 0), (3, -2), (-4, 0), (0, 5), (19, 1), (20, 0), (-30, 7)])
def test_the_window_scrolls_cell_by_cell(shift):
    config = dataclasses.replace(CONFIG.egocan.ground, half_extent=0.1)
    rng, n = np.random.default_rng(6), config.cells
    memory = dataclasses.replace(
        GroundMemory.empty(config),
        height=rng.random((n, n)).astype(np.float32),
        count=rng.integers(1, 20, (n, n)).astype(np.uint8),
    )
    center = (memory.first_cell + n // 2 + np.array(shift) + 0.5) * config.cell
    moved = scroll_to(memory, np.array([*center, 0.5]), config)
    np.testing.assert_array_equal(moved.first_cell, memory.first_cell + shift)
    for name, nothing in (("height", np.nan), ("count", 0)):
        expected = np.full((n, n), nothing, getattr(memory, name).dtype)
        for i, j in product(range(n), range(n)):
            if 0 <= i + shift[0] < n and 0 <= j + shift[1] < n:
                expected[i, j] = getattr(memory, name)[i + shift[0], j + shift[1]]
        np.testing.assert_array_equal(getattr(moved, name), expected)


def test_the_cap_shows_trusted_cells_only():
    memory = look(stepping_stones(rows=2, columns=3), walking_poses(0.3, speed=0.6, rate=20.0), CONFIG)
    rng = np.random.default_rng(7)
    missed = np.where(rng.random(memory.ground.missed.shape) < 0.5, 15, 0).astype(np.uint8)
    memory = dataclasses.replace(memory, ground=dataclasses.replace(memory.ground, missed=missed))
    forgotten = dataclasses.replace(
        memory.ground, height=memory.ground.trusted_height(CONFIG.egocan.ground), missed=0 * missed
    )
    can = draw_egocan(memory, CONFIG.egocan)
    expected = draw_egocan(dataclasses.replace(memory, ground=forgotten), CONFIG.egocan)
    assert 0.1 < np.isfinite(can.cap_height).mean() < 0.6
    for name in ("cap_height", "cap_normals", "cap_labels"):
        np.testing.assert_array_equal(getattr(can, name), getattr(expected, name))


def test_each_pixel_of_the_cap_shows_its_cell():
    memory = look(Scene([[0.9, 1.2, -0.3, 0.3, -0.1, 0.1]]), walking_poses(0.2, speed=0.4, rate=10.0), CONFIG)
    can, ground, cell = draw_egocan(memory, CONFIG.egocan), memory.ground, CONFIG.egocan.ground.cell
    trusted, size, X_WE = ground.trusted_height(CONFIG.egocan.ground), CONFIG.egocan.cap_size, can.X_WE
    known = 0
    for v, u in np.random.default_rng(8).integers(0, size, (3000, 2)):
        x, z = (u - size // 2) * can.cap_pixel, (v - size // 2) * can.cap_pixel
        p = X_WE[:2, 3] + X_WE[:2, 0] * x + X_WE[:2, 2] * z
        i, j = np.floor(p / cell).astype(int) - ground.first_cell
        inside = 0 <= i < len(trusted) and 0 <= j < len(trusted)
        normal = ground.normal[i, j] if inside else np.full(3, np.nan)
        y = X_WE[2, 3] - trusted[i, j] if inside else np.nan
        if normal[2] > 0.5:
            y += normal[:2] @ (p - (np.floor(p / cell) + 0.5) * cell) / normal[2]
        if not y > 0.02 or np.hypot(x, z) > 0.5 * size / can.cap_focal * y:
            assert np.isnan(can.cap_height[v, u]) and np.isnan(can.cap_normals[v, u]).all()
            continue
        known += 1
        assert can.cap_height[v, u] == pytest.approx(y, abs=1e-6)
        np.testing.assert_allclose(can.cap_normals[v, u], X_WE[:3, :3].T @ normal, atol=1e-6)
        assert can.cap_labels[v, u] == ground.label[i, j]
    assert known > 300
