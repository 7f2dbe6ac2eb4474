"""``quadpips run``: one trial from start to goal."""

import time
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import BarColumn, Progress, TextColumn

from quadpips_drake.cli import console
from quadpips_drake.errors import unknown_name

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

LINE_PERIOD = 5.0
"""Simulated time between two lines of progress where no bar can be drawn [s]."""


def run(
    scenario: Annotated[
        Path | None, typer.Argument(metavar="SCENARIO", help="YAML file with any of the keys of a saved config.yaml.")
    ] = None,
    robot: Annotated[str | None, typer.Option(metavar="NAME", help="anymal_c or go2. Default: anymal_c.")] = None,
    terrain: Annotated[
        str | None,
        typer.Option(metavar="NAME|FILE", help="See 'quadpips terrain list', or a file. Default: stepping_stones."),
    ] = None,
    planner: Annotated[str | None, typer.Option(metavar="NAME", help="Who plans. Default: quadpips.")] = None,
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
    config = resolve_trial_config(scenario, {k: v for k, v in options.items() if v is not None}, sets or [])
    out = console.writable_directory(out or default_directory(config))
    raise typer.Exit(_run_and_report(config, out, recording=not no_recording, meshcat=meshcat))


def resolve_trial_config(scenario: Path | None, options: dict, sets: list[str]):
    """Lays the robot's defaults, the scenario file, the options and the ``--set`` overrides over the defaults in code.

    Args:
        scenario: YAML file, or None.
        options: top-level keys of TrialConfig.
        sets: texts of the form key=value.

    Returns: the TrialConfig.

    Raises:
        UserInputError: something in them is unknown or of the wrong type.
    """
    from quadpips_drake.benchmark.trial import TrialConfig
    from quadpips_drake.config import ConfigLayer, load_config, override_layer, read_layer, robot_defaults_layer
    from quadpips_drake.robots.robot_model import robot_names

    layers = [read_layer(scenario)] if scenario else []
    layers += [ConfigLayer("--" + key, {key: value}) for key, value in options.items()]
    layers += [override_layer(text) for text in sets]
    robot = load_config(TrialConfig, layers).robot
    if robot not in robot_names():
        raise unknown_name("robot", robot, robot_names())
    return load_config(TrialConfig, [robot_defaults_layer(robot).under("stages"), *layers])


def default_directory(config) -> Path:
    """Returns where the results of the TrialConfig go unless the user says otherwise."""
    return Path("out") / f"{config.robot}-{Path(config.terrain).stem}-{config.planner}-{config.seed}"


class RunProgress:
    """Shows simulated time and real-time factor: a bar on a terminal, else a line now and then."""

    def __init__(self, duration: float):
        self._duration = duration
        self._first: tuple[float, float] | None = None
        self._next_line = 0.0
        columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[status]}"))
        self._bar = Progress(*columns, console=console.messages, transient=True)
        self._task = self._bar.add_task("building", total=duration, status="the first run compiles for a minute or two")

    def __enter__(self):
        if console.messages.is_terminal:
            self._bar.start()
        else:
            console.messages.print("building (the first run compiles for a minute or two)")
        return self

    def __exit__(self, *_):
        if console.messages.is_terminal:
            self._bar.stop()

    def __call__(self, sim_time: float) -> None:
        """Takes the simulated time [s]."""
        now = time.perf_counter()
        if self._first is None:
            self._first = (sim_time, now)
        first_sim_time, first_now = self._first
        status = f"{sim_time:5.1f} of at most {self._duration:g} s"
        if sim_time > first_sim_time:
            status += f", real-time factor {(sim_time - first_sim_time) / max(now - first_now, 1e-9):.2f}"
        if console.messages.is_terminal:
            self._bar.update(self._task, completed=sim_time, description="walking ", status=status)
        elif sim_time >= self._next_line:
            console.messages.print(status)
            self._next_line = sim_time + LINE_PERIOD


def _run_and_report(config, out: Path, *, recording: bool, meshcat: bool) -> int:
    """Runs the trial of the TrialConfig, prints what came out and returns the exit status."""
    from quadpips_drake.benchmark.trial import run_trial

    browser = None
    if meshcat:
        from pydrake.geometry import Meshcat

        browser = Meshcat()
        console.messages.print(f"watch it at {browser.web_url()}")
    try:
        with RunProgress(config.duration) as progress:
            result = run_trial(config, out, recording=recording, meshcat=browser, progress=progress)
    except KeyboardInterrupt:
        console.messages.print(f"interrupted; what was simulated so far lies in {out}")
        return console.INTERRUPTED
    ended = f"{result.reason.replace('_', ' ')} after {result.sim_time:.1f} s"
    detail = f": {result.detail}" if result.detail else ""
    typer.echo(
        f"{'success' if result.success else 'failure'}: {ended} (real-time factor {result.realtime_factor:.2f}){detail}"
    )
    if recording:
        typer.echo(f"recording: {out / 'recording.html'} (open it in a browser)")
    typer.echo(f"result:    {out / 'result.json'}")
    return console.SUCCESS if result.success else console.FAILURE
