import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.perception.normals.normals import NormalConfig, estimate_normals, measure_surface
from tests.perception.scenes import INTRINSICS, MEDIUM, SMALL, Scene, base_pose, camera_mount, stepping_stones


def angle_to(normals, direction):
    return np.rad2deg(np.arccos(np.clip(normals @ direction, -1.0, 1.0)))


@pytest.mark.parametrize("half_window", [1, 3, 6])
def test_normals_of_a_plane_are_exact_at_any_window(half_window):
    X_WC = base_pose(yaw=0.4) @ camera_mount()
    depth = Scene([]).depth(X_WC, INTRINSICS)
    normals = estimate_normals(depth, INTRINSICS, NormalConfig(half_window=half_window))
    valid = np.isfinite(normals[..., 0])
    np.testing.assert_array_equal(valid, depth <= 3.0)
    assert angle_to(normals[valid], X_WC[2, :3]).max() < 0.1


def test_agrees_with_the_equations_of_the_paper_on_a_smooth_surface():
    v, u = np.mgrid[: MEDIUM.height, : MEDIUM.width]
    z = (1.5 + 0.1 * np.sin(u / 40.0) + 0.1 * np.cos(v / 50.0)).astype(np.float32)
    z_u, z_v = np.gradient(z, axis=1), np.gradient(z, axis=0)
    a, b = (u - MEDIUM.cx) / MEDIUM.fx, (v - MEDIUM.cy) / MEDIUM.fy
    p_u = np.stack([z / MEDIUM.fx + a * z_u, b * z_u, z_u], -1)
    p_v = np.stack([a * z_v, z / MEDIUM.fy + b * z_v, z_v], -1)
    expected = np.cross(p_v, p_u)
    expected /= np.linalg.norm(expected, axis=-1, keepdims=True)
    normals = estimate_normals(z, MEDIUM, NormalConfig(half_window=1))
    inner = (slice(2, -2), slice(2, -2))
    assert angle_to((normals * expected)[inner].sum(-1)[..., None], np.ones(1)).max() < 0.5


def fit_slope(w, jump):
    """Slope of the inverse depths ``w`` (odd length) at their middle, over the unbroken run around it; None if alone."""
    middle = len(w) // 2
    first = last = middle
    joined = [w[i] > 0 and w[i + 1] > 0 and abs(1 / w[i] - 1 / w[i + 1]) <= jump for i in range(len(w) - 1)]
    while first > 0 and joined[first - 1]:
        first -= 1
    while last < len(w) - 1 and joined[last]:
        last += 1
    return np.polyfit(np.arange(first, last + 1), w[first : last + 1], 1)[0] if last > first else None


@pytest.mark.parametrize("half_window", [1, 2, 3, 5])
def test_agrees_with_a_plain_fit_at_each_pixel(half_window):
    X_WC, config = base_pose() @ camera_mount(), NormalConfig(half_window=half_window)
    rng = np.random.default_rng(2)
    depth = stepping_stones().depth(X_WC, SMALL) + rng.normal(0.0, 0.003, (SMALL.height, SMALL.width))
    depth[rng.random(depth.shape) < 0.15] = rng.choice([np.nan, np.inf, 0.0])
    normals = estimate_normals(depth, SMALL, config)
    w = np.zeros((SMALL.height + 2 * half_window, SMALL.width + 2 * half_window))
    valid = (depth >= config.min_range) & (depth <= config.max_range)
    w[half_window:-half_window, half_window:-half_window][valid] = 1.0 / np.float32(depth[valid])
    for v, u in rng.integers(0, (SMALL.height, SMALL.width), (400, 2)):
        row, column = w[v + half_window, u : u + 2 * half_window + 1], w[v : v + 2 * half_window + 1, u + half_window]
        w_u, w_v = fit_slope(row, config.depth_jump), fit_slope(column, config.depth_jump)
        if row[half_window] == 0 or w_u is None or w_v is None:
            assert np.isnan(normals[v, u]).all()
            continue
        z = row[half_window] - (u - SMALL.cx) * w_u - (v - SMALL.cy) * w_v
        expected = -np.array([SMALL.fx * w_u, SMALL.fy * w_v, z])
        np.testing.assert_allclose(normals[v, u], expected / np.linalg.norm(expected), atol=2e-5)


def test_no_gradient_is_taken_across_a_depth_jump():
    X_WC = base_pose() @ camera_mount()
    scene = Scene([[0.9, 1.4, -0.5, 0.5, 0.1, 0.3]])  # hovers, so that no side face is seen below its far edge
    depth = scene.depth(X_WC, INTRINSICS)
    normals = estimate_normals(depth, INTRINSICS, NormalConfig())
    valid = np.isfinite(normals[..., 0])
    axis_aligned = np.minimum(angle_to(normals, X_WC[2, :3]), angle_to(normals, -X_WC[0, :3]))[valid]
    assert np.mean(axis_aligned > 5.0) < 0.02  # only the crease between top and front blends


def test_a_wider_window_averages_noise():
    X_WC = base_pose() @ camera_mount()
    depth = Scene([]).depth(X_WC, INTRINSICS)
    noisy = depth + np.random.default_rng(3).normal(0.0, 0.002, depth.shape).astype(np.float32)
    median = []
    for half_window in (1, 3, 6):
        normals = estimate_normals(noisy, INTRINSICS, NormalConfig(half_window=half_window))
        valid = np.isfinite(normals[..., 0])
        median.append(np.median(angle_to(normals[valid], X_WC[2, :3])))
    assert median[0] > 2.5 * median[1] > 4.0 * median[2]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 0.0, -1.0, 50.0, 0.01])
def test_invalid_depth_gives_no_normals(value):
    depth = np.full((MEDIUM.height, MEDIUM.width), value, np.float32)
    assert np.all(np.isnan(estimate_normals(depth, MEDIUM, NormalConfig())))


def test_depth_out_of_range_is_free_space_and_all_else_that_is_invalid_unknown():
    depth = np.float32([[np.nan, np.inf, -np.inf, -1.0, 0.0, 0.05], [0.1, 0.5, 1.0, 2.9, 3.0, 3.001]])
    surface, _ = measure_surface(depth, SMALL, NormalConfig())
    nan, inf = np.nan, np.inf
    np.testing.assert_array_equal(surface, np.float32([[nan, inf, nan, nan, nan, nan], [0.1, 0.5, 1.0, 2.9, 3.0, inf]]))


def test_rows_without_a_valid_pixel_change_nothing_in_their_neighbours():
    depth = Scene([]).depth(base_pose() @ camera_mount(), SMALL)
    depth[60] = np.nan
    normals, above = estimate_normals(depth, SMALL, NormalConfig()), estimate_normals(depth[:60], SMALL, NormalConfig())
    assert np.isnan(normals[60]).all() and np.isfinite(above[59]).all()
    np.testing.assert_array_equal(normals[:60], above)


def test_single_bad_pixels_stay_single():
    depth = np.full((MEDIUM.height, MEDIUM.width), 1.0, np.float32)
    depth[100, 100] = np.nan
    normals = estimate_normals(depth, MEDIUM, NormalConfig())
    assert np.isnan(normals[..., 0]).sum() == 1
    assert normals[100, 101] @ [0, 0, -1] > 0.9999


@pytest.mark.parametrize("bad", [{"min_range": 3.0}, {"depth_jump": 0.0}, {"half_window": 0}])
def test_bad_parameters_are_refused(bad):
    with pytest.raises(UserInputError):
        NormalConfig(**bad)
