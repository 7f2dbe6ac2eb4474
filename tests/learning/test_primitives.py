"""Labels and shapes of the nine primitives."""

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.learning import primitives
from quadpips_drake.learning.primitives import SIZE_RANGES, LabelPolicy, make_shape, sample_size
from quadpips_drake.values.steppability import Steppability

POLICY = LabelPolicy()
S, P, N = Steppability.STEPPABLE, Steppability.PASSABLE, Steppability.NON_PASSABLE


def labels_by_height(patches, height):
    """Labels of what lies entirely at ``height``, and of all else."""
    at_top = {p.label for p in patches if np.allclose(p.triangles[..., 2], height)}
    return at_top, {p.label for p in patches if not np.allclose(p.triangles[..., 2], height)}


@pytest.mark.parametrize(("height", "side"), [(0.05, P), (0.15, P), (0.151, N), (0.25, N)])
def test_tops_of_cuboids_and_cylinders_are_steppable_and_their_sides_are_judged_by_height(height, side):
    for patches in (
        primitives.cuboid((0.4, 0.3, height), POLICY),
        primitives.cylinder(0.2, 0.3, height, POLICY),
    ):
        assert labels_by_height(patches, height) == ({S}, {side})


@pytest.mark.parametrize(("height", "side"), [(0.10, P), (0.20, N)])
def test_the_slope_of_a_ramp_is_steppable(height, side):
    slope, rest = primitives.ramp((0.8, 0.3, height), POLICY)
    assert slope.label == S and rest.label == side
    normals = np.cross(slope.triangles[:, 1] - slope.triangles[:, 0], slope.triangles[:, 2] - slope.triangles[:, 0])
    assert (normals[:, 2] > 0).all()


def test_each_side_of_a_cuboid_has_its_own_drop():
    labels = [p.label for p in primitives.cuboid((0.4, 0.4, 0.3), POLICY, drops=[0.1, 0.3, 0.0, 0.2])]
    assert labels[0] == S
    assert labels[2:] == [P, N, P, N]


@pytest.mark.parametrize("name", ["sphere", "semisphere", "pole", "pipe", "tube"])
def test_round_bodies_have_one_label_by_the_height_of_their_top(name):
    size = {"radius": 0.05} | ({"length": 0.12} if "length" in SIZE_RANGES[name] else {})
    on_the_ground = make_shape(name, size, POLICY)
    top = max(p.triangles[..., 2].max() for p in on_the_ground)
    assert {p.label for p in on_the_ground} == {P} and top <= 0.15
    assert {p.label for p in make_shape(name, size, POLICY, support=0.16 - top)} == {N}
    assert {p.label for p in make_shape(name, size, POLICY, support=0.149 - top)} == {P}


def test_a_floor_is_steppable_everywhere():
    (patch,) = primitives.floor(lambda x, y: 0.1 * np.sin(x) + 0 * y)
    assert patch.label == S
    assert np.isclose(np.abs(patch.triangles[..., :2]).max(), 2.0)


@pytest.mark.parametrize("name", [name for name in SIZE_RANGES if name != "floor"])
def test_sizes_stay_within_their_ranges_and_shapes_stand_on_the_ground(name):
    rng = np.random.default_rng(0)
    for _ in range(20):
        size = sample_size(name, rng)
        assert all(low <= size[key] <= high for key, (low, high) in SIZE_RANGES[name].items())
    patches = make_shape(name, size, POLICY)
    points = np.concatenate([p.triangles.reshape(-1, 3) for p in patches])
    assert points[:, 2].min() == pytest.approx(0.0, abs=1e-6)
    assert points[:, 2].max() == pytest.approx(size.get("height", points[:, 2].max()))
    assert np.isfinite(points).all()


def test_the_policy_follows_its_swing_height():
    assert LabelPolicy(0.3).obstacle(0.25) == P
    with pytest.raises(UserInputError, match="swing_height_max"):
        LabelPolicy(-0.1)
