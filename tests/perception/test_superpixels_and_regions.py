import numpy as np
import pytest
import shapely

from quadpips_drake.errors import UserInputError
from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.egocan.egocan import EgocanMemory, draw_egocan, update_memory
from quadpips_drake.perception.regions.region_extraction import RegionConfig, extract_regions
from quadpips_drake.perception.superpixels.superpixels import SuperpixelConfig, segment_superpixels
from quadpips_drake.values.images import EgocanImage
from quadpips_drake.values.steppability import Steppability
from quadpips_drake.visualization.perception_picture import save_perception_picture
from tests.perception.scenes import (
    FOOT_RADIUS,
    INTRINSICS,
    MEDIUM,
    Scene,
    affordance,
    base_pose,
    camera_mount,
    corners_in_world,
    look,
    regions_of,
    stepping_stones,
    walking_poses,
)

CONFIG = PerceptionConfig()


def d435_noise(seed):
    rng = np.random.default_rng(seed)

    def spoil(depth):
        noisy = depth + np.where(np.isfinite(depth), 0.001 + 0.004 * depth**2, 0.0) * rng.standard_normal(depth.shape)
        return np.where(rng.random(depth.shape) < 0.02, np.nan, noisy).astype(np.float32)

    return spoil


def check_on_stones(regions, scene, height_tolerance, inset_to_edge, candidate_to_edge):
    """Every inset keeps its distance from the edges of the stone it lies on."""
    for region in regions:
        assert abs(region.center[2]) < height_tolerance
        assert region.normal[2] > np.cos(np.deg2rad(5.0))
        assert scene.edge_distance(*region.center[:2]) > candidate_to_edge
        for corner in corners_in_world(region, region.inset):
            assert scene.edge_distance(*corner[:2]) > inset_to_edge


@pytest.mark.parametrize("floor", [None, -0.05, -0.4])
@pytest.mark.parametrize("noise", [None, d435_noise(1)])
def test_walking_over_stones_finds_regions_on_stones_only(floor, noise):
    scene = stepping_stones(rows=7, columns=3, floor=floor)
    memory, poses = None, list(walking_poses(1.2, speed=0.4, rate=4.0))
    for k, pose in enumerate(poses):
        memory = look(scene, [pose], CONFIG, memory=memory, noise=noise)
        if k % 4 == 3:
            _, _, regions = regions_of(memory, CONFIG)
            among = [r for r in regions.regions if abs(r.center[1]) < 0.55 and r.center[0] < 3.4]
            assert len(among) > 25
            if floor == -0.05:  # the floor of the gaps is ground like any other, where it is wide enough
                among = [r for r in among if r.center[2] > floor / 2]
            # Edges are seen less sharply with noise, and towards a floor that is just below.
            inset_to_edge = 0.015 if floor == -0.05 else (0.028 if noise is None else 0.02)
            check_on_stones(among, scene, 0.005, inset_to_edge, 0.05)


def test_each_stone_has_one_to_four_regions():
    scene = stepping_stones()
    _, _, regions = regions_of(look(scene, walking_poses(0.8, speed=0.4, rate=3.0), CONFIG), CONFIG)
    centers = np.array([region.center for region in regions.regions])
    for x0, x1, y0, y1, _, _ in scene.boxes[1:]:
        if 1.0 < x0 < 2.2 and abs(y0 + y1) < 0.9:  # well within the cap
            on = (centers[:, 0] > x0) & (centers[:, 0] < x1) & (centers[:, 1] > y0) & (centers[:, 1] < y1)
            assert 1 <= on.sum() <= 4


def test_floor_is_covered_with_little_overlap_and_regions_are_well_formed():
    _, superpixels, regions = regions_of(look(Scene([]), [(0.0, base_pose(), 0.0)], CONFIG), CONFIG)
    insets = []
    assert len({region.id for region in regions.regions}) == len(regions.regions)
    for region in regions.regions:
        R = region.X_WR[:3, :3]
        np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-9)
        assert R[2, 2] > 0.9999 and np.linalg.det(R) > 0
        boundary, inset = shapely.Polygon(region.boundary), shapely.Polygon(region.inset)
        for polygon in (boundary, inset):
            assert polygon.is_valid and shapely.LinearRing(polygon.exterior).is_ccw
            assert polygon.convex_hull.area == pytest.approx(polygon.area)
        assert inset.contains(shapely.Point(0, 0))
        assert boundary.contains(inset)
        assert inset.exterior.distance(boundary.exterior) > FOOT_RADIUS + CONFIG.regions.margin - 1e-6
        insets.append(shapely.Polygon(corners_in_world(region, region.inset)[:, :2]))
    covered = shapely.union_all(insets).area
    assert covered < sum(inset.area for inset in insets) < 2.2 * covered
    assert covered > 0.75 * np.mean(superpixels.healthy) * (256 * CONFIG.egocan.cap_pixel) ** 2


def test_a_crack_and_a_step_part_the_regions():
    crack = Scene([[-2, 1.1, -1, 1, -0.3, 0], [1.15, 2.0, -1, 1, -0.3, 0]], floor=None)
    step = Scene([[-2, 1.1, -1, 1, -0.3, 0], [1.1, 2.0, -1, 1, -0.3, 0.04]], floor=None)
    for scene in (crack, step):
        _, _, regions = regions_of(look(scene, [(0.0, base_pose(), 0.0)], CONFIG, INTRINSICS), CONFIG)
        beyond = 0
        for region in regions.regions:
            x = corners_in_world(region, region.inset)[:, 0]
            assert x.max() < 1.1 - 0.03 or x.min() > 1.1 + 0.03
            beyond += x.min() > 1.1
        assert beyond >= 4


