"""``quadpips diagram``: the wiring as a picture."""

import shutil
import subprocess
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli import console
from quadpips_drake.errors import UserInputError, unknown_name

EPILOG = """
Examples:

  quadpips diagram quadpips                writes quadpips.svg

  quadpips diagram perception --out perception.png

  quadpips diagram quadpips --max-depth 2  the modules opened, each with its own systems

  quadpips diagram tracking --max-depth 0  the outer ports alone

Without Graphviz's dot the file is written in dot's own language (FILE.dot) and a line says so.
"""

FORMATS = ("svg", "png", "pdf", "dot")


def diagram(
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="station, perception, planning, tracking, walk, quadpips, or a planner.")
    ],
    out: Annotated[Path | None, typer.Option(metavar="FILE.svg", help="Or .png, .pdf, .dot. Default: NAME.svg.")] = None,
    robot: Annotated[str, typer.Option(metavar="NAME", help="anymal_c or go2.")] = "anymal_c",
    terrain: Annotated[str, typer.Option(metavar="NAME|FILE", help="See 'quadpips terrain list'.")] = "flat",
    max_depth: Annotated[int, typer.Option(min=0, metavar="N", help="How many levels of subsystems to draw.")] = 1,
):
    """Draw a diagram: its systems with all ports, and the wires between them.

    Of Drake's own systems only the ports in use are drawn, the others counted.
    """
    out = out or Path(f"{name}.svg")
    if out.suffix.lstrip(".") not in FORMATS:
        raise UserInputError(f"--out {out}: the name must end in {', '.join('.' + f for f in FORMATS)}")
    built = build_diagram(name, robot, terrain)
    from quadpips_drake.visualization.diagram_graph import read_block, to_dot

    console.writable_directory(out.parent)
    console.say(_draw(to_dot(read_block(built, max_depth)), out))


def build_diagram(name: str, robot: str, terrain: str):
    """Returns the diagram of that name, for a robot and a terrain by name; raises UserInputError for an unknown one."""
    builders = _builders()
    if name not in builders:
        raise unknown_name("diagram", name, builders)
    from quadpips_drake.robots.robot_library import load_robot
    from quadpips_drake.terrain.library import load_terrain

    return builders[name](load_robot(robot), load_terrain(terrain))


def _builders() -> dict:
    """Name -> function of RobotModel and Terrain that builds the diagram."""
    return {
        "station": _station,
        "perception": _perception,
        "planning": _planning,
        "tracking": _tracking,
        "walk": _walk,
        "quadpips": _quadpips,
    } | _other_planners()


def _other_planners() -> dict:
    """The same for the planners beside ``planning``, by their names."""
    from quadpips_drake.diagrams.planners import planners

    return {name: partial(_planner, name) for name in planners.names() if name != "quadpips"}


def _planner(name: str, robot, terrain):
    from quadpips_drake.cli.run import resolve_trial_config
    from quadpips_drake.diagrams.planners import PlannerSetup, planners

    stages, entry = resolve_trial_config(None, {"robot": robot.name, "planner": name}, []).stages, planners.get(name)
    return entry.factory(PlannerSetup(robot, stages.section(entry)))


def _station(robot, terrain):
    from quadpips_drake.diagrams.simulation_station import SimulationStation, StationConfig

    return SimulationStation(robot, terrain, StationConfig())


def _perception(robot, terrain):
    from quadpips_drake.diagrams.perception_module import PerceptionModule
    from quadpips_drake.perception.config import PerceptionConfig

    return PerceptionModule(robot, _station(robot, terrain).camera_intrinsics, PerceptionConfig())


def _planning(robot, terrain):
    from quadpips_drake.diagrams.planning_module import PlanningModule

    return PlanningModule(robot)


def _tracking(robot, terrain):
    from quadpips_drake.diagrams.tracking_module import TrackingModule

    return TrackingModule(robot)


def _walk(robot, terrain):
    from quadpips_drake.control.references.walk_command import WalkCommand
    from quadpips_drake.diagrams.walk import WalkDiagram
    from quadpips_drake.faults.push_system import Push

    return WalkDiagram(robot, terrain, [WalkCommand(gait="trot")], pushes=[Push()])


def _quadpips(robot, terrain):
    from quadpips_drake.cli.run import resolve_trial_config
    from quadpips_drake.diagrams.quadpips import QuadpipsDiagram

    stages = resolve_trial_config(None, {"robot": robot.name}, []).stages
    return QuadpipsDiagram(robot, terrain, stages, seed=0)


def _draw(graph: str, out: Path) -> str:
    """Writes the picture of a graph in dot's language, and returns a line that says what was written."""
    dot = shutil.which("dot")
    if out.suffix == ".dot" or dot is None:
        source = out.with_suffix(".dot")
        source.write_text(graph, encoding="utf-8")
        if out.suffix == ".dot":
            return f"wrote {source}"
        return f"wrote {source}: no {out.suffix[1:]} without Graphviz's dot (on Debian or Ubuntu: apt install graphviz)"
    done = subprocess.run([dot, f"-T{out.suffix[1:]}", "-o", str(out)], input=graph, text=True, capture_output=True)
    if done.returncode != 0:
        raise RuntimeError(f"dot failed: {done.stderr}")
    return f"wrote {out}"
