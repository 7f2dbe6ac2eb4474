"""Stands a robot on a terrain for a second and saves what its depth camera sees.

    python examples/stand_and_look.py --terrain stepping_stones --robot anymal_c --picture depth.png

It shows how to use the simulation station alone, as a plant for a controller of one's own: the station has the ports of a
robot (feed-forward torques and joint targets in; depth image, state and IMU out), whichever robot and terrain it holds.
"""

from pathlib import Path
from typing import Annotated

import matplotlib.pyplot as plt
import numpy as np
import typer
from pydrake.systems.analysis import Simulator

from quadpips_drake.cli import console
from quadpips_drake.diagrams.observed_station import ObservedStation
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain


def main(
    terrain: Annotated[str, typer.Option(metavar="NAME|FILE", help="Where to stand.")] = "stepping_stones",
    robot: Annotated[str, typer.Option(metavar="NAME", help="anymal_c or go2.")] = "anymal_c",
    picture: Annotated[Path, typer.Option(metavar="FILE.png", help="For the depth image.")] = Path("depth.png"),
) -> None:
    """Stand a robot on a terrain for a second and save what its depth camera sees."""
    console.picture_file("--picture", picture)
    show(load_terrain(terrain), load_robot(robot), picture)


def show(terrain, robot, picture: Path) -> None:
    """Builds the station, simulates it and writes the picture."""
    print(f"building {robot.title} on {terrain.name}")
    station = ObservedStation(robot, terrain)

    simulator = Simulator(station)
    context = simulator.get_mutable_context()
    station.set_initial_state(context, *terrain.start)
    # The simplest controller: the drives hold the nominal stance.
    station.GetInputPort("feedforward_torque").FixValue(context, np.zeros(12))
    station.GetInputPort("desired_joint_state").FixValue(context, np.concatenate((robot.nominal_joints, np.zeros(12))))

    print("standing for a second")
    for time in np.arange(0.0, 1.01, 0.25):
        simulator.AdvanceTo(time)
        state = station.GetOutputPort("robot_state").Eval(context)
        tilt = np.degrees(state.rpy_WB[:2])
        print(f"t = {time:.2f} s: torso at {np.round(state.p_WB, 3)} m, roll and pitch {np.round(tilt, 2)} deg")

    print("looking")
    depth = station.GetOutputPort("depth_image").Eval(context).data[:, :, 0]
    seen = np.isfinite(depth) & (depth > 0.0)
    print(f"depth image: {np.mean(seen):.0%} of the pixels see something, the nearest at {depth[seen].min():.2f} m")
    plt.imsave(picture, np.where(seen, depth, np.nan), vmin=0.0, vmax=depth[seen].max(), cmap="viridis_r")
    print(f"wrote {picture}")


if __name__ == "__main__":
    console.run_alone(main)
