"""``quadpips run``: one trial from start to goal."""

from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli import console
from quadpips_drake.cli.trials import run_and_report

EPILOG = """
Examples:

  quadpips run                              ANYmal C crosses stepping stones

  quadpips run --robot go2 --terrain flat --seed 7

  quadpips run --terrain stairs --meshcat   to watch it in a browser

  quadpips run my_scenario.yaml --goal 4,0  a file, one value replaced

  quadpips run OTHER_RUN/config.yaml        the same trial once more

  quadpips run --set stages.SECTION.KEY=VALUE

Any value of config.yaml can be set, see docs/configuration.md.

Exit status: 0 goal reached, 1 trial failed, 2 bad input.
"""


def run(
    scenario: Annotated[
        Path | None, typer.Argument(metavar="SCENARIO", help="YAML file with any of the keys of a saved config.yaml.")
    ] = None,
    robot: Annotated[
        str | None, typer.Option(metavar="NAME|FILE", help="anymal_c, go2, or a robot.yaml. Default: anymal_c.")
    ] = None,
    terrain: Annotated[
        str | None,
        typer.Option(metavar="NAME|FILE", help="See 'quadpips terrain list', or a file. Default: stepping_stones."),
    ] = None,
    planner: Annotated[str | None, typer.Option(metavar="NAME", help="Who plans. Default: quadpips.")] = None,
    regions: Annotated[
        str | None, typer.Option(metavar="NAME", help="Where planar regions come from. Default: superpixels.")
    ] = None,
    seed: Annotated[int | None, typer.Option(metavar="N", help="Of all random numbers. Default: 0.")] = None,
    start: Annotated[str | None, typer.Option(metavar="X,Y,YAW", help="Start, m and rad. Default: the terrain's.")] = None,
    goal: Annotated[str | None, typer.Option(metavar="X,Y", help="Goal, m. Default: the terrain's.")] = None,
    duration: Annotated[float | None, typer.Option(metavar="S", help="Longest simulated time, s. Default: 60.")] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="For the results. Default: out/ROBOT-TERRAIN-PLANNER-SEED.")
    ] = None,
    meshcat: Annotated[bool, typer.Option("--meshcat", help="Show the run in a browser; prints the address.")] = False,
    no_recording: Annotated[bool, typer.Option("--no-recording", help="Do not write recording.html.")] = False,
    sets: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Replace one value; may be repeated.")
    ] = None,
):
    """Let a robot walk from start to goal by its own camera, in simulation.

    Writes result.json, recording.html (opens offline in a browser), config.yaml (all values used) and log.npz into DIR.
    """
    options = {"robot": robot, "terrain": terrain, "planner": planner, "seed": seed, "duration": duration}
    options["start"] = None if start is None else console.numbers("--start", start, "X,Y,YAW")
    options["goal"] = None if goal is None else console.numbers("--goal", goal, "X,Y")
    chosen = [] if regions is None else [f"stages.region_source={regions}"]
    config = resolve_trial_config(scenario, {k: v for k, v in options.items() if v is not None}, chosen + (sets or []))
    out = console.writable_directory(out or default_directory(config))
    from quadpips_drake.trials.trial import run_trial

    raise typer.Exit(run_and_report(run_trial, config, out, recording=not no_recording, meshcat=meshcat))


def resolve_trial_config(scenario: Path | None, options: dict, sets: list[str]):
    """Returns the TrialConfig that scenario file, options and overrides make together; see ``resolve_config``."""
    from quadpips_drake.trials.trial import TrialConfig
    from quadpips_drake.trials.trial_options import resolve_config

    return resolve_config(TrialConfig, scenario, options, sets)


def default_directory(config) -> Path:
    """Returns where the results of the TrialConfig go unless the user says otherwise."""
    return Path("out") / f"{config.robot}-{Path(config.terrain).stem}-{config.planner}-{config.seed}"
