import dataclasses

import numpy as np
import pytest
from scipy.spatial import cKDTree

from quadpips_drake.errors import UserInputError
from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.egocan.egocan import EgocanConfig, begin_memory, draw_egocan, egocan_frame, update_memory
from quadpips_drake.perception.superpixels.superpixels import cap_points
from quadpips_drake.values.images import AffordanceImage
from tests.perception.scenes import (
    FEET,
    INTRINSICS,
    MEDIUM,
    Scene,
    affordance,
    base_pose,
    camera_mount,
    look,
    stepping_stones,
    walking_poses,
)

CONFIG = PerceptionConfig()


def known_points(can):
    """Points of the cap with an upright normal in W, (n, 3)."""
    points = cap_points(can)[-can.cap_normals[..., 1] > 0.95]
    return points @ can.X_WE[:3, :3].T + can.X_WE[:3, 3]


def height_at(memory, x, y):
    """Remembered height at (x, y) of W."""
    i, j = np.floor(np.array([x, y]) / CONFIG.egocan.ground.cell).astype(int) - memory.ground.first_cell
    return float(memory.ground.height[i, j])


def test_frame_is_gravity_aligned_with_the_yaw_of_the_base():
    X_WE = egocan_frame(np.array([1.0, 2.0, 3.0]), np.pi / 2)
    np.testing.assert_allclose(X_WE[:3, :3].T @ [0, 0, -1], [0, 1, 0], atol=1e-12)  # down
    np.testing.assert_allclose(X_WE[:3, :3].T @ [0, 1, 0], [0, 0, 1], atol=1e-12)  # ahead
    np.testing.assert_allclose(X_WE[:3, :3].T @ [1, 0, 0], [1, 0, 0], atol=1e-12)  # right
    assert np.linalg.det(X_WE[:3, :3]) == pytest.approx(1.0)


@pytest.mark.parametrize("cap_pixel", [0.0125, 0.0])
def test_cap_shows_flat_floor_at_the_camera_height(cap_pixel):
    X_WB = base_pose(x=0.3, y=-0.2, yaw=0.7)
    config = dataclasses.replace(CONFIG.egocan, cap_pixel=cap_pixel)
    can = draw_egocan(look(Scene([]), [(0.0, X_WB, 0.7)], CONFIG, INTRINSICS), config)
    height = (X_WB @ camera_mount())[2, 3]
    known = np.isfinite(can.cap_height)
    np.testing.assert_allclose(can.cap_height[known], height, atol=1e-4)
    np.testing.assert_allclose(can.cap_normals[known], np.tile([0, -1, 0], (known.sum(), 1)), atol=2e-3)
    # The part of the cap that the camera sees has hardly any holes (of single cells, where the camera sees coarsely).
    pixel = can.cap_rays @ [1.0, height]
    x, z = ((np.mgrid[:256, :256] - 128) * pixel)[::-1]
    ahead = (z > 0.93) & (abs(x) < 0.43) & (np.hypot(x, z) < 125 / can.cap_focal * height)
    assert ahead.sum() > 1000 and known[ahead].mean() > 0.995
    assert not known[np.hypot(x, z) > 129 / can.cap_focal * height].any()


def test_a_cap_drawn_straight_down_hides_no_ground_below_edges():
    """Behind a robot on stairs, rays from the camera are blocked by the edges of the upper treads."""
    stairs = Scene([[0.2 * k - 1.0, 3.0, -2, 2, -1.0, 0.05 * k - 0.5] for k in range(12)], floor=None)
    memory = look(stairs, [(0.1 * k, base_pose(x=0.1 * k - 1.4, height=0.025 * k + 0.1), 0.0) for k in range(16)], CONFIG)
    shares = {}
    for cap_pixel in (0.0125, 0.0):
        can = draw_egocan(memory, dataclasses.replace(CONFIG.egocan, cap_pixel=cap_pixel))
        points = cap_points(can)[can.cap_normals[..., 1] < -0.95]
        p_W = points @ can.X_WE[:3, :3].T + can.X_WE[:3, 3]
        tread = p_W[np.abs(p_W[:, 2] + 0.4) < 0.005]  # the third, 1 m behind the camera
        shares[cap_pixel] = np.ptp(tread[:, 0]) / 0.2 if len(tread) else 0.0
    assert shares[0.0125] > 0.78 and shares[0.0] < shares[0.0125] - 0.1, shares


def test_cylinder_shows_a_wall_at_its_range_and_in_its_direction():
    wall = Scene([[1.5, 1.6, -3.0, 3.0, 0.0, 3.0]])
    can = draw_egocan(look(wall, [(0.0, base_pose(), 0.0)], CONFIG, INTRINSICS), CONFIG.egocan)
    middle = can.cylinder_range[:, 128]
    assert np.nanmin(middle) == pytest.approx(1.5 - 0.48, abs=2e-3)
    np.testing.assert_allclose(can.cylinder_normals[70, 128], [0, 0, -1], atol=0.02)
    assert np.isnan(can.cylinder_range[:, :40]).all()  # nothing behind


