"""Draws where a robot's feet may stand: as wide, narrow, long and short as its joints, motors and legs allow.

    python examples/stance_limits.py --robot go2 --picture stance.png

Seen from above, the base at nominal height: dots are nominal footholds, the shaded places are those to which a foot and
the one across from it may move together.
"""

from pathlib import Path
from typing import Annotated

import matplotlib.pyplot as plt
import typer
from matplotlib.patches import Rectangle

from quadpips_drake.cli import console
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.stance_limits import stance_limits
from quadpips_drake.values.legs import Leg


def main(
    robot: Annotated[str, typer.Option(metavar="NAME", help="anymal_c or go2.")] = "anymal_c",
    picture: Annotated[Path, typer.Option(metavar="FILE.png", help="For the drawing.")] = Path("stance.png"),
) -> None:
    """Draw where a robot's feet may stand."""
    console.picture_file("--picture", picture)
    draw(load_robot(robot), picture)


def draw(robot, picture: Path) -> None:
    """Prints the limits and writes the picture."""
    print(f"trying how far the feet of {robot.title} reach")
    limits, feet = stance_limits(robot), robot.nominal_footholds_B
    for name, value in limits._asdict().items():
        print(f"{name} {value:.3f} m")
    figure, axes = plt.subplots(figsize=(6, 6), layout="constrained")
    shortest, longest = 0.5 * limits.min_length, 0.5 * limits.max_length
    narrowest, widest = 0.5 * limits.min_width, 0.5 * limits.max_width
    for leg in Leg:
        x = shortest if leg.fore > 0 else -longest
        y = narrowest if leg.side > 0 else -widest
        axes.add_patch(Rectangle((y, x), widest - narrowest, longest - shortest, alpha=0.25))
        axes.plot(feet[leg, 1], feet[leg, 0], "o", color="black")
        axes.annotate(leg.name, (feet[leg, 1], feet[leg, 0]), xytext=(6, 6), textcoords="offset points")
    axes.plot(robot.hip_positions_B[:, 1], robot.hip_positions_B[:, 0], "x", color="gray", label="hips")
    axes.set(aspect="equal", xlabel="y, to the left [m]", ylabel="x, forward [m]", title=f"{robot.title}: stance limits")
    axes.invert_xaxis()
    axes.legend()
    figure.savefig(picture, dpi=120)
    print(f"wrote {picture}")


if __name__ == "__main__":
    console.run_alone(main)
