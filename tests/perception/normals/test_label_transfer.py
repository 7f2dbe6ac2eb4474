"""Labels that follow their points into later images."""

import numpy as np
import pytest

from quadpips_drake.perception.normals.label_transfer import transfer_labels
from quadpips_drake.terrain.terrain import pose
from quadpips_drake.values.images import LabelImage
from quadpips_drake.values.steppability import Steppability
from tests.perception.scenes import SMALL, Scene

LOOKING_DOWN = np.diag([1.0, -1.0, -1.0, 1.0])
"""An optical frame that looks straight down."""
BOX = [0.1, 0.3, -0.1, 0.1, 0.0, 0.2]


def camera(x: float, y: float = 0.0, yaw: float = 0.0) -> np.ndarray:
    return pose((x, y, 1.0), (0, 0, yaw)) @ LOOKING_DOWN


def view(X_WC):
    """Depth, and the true labels: the box is NON_PASSABLE, the floor STEPPABLE."""
    depth = Scene([BOX]).depth(X_WC, SMALL).astype(np.float32)
    labels = np.where(depth < 0.9, Steppability.NON_PASSABLE, Steppability.STEPPABLE)
    return depth, labels.astype(np.uint8)


def labelled(X_WC) -> LabelImage:
    depth, labels = view(X_WC)
    return LabelImage(1.0, labels, depth, X_WC)


@pytest.mark.parametrize("X_WC", [camera(0.0), camera(0.06), camera(-0.04, 0.05, 0.1)])
def test_labels_follow_their_points_when_the_camera_moves(X_WC):
    depth, truth = view(X_WC)
    labels = transfer_labels(depth, X_WC, SMALL, labelled(camera(0.0)))
    known = labels != Steppability.UNKNOWN
    assert known.mean() > 0.8
    # Where floor and box meet in the image, a pixel may round to its neighbour.
    assert (labels == truth)[known].mean() > 0.995


def test_points_that_were_not_in_the_older_image_stay_unknown():
    depth, _ = view(camera(5.0))
    assert not transfer_labels(depth, camera(5.0), SMALL, labelled(camera(0.0))).any()


def test_a_surface_that_was_hidden_gets_no_label_of_what_hid_it():
    before, after = labelled(camera(0.0)), view(camera(0.0))[0]
    after[after < 0.9] = 1.0  # the box has gone
    labels = transfer_labels(after, camera(0.0), SMALL, before)
    assert not labels[before.labels == Steppability.NON_PASSABLE].any()


def test_labels_without_depth_are_taken_pixel_by_pixel():
    depth, truth = view(camera(0.0))
    np.testing.assert_array_equal(transfer_labels(depth, camera(0.3), SMALL, LabelImage(0.0, truth)), truth)


@pytest.mark.parametrize(
    "older",
    [
        LabelImage.empty(),
        LabelImage(0.0, np.ones((3, 4), np.uint8), np.ones((3, 4), np.float32), np.eye(4)),
        LabelImage(0.0, np.ones((120, 160), np.uint8), np.ones((3, 4), np.float32), np.eye(4)),
        LabelImage(0.0, np.ones((120, 160), np.uint8), np.ones((120, 160), np.float32), np.full((4, 4), np.nan)),
        LabelImage(0.0, np.ones((120, 160), np.uint8), np.full((120, 160), np.nan, np.float32), camera(0.0)),
    ],
)
def test_images_that_do_not_fit_give_no_labels(older):
    depth, _ = view(camera(0.0))
    assert not transfer_labels(depth, camera(0.0), SMALL, older).any()


def test_points_without_a_measurement_get_no_label():
    depth = np.full((120, 160), np.nan, np.float32)
    depth[0, :3] = (np.inf, 0.0, -1.0)
    assert not transfer_labels(depth, camera(0.0), SMALL, labelled(camera(0.0))).any()


def test_agrees_with_a_look_at_each_point_of_a_noisy_image():
    """Points within a rounding error of the border between two older pixels may get the other one's label."""
    rng = np.random.default_rng(3)
    spoil = lambda depth: (depth + 0.01 * rng.standard_normal(depth.shape)).astype(np.float32)  # noqa: E731
    X_old, X_new = camera(0.0), camera(0.05, -0.02, 0.2)
    old, new = spoil(view(X_old)[0]), spoil(view(X_new)[0])
    new[rng.random(new.shape) < 0.1] = rng.choice([np.nan, np.inf, 0.0])
    old_labels = rng.integers(0, 4, old.shape).astype(np.uint8)
    X_LC, k = np.linalg.inv(X_old) @ X_new, SMALL
    v, u = np.mgrid[: k.height, : k.width]
    p_L = np.stack([(u - k.cx) / k.fx * new, (v - k.cy) / k.fy * new, new], axis=-1) @ X_LC[:3, :3].T + X_LC[:3, 3]
    with np.errstate(all="ignore"):
        column, row = p_L[..., 0] / p_L[..., 2] * k.fx + k.cx + 0.5, p_L[..., 1] / p_L[..., 2] * k.fy + k.cy + 0.5
        inside = (new > 0) & np.isfinite(new) & (column >= 0) & (column < k.width) & (row >= 0) & (row < k.height)
        i, j = np.where(inside, row, 0).astype(int), np.where(inside, column, 0).astype(int)
        same = inside & (np.abs(old[i, j] - p_L[..., 2]) <= 0.02 + 0.03 * p_L[..., 2])
    expected = np.where(same, old_labels[i, j], Steppability.UNKNOWN)
    labels = transfer_labels(new, X_new, SMALL, LabelImage(1.0, old_labels, old, X_old))
    assert 0.5 < same.mean() < 0.95
    assert (labels == expected).mean() > 0.999