def test_memory_does_not_thin_out_and_stays_sharp_over_two_metres():
    scene = stepping_stones(rows=6, columns=3)
    poses = list(walking_poses(2.0, speed=0.4, rate=5.0))
    memory = look(scene, poses, CONFIG)
    can = draw_egocan(memory, CONFIG.egocan)
    p_W = known_points(can)
    base = poses[-1][1][:3, 3]
    # Stones that the camera has long left, below and behind the base.
    x, y = np.meshgrid(np.arange(base[0] - 0.7, base[0] + 0.4, 0.02), np.arange(-0.5, 0.5, 0.02))
    inside = scene.edge_distances(np.column_stack((x.ravel(), y.ravel()))) > 0.02
    nearest = cKDTree(p_W[:, :2]).query(np.column_stack((x.ravel(), y.ravel())))[0]
    assert np.mean(nearest[inside] < 0.012) > 0.995
    tops = np.abs(p_W[:, 2]) < 0.01
    edge = scene.edge_distances(p_W[tops])
    assert edge.min() > -0.016  # the diagonal of a cell
    np.testing.assert_allclose(p_W[tops][edge > 0, 2], 0.0, atol=2e-3)


def test_assumed_ground_fills_the_blind_spot_but_never_covers_a_pit_in_view():
    scene = stepping_stones(start=0.6, gap=0.3, floor=None)
    memory = look(scene, [(0.0, base_pose(), 0.0)], CONFIG)
    assert height_at(memory, -0.6, 0.0) == pytest.approx(0.0)
    for x in np.arange(-0.7, 0.6, 0.05):
        assert np.isfinite(height_at(memory, x, 0.1))
    assert np.isnan(height_at(memory, 0.8, 0.0))  # a pit, in view
    assert np.isnan(height_at(memory, -0.6, 0.7))  # beyond the assumption


def test_assumed_ground_is_the_plane_through_the_feet():
    X_WB = base_pose()
    feet = FEET + np.array([0.0, 0.0, 1.0]) * (0.1 * FEET[:, :1] + 0.02)
    image = affordance(Scene([]).depth(X_WB @ camera_mount(), MEDIUM), X_WB @ camera_mount(), 0.0, CONFIG, MEDIUM)
    memory = begin_memory([image], 0.0, X_WB, feet, CONFIG.egocan)
    assert height_at(memory, -0.405, 0.005) == pytest.approx(0.02 - 0.0405, abs=1e-6)


def test_what_the_camera_sees_overrules_what_it_remembers():
    box, ghost = [0.9, 1.1, -0.1, 0.1, 0.0, 0.2], (1.0, 0.0)
    memory = look(Scene([box]), [(0.0, base_pose(), 0.0)], CONFIG)
    assert height_at(memory, *ghost) == pytest.approx(0.2, abs=1e-3)
    lower = look(Scene([]), [(0.1, base_pose(), 0.0)], CONFIG, memory=memory)
    assert height_at(lower, *ghost) == pytest.approx(0.0, abs=1e-3)
    void = look(Scene([], floor=None), [(0.1, base_pose(), 0.0)], CONFIG, memory=memory)
    assert np.isnan(height_at(void, *ghost))
    blind = look(Scene([]), [(0.1, base_pose(), 0.0)], CONFIG, memory=memory, noise=lambda z: np.full_like(z, np.nan))
    assert height_at(blind, *ghost) == pytest.approx(0.2, abs=1e-3)


def test_hidden_ground_stays_unknown():
    wall = Scene([[0.9, 1.0, -0.5, 0.5, 0.0, 0.4]])
    memory = look(wall, [(0.0, base_pose(), 0.0)], CONFIG)
    assert np.isnan(height_at(memory, 1.1, 0.0))


def test_an_image_twice_a_jump_and_nonsense_are_survived():
    image_of = lambda X_WB, t: affordance(  # noqa: E731
        Scene([]).depth(X_WB @ camera_mount(), MEDIUM), X_WB @ camera_mount(), t, CONFIG, MEDIUM
    )
    memory = look(Scene([]), [(0.0, base_pose(), 0.0)], CONFIG)
    assert update_memory(memory, [image_of(base_pose(), 0.0)], 0.0, CONFIG.egocan) is memory
    assert update_memory(memory, [AffordanceImage.empty()], 0.0, CONFIG.egocan) is memory
    assert update_memory(memory, [image_of(base_pose(), 1.0)], np.nan, CONFIG.egocan) is memory
    jumped = update_memory(memory, [image_of(base_pose(y=0.8), 0.1)], 0.0, CONFIG.egocan)
    assert np.isnan(height_at(jumped, -0.3, 0.8)) and np.isnan(height_at(jumped, -0.3, 0.0))
    far = update_memory(memory, [image_of(base_pose(x=1e7), 0.1)], 0.0, CONFIG.egocan)
    assert np.isfinite(far.ground.height).any()


def test_old_memory_is_never_written_to():
    memory = look(Scene([]), [(0.0, base_pose(), 0.0)], CONFIG)
    before = memory.ground.height.copy(), memory.cylinder_points.copy()
    look(stepping_stones(), [(0.1, base_pose(x=0.03), 0.0)], CONFIG, memory=memory)
    np.testing.assert_array_equal(memory.ground.height, before[0])
    np.testing.assert_array_equal(memory.cylinder_points, before[1])
    assert not memory.ground.height.flags.writeable


@pytest.mark.parametrize("bad", [{"v_fov": 0.3}, {"cap_size": 4}, {"rate": 0.0}])
def test_bad_parameters_are_refused(bad):
    with pytest.raises(UserInputError, match=next(iter(bad))):
        EgocanConfig(**bad)
