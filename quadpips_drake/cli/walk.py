"""``quadpips walk``: walking by velocity command, without camera and planner."""

from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli import console
from quadpips_drake.cli.trials import (
    Difficulty,
    Film,
    Latency,
    MeshcatHost,
    NoRecording,
    Overwrite,
    Profile,
    Pushes,
    Rerun,
    Robot,
    Scenario,
    Seed,
    Sets,
    Start,
    pushes_of,
    resolve,
    run_and_report,
    watched_from,
)

EPILOG = """
Examples:

  quadpips walk --gait trot --velocity 0.5,0,0

  quadpips walk --robot go2 --gait trot --velocity 0,0,0.5 --duration 20

  quadpips walk --push 0,250,0,4,0.1       250 N to the left (world y) at 4 s, for 0.1 s

  quadpips walk --terrain bumps --set stages.station.model_error.payload=10

  quadpips walk --set 'changes=[{time: 4, gait: static_walk, velocity: [0.2, 0, 0]}]'

  quadpips walk --meshcat --duration 600    sliders, buttons or a gamepad in a browser

Gaits: stance, trot, standing_trot, slow_trot, flying_trot, static_walk, standing_walk, dynamic_walk, amble, pace,
standing_pace.

Exit status: 0 upright at the end, 1 the trial failed, 2 bad input, 130 Ctrl-C, 143 SIGTERM; then all files are written, too.
"""


Out = Annotated[
    Path | None,
    typer.Option(
        parser=console.to_directory,
        metavar="DIR",
        help="For the results. Default: out/ROBOT-TERRAIN-GAIT-SEED and what else differs from the defaults.",
    ),
]


def walk(
    scenario: Scenario = None,
    robot: Robot = None,
    gait: Annotated[str | None, typer.Option(metavar="NAME", help="See below. Default: trot.")] = None,
    velocity: Annotated[
        str | None,
        typer.Option(metavar="VX,VY,WZ", help="Forward and left, m/s, and yaw rate, rad/s. Default: 0.3,0,0."),
    ] = None,
    duration: Annotated[
        float | None, typer.Option(parser=console.seconds, metavar="S", help="Simulated time, s. Default: 10.")
    ] = None,
    terrain: Annotated[
        str | None, typer.Option(metavar="NAME|FILE", help="See 'quadpips terrain list', or a file. Default: flat.")
    ] = None,
    difficulty: Difficulty = None,
    push: Pushes = None,
    latency: Latency = None,
    start: Start = None,
    seed: Seed = None,
    out: Out = None,
    overwrite: Overwrite = False,
    meshcat: Annotated[
        bool, typer.Option("--meshcat", help="Show the walk in a browser, with sliders for velocity and gait.")
    ] = False,
    meshcat_host: MeshcatHost = None,
    no_recording: NoRecording = False,
    film: Film = None,
    rerun: Rerun = None,
    profile: Profile = False,
    sets: Sets = None,
):
    """Let a robot walk by velocity command, in simulation; it sees nothing.

    Writes result.json, report.html and recording.html (open offline in a browser), config.yaml (all values used) and log.npz
    into DIR.
    """
    options = {"robot": robot, "gait": gait, "terrain": terrain, "seed": seed, "duration": duration, "latency": latency}
    options["difficulty"] = difficulty
    options["velocity"] = None if velocity is None else console.numbers("--velocity", velocity, "VX,VY,WZ")
    options["start"] = None if start is None else console.numbers("--start", start, "X,Y,YAW")
    options["pushes"] = pushes_of(push)
    from quadpips_drake.trials.walk_trial import run_walk

    config = resolve_walk_config(scenario, {k: v for k, v in options.items() if v is not None}, sets or [])
    host = watched_from(meshcat, meshcat_host)
    wanted = {"overwrite": overwrite, "profile": profile, "film": film, "rerun": rerun, "recording": not no_recording}
    wanted |= {"meshcat_host": host, "panel": host is not None}
    raise typer.Exit(run_and_report(run_walk, config, out or default_directory(config), **wanted))


def resolve_walk_config(scenario: Path | None, options: dict, sets: list[str]):
    """Returns the WalkTrialConfig that scenario file, options and overrides make together; see ``resolve``."""
    from quadpips_drake.trials.trial import TrialConfig
    from quadpips_drake.trials.walk_trial import WalkTrialConfig

    return resolve(WalkTrialConfig, TrialConfig, "run", scenario, options, sets)


def default_directory(config) -> Path:
    """Returns where the results of the WalkTrialConfig go unless the user says otherwise: somewhere else for each walk."""
    from quadpips_drake.trials.directory_name import directory_name

    names = {"robot": config.robot, "terrain": config.terrain, "gait": config.gait, "seed": config.seed}
    return Path("out") / directory_name(config, resolve_walk_config(None, names, []), *names.values())
