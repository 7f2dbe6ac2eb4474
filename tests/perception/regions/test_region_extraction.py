"""Regions hold nothing but seen ground of their plane: density, overhang, convexity."""

import dataclasses

import numpy as np
import pytest
import shapely

from quadpips_drake.perception.regions.region_extraction import RegionConfig, extract_regions
from quadpips_drake.values.images import SuperpixelImage
from tests.perception.regions.region_reference import void_on_plane
from tests.perception.scenes import FOOT_RADIUS

CONFIG = RegionConfig()
PIXEL = 0.0125


def one_superpixel(ground, height=None, rays=(PIXEL, 0.0)):
    """A cap whose only superpixel is all of ``ground``, bool (h, w), 0.5 m (or ``height`` [m]) below the camera."""
    rows, columns = ground.shape
    height = np.where(ground, 0.5 if height is None else height, np.nan).astype(np.float32)
    v, u = np.mgrid[:rows, :columns]
    pixel = rays[0] + rays[1] * height
    points = np.stack([pixel * (u - columns // 2), height, pixel * (v - rows // 2)], axis=-1).astype(np.float32)
    X_WE = np.eye(4)
    X_WE[:3, :3] = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]
    return SuperpixelImage(
        stamp=0.0,
        X_WE=X_WE,
        assignment=np.where(ground, 0, -1).astype(np.int32),
        points=points,
        centers=points[ground].mean(axis=0, dtype=float)[None],
        normals=np.array([[0.0, -1.0, 0.0]]),
        labels=np.zeros(1, np.uint8),
        cap_rays=np.array(rays),
        healthy=ground,
        ids=np.array([7]),
    )


def canvas():
    return np.zeros((96, 96), bool)


def ground_like(shape):
    ground = canvas()
    if shape == "L":
        ground[20:70, 20:38] = ground[52:70, 20:70] = True
    elif shape == "ring":
        ground[15:80, 15:80] = True
        ground[40:56, 40:56] = False
    elif shape == "disc":
        v, u = np.mgrid[:96, :96]
        ground = np.hypot(u - 45, v - 50) < 25
    elif shape == "hole":
        ground[20:70, 20:70] = True
        ground[30:34, 30:34] = False
    elif shape == "two halves":
        ground[20:70, 20:43] = ground[20:70, 48:70] = True
    elif shape == "slanted":
        v, u = np.mgrid[:96, :96]
        ground = (np.abs(u - 48 + 0.6 * (v - 48)) < 16) & (np.abs(v - 48) < 35)
    elif shape == "at the rim":
        ground[60:, 60:] = True
    return ground


@pytest.mark.parametrize("rays", [(PIXEL, 0.0), (0.0, 0.02)], ids=["straight down", "central"])
@pytest.mark.parametrize("shape", ["L", "ring", "disc", "hole", "two halves", "slanted", "at the rim"])
def test_no_void_in_any_region(shape, rays):
    superpixels = one_superpixel(ground_like(shape), rays=rays)
    (region,) = extract_regions(superpixels, FOOT_RADIUS, CONFIG).regions
    boundary, inset = shapely.Polygon(region.boundary), shapely.Polygon(region.inset)
    void = shapely.points(void_on_plane(superpixels, region, CONFIG))
    assert not shapely.contains_properly(boundary, void).any()
    assert inset.contains(shapely.Point(0, 0)) and boundary.contains(inset)
    assert inset.exterior.distance(boundary.exterior) > FOOT_RADIUS + CONFIG.margin - 1e-9
    assert region.id == 7


def test_straight_edges_are_followed():
    """The inset of a rectangle, turned against the pixels, is that rectangle less foot radius and margin."""
    v, u = np.mgrid[:96, :96]
    for angle in np.deg2rad([0, 10, 30, 45]):
        along = np.cos(angle) * (u - 48) + np.sin(angle) * (v - 48)
        aside = np.cos(angle) * (v - 48) - np.sin(angle) * (u - 48)
        superpixels = one_superpixel((np.abs(along) < 24) & (np.abs(aside) < 9))
        (region,) = extract_regions(superpixels, FOOT_RADIUS, CONFIG).regions
        clearance = FOOT_RADIUS + CONFIG.margin
        ideal = (48 * PIXEL - 2 * clearance) * (18 * PIXEL - 2 * clearance)
        assert 0.8 * ideal < shapely.Polygon(region.inset).area < 1.03 * ideal


def test_ground_off_the_plane_is_void():
    height = np.full((96, 96), 0.5)
    height[:, 48:] = 0.5 + 1.5 * CONFIG.max_off_plane
    ground = canvas()
    ground[20:70, 20:70] = True
    superpixels = dataclasses.replace(one_superpixel(ground, height), centers=np.array([[-0.1, 0.5, 0.0]]))
    (region,) = extract_regions(superpixels, FOOT_RADIUS, CONFIG).regions
    void = shapely.points(void_on_plane(superpixels, region, CONFIG))
    assert not shapely.contains_properly(shapely.Polygon(region.boundary), void).any()
    corners = region.boundary @ region.X_WR[:2, :2].T + region.center[:2]
    assert (-corners[:, 1]).max() < 0.0  # x of E is -y of W; the step is at x = 0


def test_a_sparse_superpixel_is_no_region():
    """Density: what is mostly holes is not ground, although its hull is large."""
    rng = np.random.default_rng(3)
    ground = canvas()
    ground[20:70, 20:70] = rng.random((50, 50)) < 0.2
    assert extract_regions(one_superpixel(ground), FOOT_RADIUS, CONFIG).regions == ()
    ground[20:70, 20:70] = rng.random((50, 50)) < 0.97  # single lost pixels do no harm
    assert len(extract_regions(one_superpixel(ground), FOOT_RADIUS, CONFIG).regions) == 1


@pytest.mark.parametrize("width", [1, 4, 8])
def test_too_narrow_ground_is_no_region(width):
    ground = canvas()
    ground[20:70, 40 : 40 + width] = True
    assert extract_regions(one_superpixel(ground), FOOT_RADIUS, CONFIG).regions == ()


@pytest.mark.parametrize("bad", ["nan normal", "level normal", "nan center", "no pixels", "nan points, none healthy"])
def test_broken_superpixels_make_no_region(bad):
    superpixels = one_superpixel(ground_like("disc"))
    changes = {
        "nan normal": {"normals": np.full((1, 3), np.nan)},
        "level normal": {"normals": np.array([[1.0, 0.0, 0.0]])},
        "nan center": {"centers": np.full((1, 3), np.nan)},
        "no pixels": {"assignment": np.full((96, 96), -1, np.int32)},
        "nan points, none healthy": {"points": np.full((96, 96, 3), np.nan, np.float32), "healthy": canvas()},
    }[bad]
    assert extract_regions(dataclasses.replace(superpixels, **changes), FOOT_RADIUS, CONFIG).regions == ()
