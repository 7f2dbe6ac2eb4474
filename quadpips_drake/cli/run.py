"""``quadpips run``: one trial from start to goal."""

from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli import console
from quadpips_drake.cli.trials import (
    Difficulty,
    Explain,
    Film,
    Latency,
    MeshcatHost,
    NoRecording,
    Overwrite,
    Profile,
    Pushes,
    Rerun,
    Robot,
    RunTerrain,
    Scenario,
    Seed,
    Sets,
    Start,
    Threads,
    pushes_of,
    resolve,
    run_and_report,
    watched_from,
)

EPILOG = """
Examples:

  quadpips run                              ANYmal C crosses stepping stones

  quadpips run --robot go2 --terrain flat --seed 7

  quadpips run --terrain stairs --meshcat   to watch it in a browser

  quadpips run --terrain balance_beam --difficulty 0.3

  quadpips run --terrain flat --spawn box:0.2,0.2,0.15@foothold@4

  quadpips run --terrain flat --push 0,250,0,6,0.1   250 N to the left (world y) at 6 s, for 0.1 s

  quadpips run my_scenario.yaml --goal 4,0  a file, one value replaced

  quadpips run OTHER_RUN/config.yaml --out AGAIN   the same trial once more

  quadpips run --set stages.SECTION.KEY=VALUE

Any value of config.yaml can be set, see docs/configuration.md.

Exit status: 0 goal reached, 1 trial failed, 2 bad input, 130 Ctrl-C, 143 SIGTERM; then all files are written, too.
"""


Spawn = Annotated[
    list[str] | None,
    typer.Option(
        metavar="ELEMENT@TIME",
        help="What appears on the way: box:L,W,H@X,Y@TIME, box:L,W,H@foothold@TIME, FILE.yaml@TIME; may be repeated.",
    ),
]


Out = Annotated[
    Path | None,
    typer.Option(
        parser=console.to_directory,
        metavar="DIR",
        help="For the results. Default: out/ROBOT-TERRAIN-PLANNER-SEED and what else differs from the defaults.",
    ),
]


def run(
    scenario: Scenario = None,
    robot: Robot = None,
    terrain: RunTerrain = None,
    difficulty: Difficulty = None,
    planner: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Who plans: quadpips, s_mpc, em_mpc, lf_mpc or motion_models. Default: quadpips."),
    ] = None,
    regions: Annotated[
        str | None, typer.Option(metavar="NAME", help="Where planar regions come from. Default: superpixels.")
    ] = None,
    seed: Seed = None,
    start: Start = None,
    goal: Annotated[str | None, typer.Option(metavar="X,Y", help="Goal, m. Default: the terrain's.")] = None,
    spawn: Spawn = None,
    push: Pushes = None,
    duration: Annotated[
        float | None, typer.Option(parser=console.seconds, metavar="S", help="Longest simulated time, s. Default: 120.")
    ] = None,
    latency: Latency = None,
    threads: Threads = None,
    out: Out = None,
    overwrite: Overwrite = False,
    meshcat: Annotated[bool, typer.Option("--meshcat", help="Show the run in a browser; prints the address.")] = False,
    meshcat_host: MeshcatHost = None,
    no_recording: NoRecording = False,
    film: Film = None,
    rerun: Rerun = None,
    profile: Profile = False,
    explain: Explain = False,
    sets: Sets = None,
):
    """Let a robot walk from start to goal by its own camera, in simulation.

    Writes result.json, report.html and recording.html (open offline in a browser), config.yaml (all values used) and log.npz
    into DIR.
    """
    options = {"robot": robot, "terrain": terrain, "planner": planner, "seed": seed, "duration": duration}
    options |= {"latency": latency, "threads": threads, "difficulty": difficulty}
    options |= {"spawn": spawn or None, "pushes": pushes_of(push)}
    options["start"] = None if start is None else console.numbers("--start", start, "X,Y,YAW")
    options["goal"] = None if goal is None else console.numbers("--goal", goal, "X,Y")
    chosen = [] if regions is None else [f"stages.region_source={regions}"]
    config = resolve_trial_config(scenario, {k: v for k, v in options.items() if v is not None}, chosen + (sets or []))
    from quadpips_drake.trials.trial import run_trial

    wanted = {"overwrite": overwrite, "profile": profile, "explain": explain, "film": film, "rerun": rerun}
    wanted |= {"meshcat_host": watched_from(meshcat, meshcat_host), "recording": not no_recording}
    raise typer.Exit(run_and_report(run_trial, config, out or default_directory(config), **wanted))


def resolve_trial_config(scenario: Path | None, options: dict, sets: list[str]):
    """Returns the TrialConfig that scenario file, options and overrides make together; see ``resolve``."""
    from quadpips_drake.trials.trial import TrialConfig
    from quadpips_drake.trials.walk_trial import WalkTrialConfig

    return resolve(TrialConfig, WalkTrialConfig, "walk", scenario, options, sets)


def default_directory(config) -> Path:
    """Returns where the results of the TrialConfig go unless the user says otherwise: somewhere else for each trial."""
    from quadpips_drake.trials.directory_name import directory_name

    names = {"robot": config.robot, "terrain": config.terrain, "planner": config.planner, "seed": config.seed}
    return Path("out") / directory_name(config, resolve_trial_config(None, names, []), *names.values())
