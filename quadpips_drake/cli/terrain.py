"""``quadpips terrain``: what terrains there are, what they look like, and their files."""

from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli.console import numbers, say

EPILOG = """
Examples:

  quadpips terrain list

  quadpips terrain show stairs --out stairs.png

  quadpips terrain show balance_beam --difficulty 0.25

  quadpips terrain export sparse_stones --seed 3 --out my_stones.yaml   edit it, then: quadpips run --terrain my_stones.yaml
"""

app = typer.Typer(help="List, show and export terrains.", epilog=EPILOG, no_args_is_help=True)

NameArgument = Annotated[str, typer.Argument(metavar="NAME|FILE", help="A name from 'list', or a .yaml or .json file.")]
SeedOption = Annotated[int, typer.Option(min=0, metavar="N", help="Decides what is random in the terrain.")]
StartOption = Annotated[str | None, typer.Option(metavar="X,Y,YAW", help="Start, m and rad. Default: the terrain's.")]
DifficultyOption = Annotated[
    float | None, typer.Option(metavar="X", help="How hard it is: the one number that 'list' names, in its unit.")
]
GoalOption = Annotated[str | None, typer.Option(metavar="X,Y", help="Goal, m. Default: the terrain's.")]


@app.command("list")
def list_terrains():
    """List the terrains that come with the package."""
    from quadpips_drake.terrain.library import load_terrain, terrain_difficulty, terrain_names, terrains

    width = max(map(len, terrain_names()))
    for name in terrain_names():
        terrain = load_terrain(name)
        say(f"{name:<{width}} {_first_sentence(terrains.get(name).factory)}")
        ends = f"start {_list(terrain.start)}; goal {_list(terrain.goal)}"
        say(f"{'':<{width}} {len(terrain.elements)} elements; {_size(terrain)} m; {ends}")
        say(f"{'':<{width}} difficulty: {terrain_difficulty(name) or 'none to choose'}")


@app.command()
def show(
    name: NameArgument,
    out: Annotated[Path | None, typer.Option(metavar="FILE.png", help="Or .svg, .pdf. Default: NAME.png.")] = None,
    seed: SeedOption = 0,
    start: StartOption = None,
    goal: GoalOption = None,
    difficulty: DifficultyOption = None,
):
    """Draw a terrain from above, and say its size, start and goal."""
    from quadpips_drake.terrain.placement import problem_with_goal, problem_with_start
    from quadpips_drake.visualization.terrain_picture import save_terrain_picture

    terrain = _load(name, seed, start, goal, difficulty)
    out = out or Path(f"{terrain.name}.png")
    save_terrain_picture(terrain, out)
    _describe(terrain, name, difficulty)
    for problem in (problem_with_start(terrain), problem_with_goal(terrain)):
        if problem:
            say(f"warning:  {problem}")
    say(f"picture:  {out}")


@app.command()
def export(
    name: NameArgument,
    out: Annotated[Path | None, typer.Option(metavar="FILE.yaml", help="Default: NAME.yaml.")] = None,
    seed: SeedOption = 0,
    start: StartOption = None,
    goal: GoalOption = None,
    difficulty: DifficultyOption = None,
):
    """Write a terrain as a YAML file, to be edited and given to 'quadpips run --terrain'."""
    from quadpips_drake.errors import UserInputError
    from quadpips_drake.terrain.files.terrain_file import write_terrain_file

    terrain = _load(name, seed, start, goal, difficulty)
    out = out or Path(f"{terrain.name}.yaml")
    if out.suffix.lower() not in (".yaml", ".yml"):
        raise UserInputError(f"--out {out}: the name must end in .yaml or .yml")
    write_terrain_file(terrain, out)
    _describe(terrain, name, difficulty)
    say(f"file:     {out}")


def _load(name: str, seed: int, start: str | None, goal: str | None, difficulty: float | None):
    from quadpips_drake.terrain.library import load_terrain

    start = numbers("--start", start, "X,Y,YAW") if start else None
    goal = numbers("--goal", goal, "X,Y") if goal else None
    return load_terrain(name, seed=seed, start=start, goal=goal, difficulty=difficulty)


def _describe(terrain, name: str, difficulty: float | None):
    from quadpips_drake.terrain.library import terrain_difficulty, terrains

    say(f"terrain:  {terrain.name}, {len(terrain.elements)} elements, friction {terrain.friction:g}")
    kind = terrain_difficulty(name) if name in terrains else None
    if kind is not None:
        say(f"how hard: {kind.told(difficulty)}")
    say(f"size:     {_size(terrain)} m (x, y, z)")
    say(f"start:    {_list(terrain.start)} (x, y [m], yaw [rad])")
    say(f"goal:     {_list(terrain.goal)} (x, y [m])")


def _size(terrain) -> str:
    low, high = terrain.bounds()
    return " x ".join(f"{value:.2f}".rstrip("0").rstrip(".") for value in high - low)


def _list(values) -> str:
    return ", ".join(f"{value:.3f}".rstrip("0").rstrip(".") for value in values)


def _first_sentence(generator) -> str:
    """What the docstring of a terrain's generator begins with."""
    return (generator.__doc__ or "").strip().split("\n")[0].split(". ")[0].rstrip(".")
