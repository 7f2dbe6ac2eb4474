"""Borders of labels against edges of surfaces."""

import numpy as np
import pytest

from quadpips_drake.perception.steppability.label_edges import MIN_RUN, REACH, move_borders_to_edges
from quadpips_drake.values.sensing import CameraIntrinsics

SIZE = (60, 80)
CAMERA = CameraIntrinsics(SIZE[1], SIZE[0], 80.0, 80.0, 39.5, 29.5)
DOWN = np.array([0.0, 0.0, 1.0])
"""The camera looks straight down: what it sees at one depth is level."""
EDGE = 40
"""First column beyond the edge of the surface."""


def scene(beyond: float, rim: int):
    """Depth and labels of ground 1 m below, which ends at EDGE; the network sees it end ``rim`` pixels too early."""
    depth = np.ones(SIZE, np.float32)
    depth[:, EDGE:] = beyond
    labels = np.full(SIZE, 3, np.uint8)
    labels[:, : EDGE - rim] = 1
    return depth, labels


@pytest.mark.parametrize("rim", [1, REACH])
def test_a_border_moves_to_the_edge_and_not_past_it(rim):
    depth, labels = scene(1.4, rim)
    moved = move_borders_to_edges(labels, depth, DOWN, CAMERA)
    assert (moved[:, :EDGE] == 1).all() and (moved[:, EDGE:] == 3).all()


def test_a_border_moves_no_further_than_its_reach():
    depth, labels = scene(1.4, 10)
    moved = move_borders_to_edges(labels, depth, DOWN, CAMERA)
    assert (moved[0] == 1).sum() == EDGE - 10 + REACH


@pytest.mark.parametrize("height", [0.03, 0.1, 0.3])
def test_an_obstacle_or_a_pit_beside_the_ground_keeps_its_label(height):
    for beyond in (1 - height, 1 + height):
        depth, labels = scene(beyond, 0)
        np.testing.assert_array_equal(move_borders_to_edges(labels, depth, DOWN, CAMERA), labels)


def test_a_vertical_face_keeps_its_label():
    """A level camera sees a wall below a ledge: pixel by pixel lower, and no further away."""
    depth = np.ones(SIZE, np.float32)
    labels = np.full(SIZE, 3, np.uint8)
    labels[:30] = 1
    moved = move_borders_to_edges(labels, depth, np.array([0.0, 1.0, 0.0]), CAMERA)
    np.testing.assert_array_equal(moved, labels)


def test_thin_strips_do_not_grow():
    depth, labels = np.ones(SIZE, np.float32), np.full(SIZE, 3, np.uint8)
    labels[:, 30 : 30 + MIN_RUN - 1] = 1
    # Along its columns the strip is as long as the image; across it is too thin to grow.
    np.testing.assert_array_equal(move_borders_to_edges(labels, depth, DOWN, CAMERA), labels)


def test_what_is_steppable_or_unknown_stays_so():
    depth, labels = scene(1.0, 2)
    depth[:, 20:22], labels[:, 20:22] = np.nan, 0
    moved = move_borders_to_edges(labels, depth, DOWN, CAMERA)
    assert (moved[labels == 1] == 1).all() and (moved[labels == 0] == 0).all()
    empty = np.zeros((0, 0), np.uint8)
    assert move_borders_to_edges(empty, np.zeros((0, 0), np.float32), DOWN, CAMERA).shape == (0, 0)


def reference(labels, depth, down, camera):
    """The rule, pixel by pixel: looks from each pixel for the next steppable one in four directions."""
    result = np.array(labels)
    point = np.stack(np.meshgrid(np.arange(labels.shape[1]) - camera.cx, np.arange(labels.shape[0]) - camera.cy), axis=-1)
    point = np.concatenate([point / [camera.fx, camera.fy], np.ones((*labels.shape, 1))], axis=-1) * depth[..., None]
    for v, u in np.argwhere(labels > 1):
        for dv, du in ((-1, 0), (1, 0), (0, -1), (0, 1)):
            line = labels[v::dv, u] if dv else labels[v, u::du]
            steps = np.nonzero(line[1 : REACH + 1] == 1)[0]
            if not len(steps):
                continue
            step = steps[0] + 1
            offset = point[v, u] - point[v + step * dv, u + step * du]
            fall = offset @ down
            run = np.sqrt(max(offset @ offset - fall**2, 0.0))
            if (line[step : step + MIN_RUN] == 1).all() and abs(fall) <= min(0.02, 0.5 * run):
                result[v, u] = 1
    return result


@pytest.mark.parametrize("block", [1, 3, 12])
def test_borders_move_as_the_rule_says(block):
    rng = np.random.default_rng(block)
    coarse = rng.choice(4, size=(-(-SIZE[0] // block), -(-SIZE[1] // block)), p=[0.1, 0.6, 0.1, 0.2])
    labels = np.kron(coarse, np.ones((block, block)))[: SIZE[0], : SIZE[1]].astype(np.uint8)
    depth = (1.0 + 0.01 * rng.standard_normal(SIZE)).astype(np.float32)
    depth[labels == 0] = np.nan
    moved = move_borders_to_edges(labels, depth, DOWN, CAMERA)
    np.testing.assert_array_equal(moved, reference(labels, depth, DOWN, CAMERA))
    assert (moved != labels).any() or block == 1
