"""The label image on its way from the network to the foothold search, and what there is to step on with it."""

import pytest

from quadpips_drake.diagrams.planning_module import PlanningConfig
from quadpips_drake.diagrams.quadpips import QuadpipsConfig, QuadpipsDiagram
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain


def diagram(steppability, region_source) -> QuadpipsDiagram:
    planning = PlanningConfig(footholds=FootholdConfig(steppability=steppability))
    config = QuadpipsConfig(region_source=region_source, planning=planning)
    return QuadpipsDiagram(load_robot("anymal_c"), load_terrain("obstructed_balance_beam"), config)


@pytest.mark.parametrize("steppability", ["exclude", "penalty", "off"])
def test_only_the_penalty_looks_at_the_newest_label_image(steppability):
    system = diagram(steppability, "superpixels")
    context = system.CreateDefaultContext()
    planning = system.planning
    assert planning.HasInputPort("label_image") == (steppability == "penalty")
    if steppability == "penalty":
        port = planning.GetInputPort("label_image")
        assert port.HasValue(planning.GetMyContextFromRoot(context))
    segmenter = system.regions.GetSubsystemByName("superpixel_segmenter")
    assert segmenter._every_label == (steppability != "exclude")


@pytest.mark.parametrize("steppability", ["exclude", "penalty", "off"])
def test_regions_of_every_label_only_where_labels_do_not_exclude(steppability):
    system = diagram(steppability, "oracle")
    labels = {region.label for region in system.regions._regions}
    assert (len(labels) > 1) == (steppability != "exclude")
