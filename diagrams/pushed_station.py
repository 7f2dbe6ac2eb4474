"""Pushes on the robot of a station."""

from collections.abc import Sequence

from quadpips_drake.diagrams.simulation_station import SimulationStation
from quadpips_drake.faults.push_system import Push, PushSource
from quadpips_drake.framework.ports import DiagramBuilder


def add_pushes(builder: DiagramBuilder, station: SimulationStation, pushes: Sequence[Push]) -> PushSource:
    """Adds what pushes the robot of ``station`` at its base's centre of mass; ``pushes``: those known beforehand."""
    base = station.plant.GetBodyByName("base")
    source = builder.AddSystem(PushSource(pushes, base, station.robot.tree.link_com[0]))
    builder.Connect(source.get_output_port(), station.GetInputPort("applied_spatial_force"))
    return source
