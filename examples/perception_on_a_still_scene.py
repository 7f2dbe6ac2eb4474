"""One depth image of a standing robot, and what every stage of perception makes of it, as a picture.

    python examples/perception_on_a_still_scene.py --terrain stairs --robot anymal_c --picture perception.png

It shows how to use the perception alone: a diagram with a depth image and the robot's state going in and regions coming out.
"""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from quadpips_drake.cli import console
from quadpips_drake.diagrams.observed_station import ObservedStation
from quadpips_drake.diagrams.perception_module import PerceptionModule
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.timing import StageTimings
from quadpips_drake.visualization.perception_picture import save_perception_picture


def main(
    terrain: Annotated[str, typer.Option(metavar="NAME|FILE", help="Where to stand.")] = "stairs",
    robot: Annotated[str, typer.Option(metavar="NAME", help="anymal_c or go2.")] = "anymal_c",
    picture: Annotated[Path, typer.Option(metavar="FILE.png", help="What every stage sees.")] = Path("perception.png"),
) -> None:
    """Draw what every stage of perception makes of one depth image of a standing robot."""
    console.picture_file("--picture", picture)
    show(load_terrain(terrain), load_robot(robot), picture)


def show(terrain, robot, picture: Path) -> None:
    """Builds station and perception, lets them see for a moment and writes the picture."""
    print(f"building {robot.title} on {terrain.name}")
    timings = StageTimings()
    builder = DiagramBuilder()
    station = builder.AddSystem(ObservedStation(robot, terrain))
    perception = builder.AddSystem(PerceptionModule(robot, station.camera_intrinsics, timings=timings))
    for name in ("depth_image", "robot_state"):
        builder.Connect(station.GetOutputPort(name), perception.GetInputPort(name))
    simulator = Simulator(builder.Build())
    context = simulator.get_mutable_context()
    station.set_initial_state(context, *terrain.start)
    simulator.Initialize()
    simulator.AdvanceTo(0.001)

    print("looking: depth, normals, labels, egocan, superpixels, regions")
    own = perception.GetMyContextFromRoot(context)
    names = ("affordance_image", "egocan", "superpixels", "region_set")
    image, can, superpixels, regions = (perception.GetOutputPort(name).Eval(own) for name in names)
    for region in regions.regions[:5]:
        tilt = np.degrees(np.arccos(region.normal[2]))
        print(f"region {region.id}: centre {np.round(region.center, 3)} m, tilted by {tilt:.1f} deg")
    print(f"... {len(regions.regions)} regions in all")
    save_perception_picture(picture, image, can, superpixels, regions)
    print(f"wrote {picture}")


if __name__ == "__main__":
    console.run_alone(main)