def test_slopes_are_found_up_to_the_limit():
    X_WB = base_pose()
    for slope, expected in ((0.35, True), (0.75, False)):
        normal = np.array([-np.sin(slope), 0.0, np.cos(slope)])
        X_WC = X_WB @ camera_mount()
        v, u = np.mgrid[: MEDIUM.height, : MEDIUM.width]
        ray = np.stack([(u - MEDIUM.cx) / MEDIUM.fx, (v - MEDIUM.cy) / MEDIUM.fy, np.ones(u.shape)], -1) @ X_WC[:3, :3].T
        p_WQ = np.array([0.7, 0.0, 0.0])
        depth = ((p_WQ - X_WC[:3, 3]) @ normal / (ray @ normal)).astype(np.float32)
        image = affordance(np.where(depth > 0, depth, np.inf), X_WC, 0.0, CONFIG, MEDIUM)
        memory = update_memory(EgocanMemory.empty(CONFIG.egocan), [image], 0.0, CONFIG.egocan)
        _, _, regions = regions_of(memory, CONFIG)
        assert (len(regions.regions) > 10) == expected
        for region in regions.regions:
            assert region.normal @ normal > np.cos(np.deg2rad(2.0))
            assert abs((region.center - p_WQ) @ normal) < 0.003


def test_labels_forbid_stepping():
    X_WC = base_pose() @ camera_mount()
    depth = Scene([]).depth(X_WC, MEDIUM)
    for label, expected in ((Steppability.STEPPABLE, True), (Steppability.PASSABLE, False)):
        image = affordance(depth, X_WC, 0.1, CONFIG, MEDIUM, np.full(depth.shape, label, np.uint8))
        memory = update_memory(look(Scene([]), [(0.0, base_pose(), 0.0)], CONFIG), [image], 0.0, CONFIG.egocan)
        _, _, regions = regions_of(memory, CONFIG)
        ahead = [region for region in regions.regions if region.center[0] > 1.0]
        assert bool(ahead) == expected
        assert all(region.label == label for region in ahead)
        assert any(region.center[0] < 0.5 for region in regions.regions)


def test_every_label_gives_regions_if_asked_for():
    X_WC = base_pose() @ camera_mount()
    depth = Scene([]).depth(X_WC, MEDIUM)
    image = affordance(depth, X_WC, 0.1, CONFIG, MEDIUM, np.full(depth.shape, Steppability.NON_PASSABLE, np.uint8))
    memory = update_memory(look(Scene([]), [(0.0, base_pose(), 0.0)], CONFIG), [image], 0.0, CONFIG.egocan)
    superpixels = segment_superpixels(draw_egocan(memory, CONFIG.egocan), CONFIG.superpixels, every_label=True)
    regions = extract_regions(superpixels, FOOT_RADIUS, CONFIG.regions).regions
    ahead = [region.label for region in regions if region.center[0] > 1.0]
    assert len(ahead) > 10 and set(ahead) == {Steppability.NON_PASSABLE}


@pytest.mark.parametrize(
    "nonsense",
    [np.full((MEDIUM.height, MEDIUM.width), value, np.float32) for value in (np.nan, np.inf, -np.inf, 0.0, 65.5, -2.0)]
    + [np.random.default_rng(0).uniform(0, 3, (MEDIUM.height, MEDIUM.width)).astype(np.float32)],
)
def test_nonsense_images_give_no_regions(nonsense):
    X_WC = base_pose() @ camera_mount()
    image = affordance(nonsense, X_WC, 0.0, CONFIG, MEDIUM)
    _, _, regions = regions_of(update_memory(EgocanMemory.empty(CONFIG.egocan), [image], 0.0, CONFIG.egocan), CONFIG)
    assert regions.regions == ()


def test_an_empty_can_gives_empty_results():
    superpixels = segment_superpixels(EgocanImage.empty(), CONFIG.superpixels)
    assert len(superpixels.centers) == 0
    assert extract_regions(superpixels, FOOT_RADIUS, CONFIG.regions).regions == ()


def test_same_input_same_result():
    memory = look(stepping_stones(), walking_poses(0.2, rate=5.0), CONFIG, noise=d435_noise(7))
    first, second = regions_of(memory, CONFIG)[2], regions_of(memory, CONFIG)[2]
    for a, b in zip(first.regions, second.regions, strict=True):
        np.testing.assert_array_equal(a.X_WR, b.X_WR)
        np.testing.assert_array_equal(a.inset, b.inset)


@pytest.mark.parametrize("bad", [{"min_upward": 0.0}, {"num_superpixels": 0}, {"ransac_samples": 2}])
def test_bad_parameters_are_refused(bad):
    with pytest.raises(UserInputError):
        SuperpixelConfig(**bad)
    with pytest.raises(UserInputError):
        RegionConfig(max_vertices=2)


def test_picture(tmp_path):
    """All stages at full resolution, drawn."""
    scene, X_WB = stepping_stones(), base_pose()
    X_WC = X_WB @ camera_mount()
    depth = scene.depth(X_WC, INTRINSICS)
    memory = look(scene, [(0.0, X_WB, 0.0)], CONFIG, INTRINSICS)
    image = affordance(depth, X_WC, 0.1, CONFIG, INTRINSICS)
    memory = update_memory(memory, [image], 0.0, CONFIG.egocan)
    can = draw_egocan(memory, CONFIG.egocan)
    superpixels = segment_superpixels(can, CONFIG.superpixels)
    regions = extract_regions(superpixels, FOOT_RADIUS, CONFIG.regions)
    save_perception_picture(tmp_path / "frame.png", image, can, superpixels, regions, X_WB)
    assert (tmp_path / "frame.png").stat().st_size > 10_000
