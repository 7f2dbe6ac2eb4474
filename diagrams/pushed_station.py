"""Pushes on the robot of a station."""

from collections.abc import Sequence

from quadpips_drake.diagrams.simulation_station import SimulationStation
from quadpips_drake.faults.push_system import Push, PushSource
from quadpips_drake.framework.ports import DiagramBuilder
from quadpips_drake.visualization.push_visualizer_system import PushVisualizer
from quadpips_drake.visualization.recording import FRAMES_PER_SECOND


def add_pushes(builder: DiagramBuilder, station: SimulationStation, pushes: Sequence[Push]) -> PushSource:
    """Adds what pushes the robot of ``station`` at its base's centre of mass; ``pushes``: those known beforehand."""
    base = station.plant.GetBodyByName("base")
    source = builder.AddSystem(PushSource(pushes, base, station.robot.tree.link_com[0]))
    builder.Connect(source.get_output_port(), station.GetInputPort("applied_spatial_force"))
    return source


def draw_pushes(builder: DiagramBuilder, station: SimulationStation, pushes: Sequence[Push], meshcat, truth) -> None:
    """Adds what draws ``pushes`` into ``meshcat``, if there are any; ``truth``: port of the true RobotState."""
    if pushes:
        arrows = builder.AddSystem(PushVisualizer(station.robot, meshcat, pushes, period=1.0 / FRAMES_PER_SECOND))
        builder.Connect(truth, arrows.get_input_port())
