"""Nonsense on the ports of superpixels and regions, and labels: nothing leaves a system but what may be stepped on."""

import dataclasses

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from quadpips_drake.perception.config import PerceptionConfig
from quadpips_drake.perception.egocan.egocan import draw_egocan
from quadpips_drake.perception.regions.region_extractor_system import RegionExtractor
from quadpips_drake.perception.superpixels.superpixel_segmenter_system import SuperpixelSegmenter
from quadpips_drake.values.images import EgocanImage
from quadpips_drake.values.steppability import Steppability
from tests.perception.scenes import FOOT_RADIUS, Scene, base_pose, look

CONFIG = PerceptionConfig()
RNG = np.random.default_rng(5)


@pytest.fixture(scope="module")
def good():
    return draw_egocan(look(Scene([]), [(0.0, base_pose(), 0.0)], CONFIG), CONFIG.egocan)


def with_height(can, height):
    return dataclasses.replace(can, cap_height=np.asarray(height, np.float32))


def in_shape(can, rows, columns):
    """``can`` cut or repeated to another size, as a wrong configuration would give it."""
    cut = {name: np.resize(getattr(can, name), (rows, columns, *getattr(can, name).shape[2:])) for name in CAP}
    return dataclasses.replace(can, **cut)


CAP = ("cap_height", "cap_normals", "cap_labels")

NONSENSE = {
    "empty": lambda can: EgocanImage.empty(),
    "nan": lambda can: with_height(can, np.full_like(can.cap_height, np.nan)),
    "zero": lambda can: with_height(can, np.zeros_like(can.cap_height)),
    "saturated": lambda can: with_height(can, np.full_like(can.cap_height, 65.535)),
    "infinite": lambda can: with_height(can, np.full_like(can.cap_height, np.inf)),
    "negative": lambda can: with_height(can, -can.cap_height),
    "noise": lambda can: with_height(can, RNG.uniform(0.0, 1.0, can.cap_height.shape)),
    "no normals": lambda can: dataclasses.replace(can, cap_normals=np.full_like(can.cap_normals, np.nan)),
    "zero normals": lambda can: dataclasses.replace(can, cap_normals=np.zeros_like(can.cap_normals)),
    "random normals": lambda can: dataclasses.replace(
        with_height(can, RNG.uniform(0.3, 0.7, can.cap_height.shape)),
        cap_normals=RNG.normal(size=can.cap_normals.shape).astype(np.float32),
    ),
    "normals of another size": lambda can: dataclasses.replace(can, cap_normals=can.cap_normals[:100]),
    "labels of another size": lambda can: dataclasses.replace(can, cap_labels=can.cap_labels[:, :7]),
    "nan pose": lambda can: dataclasses.replace(can, X_WE=np.full((4, 4), np.nan)),
    "one pixel": lambda can: in_shape(can, 1, 1),
    "one row": lambda can: with_height(in_shape(can, 1, 300), np.full((1, 300), 0.5)),
}


def perceive(cans):
    """Returns the region sets after each of ``cans``, through the two systems as they are wired."""
    builder = DiagramBuilder()
    segmenter = builder.AddSystem(SuperpixelSegmenter(CONFIG.superpixels))
    extractor = builder.AddSystem(RegionExtractor(FOOT_RADIUS, CONFIG.regions))
    builder.Connect(segmenter.GetOutputPort("superpixels"), extractor.GetInputPort("superpixels"))
    builder.ExportInput(segmenter.GetInputPort("egocan"), "egocan")
    builder.ExportOutput(extractor.GetOutputPort("region_set"), "region_set")
    diagram = builder.Build()
    simulator = Simulator(diagram)
    results = []
    for k, can in enumerate(cans):
        can = dataclasses.replace(can, stamp=0.05 * k) if np.isfinite(can.stamp) else can
        diagram.GetInputPort("egocan").FixValue(simulator.get_mutable_context(), AbstractValue.Make(can))
        simulator.AdvanceTo((k + 0.5) / CONFIG.superpixels.rate)
        results.append(diagram.GetOutputPort("region_set").Eval(simulator.get_context()))
    return results


@pytest.mark.parametrize("name", NONSENSE)
def test_nonsense_makes_no_region_and_is_forgotten(good, name):
    """At the start and in mid-walk; once it is over, there is ground again, and no id is given twice."""
    bad = NONSENSE[name](good)
    first, before, during, after = perceive([bad, good, bad, good])
    assert first.regions == () and during.regions == ()
    assert len(before.regions) > 30 and len(after.regions) > 30
    ids = [region.id for region in before.regions]
    if name == "empty":
        assert not set(ids) & {region.id for region in after.regions}


def test_a_jump_of_the_pose_starts_afresh(good):
    X_WE = np.array(good.X_WE)
    X_WE[:3, 3] += [30.0, -2.0, 0.0]
    before, jumped = perceive([good, dataclasses.replace(good, X_WE=X_WE)])
    assert len(jumped.regions) == len(before.regions)
    assert not {region.id for region in before.regions} & {region.id for region in jumped.regions}
    assert all(region.center[0] > 20.0 for region in jumped.regions)


@pytest.mark.parametrize("label", list(Steppability))
def test_labels_decide_and_reach_the_regions(good, label):
    """Ground that is not steppable leaves the health check; steppable and unknown ground keeps its label (V-D.1)."""
    labels = np.zeros_like(good.cap_labels)
    labels[128:] = label
    (result,) = perceive([dataclasses.replace(good, cap_labels=labels)])
    ahead = [region for region in result.regions if region.center[0] > good.X_WE[0, 3] + 0.15]
    behind = [region for region in result.regions if region.center[0] < good.X_WE[0, 3] - 0.15]
    assert behind and all(region.label == Steppability.UNKNOWN for region in behind)
    if label in (Steppability.UNKNOWN, Steppability.STEPPABLE):
        assert len(ahead) > 10 and all(region.label == label for region in ahead)
    else:
        assert not ahead
        reach = max((region.boundary @ region.X_WR[:2, :2].T + region.center[:2])[:, 0].max() for region in behind)
        assert reach < good.X_WE[0, 3] + 0.01


def test_a_label_that_does_not_exist_is_not_stepped_on(good):
    (result,) = perceive([dataclasses.replace(good, cap_labels=np.full_like(good.cap_labels, 200))])
    assert result.regions == ()
