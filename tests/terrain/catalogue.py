"""One instance of every system of this stage."""

import numpy as np
from pydrake.geometry import ProximityProperties, SceneGraph
from pydrake.systems.framework import LeafSystem

from quadpips_drake.terrain.appearing.appearing_poses_system import AppearingPoses
from quadpips_drake.terrain.ground_window import GroundWindow
from quadpips_drake.terrain.ground_window_system import GroundWindowGuard


def make_systems() -> list[LeafSystem]:
    scene_graph = SceneGraph()
    source = scene_graph.RegisterSource("ground")
    window = GroundWindow(scene_graph, source, [], np.zeros((0, 2, 2)), ProximityProperties())
    return [GroundWindowGuard(window, num_states=37, first_position=4), AppearingPoses([], [])]
