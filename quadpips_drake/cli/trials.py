"""What the commands share that simulate: where results go, their progress, and what is said at the end."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import BarColumn, Progress, TextColumn

from quadpips_drake.cli import console
from quadpips_drake.cli.film import make_film_with_progress
from quadpips_drake.cli.warming import compile_kernels
from quadpips_drake.errors import UserInputError

# Options that mean the same with every command that simulates.
Scenario = Annotated[
    Path | None, typer.Argument(metavar="SCENARIO", help="YAML file with any of the keys of a saved config.yaml.")
]
Robot = Annotated[str | None, typer.Option(metavar="NAME|FILE", help="anymal_c, go2, or a robot.yaml. Default: anymal_c.")]
Seed = Annotated[int | None, typer.Option(metavar="N", help="Of all random numbers. Default: 0.")]
Start = Annotated[str | None, typer.Option(metavar="X,Y,YAW", help="Start, m and rad. Default: the terrain's.")]
RunTerrain = Annotated[
    str | None,
    typer.Option(metavar="NAME|FILE", help="See 'quadpips terrain list', or a file. Default: stepping_stones."),
]
Difficulty = Annotated[
    float | None,
    typer.Option(metavar="X", help="How hard the terrain is: the one number of it that 'quadpips terrain list' names."),
]
Profile = Annotated[
    bool, typer.Option("--profile", help="Also write profile.html: where the computing time of the simulation went.")
]
Explain = Annotated[
    bool, typer.Option("--explain", help="Also write explain.html: how each plan came about, and what went wrong first.")
]
NoRecording = Annotated[bool, typer.Option("--no-recording", help="Do not write recording.html.")]
Film = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Also make a film, .mp4 or .gif, at the end; see 'quadpips film --help'."),
]
Rerun = Annotated[
    Path | None,
    typer.Option(metavar="FILE.rrd", help="Also write what happens for the viewer Rerun; needs the package rerun-sdk."),
]
Sets = Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Replace one value; may be repeated.")]
Latency = Annotated[
    str | None,
    typer.Option(
        metavar="NAME|FILE",
        help="How much later results are there in simulated time: measured, paper, zero, or a file of 'evaluate latency'.",
    ),
]
Threads = Annotated[
    int | None,
    typer.Option(metavar="1|2", help="2: late results are computed on a second core meanwhile; the numbers are the same."),
]
Pushes = Annotated[
    list[str] | None,
    typer.Option(
        metavar="N,E,W,T0,DT", help="Force on the base along x, y, z of the world, N, from T0 for DT s; repeatable."
    ),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace the results that DIR holds already.")]
MeshcatHost = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Where Meshcat listens; * for the whole network. Default: this machine alone."),
]
LINE_PERIOD = 5.0
"""Simulated time between two lines of progress where no bar can be drawn [s]."""

PAGES = {
    "recording": "recording.html",
    "report": "report.html",
    "explained": "explain.html",
    "profile": "profile.html",
}
"""What is said at the end about the pages that a trial has written, in this order."""

LOCAL = "localhost"
"""Where only this machine can watch."""


class RunProgress:
    """Shows simulated time and real-time factor: a bar on a terminal, else a line now and then."""

    def __init__(self, duration: float):
        self._duration = duration
        self._first: tuple[float, float] | None = None
        self._next_line = 0.0
        self._said = ""
        columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[status]}"))
        self._bar = Progress(*columns, console=console.messages, transient=True)
        self._task = self._bar.add_task("starting", total=duration, status="")

    def __enter__(self):
        if console.messages.is_terminal:
            self._bar.start()
        return self

    def __exit__(self, *_):
        if console.messages.is_terminal:
            self._bar.stop()

    def warm_up(self) -> None:
        """Compiles the numerical kernels where that has not happened yet; that has a bar of its own."""
        self.__exit__()
        compile_kernels()
        self.__enter__()

    def announce(self, text: str) -> None:
        """Takes what goes on beside the simulation itself."""
        if text == self._said:
            return
        self._said = text
        if console.messages.is_terminal:
            self._bar.update(self._task, description="", status=console.printable(text))
        else:
            console.messages.print(text, markup=False)

    def __call__(self, sim_time: float) -> None:
        """Takes the simulated time [s]."""
        from quadpips_drake.compiling import work_clock

        self._said = ""
        now = work_clock()
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


def run_and_report(
    simulate: Callable,
    config,
    out: Path,
    *,
    recording: bool,
    overwrite: bool,
    meshcat_host: str | None,
    film: Path | None = None,
    rerun: Path | None = None,
    **options,
) -> int:
    """Runs a trial, prints what came out and returns the exit status.

    Args:
        simulate: run_trial or run_walk.
        config: its configuration.
        out: directory for the files.
        recording: whether to write recording.html.
        overwrite: whether earlier results in ``out`` may be replaced.
        meshcat_host: address on which a browser can watch the trial; None: no browser.
        film: where to make a film of it at the end; None: nowhere.
        rerun: file of Rerun to write; None: none.
        options: further keyword arguments of ``simulate``.
    """
    _check_names(film, rerun, out)
    browser = None if meshcat_host is None else _meshcat(meshcat_host)
    before = _contents(out)
    try:
        with RunProgress(config.duration) as progress:
            options |= {"meshcat": browser, "progress": progress, "announce": progress.announce}
            options |= {"warm_up": progress.warm_up, "rerun": rerun}
            result = simulate(config, out, recording=recording, overwrite=overwrite, **options)
    except KeyboardInterrupt as interrupt:
        written = [name for name, state in _contents(out).items() if before.get(name) != state]
        what = f"what was simulated so far lies in {out}: {', '.join(written)}" if written else "nothing was written"
        console.end_interrupted(interrupt, what)
    ended = f"{result.reason.replace('_', ' ')} after {result.sim_time:.1f} s"
    detail = f": {result.detail}" if result.detail else ""
    console.say(
        f"{'success' if result.success else 'failure'}: {ended} (real-time factor {result.realtime_factor:.2f}){detail}"
    )
    for command in result.walk.get("commands", ()):
        _tell_command(command)
    _tell_files(out, result, film, rerun)
    return console.SUCCESS if result.success else console.FAILURE


def _tell_files(out: Path, result, film: Path | None, rerun: Path | None) -> None:
    """Says what lies where, and why it failed; and makes the film."""
    from quadpips_drake.trials.reporting.post_mortem import repeating
    from quadpips_drake.trials.reporting.words import last_lines

    there = _contents(out)
    for name, file in PAGES.items():
        if file in there:
            console.say(f"{name + ':':10} {out / file} (open it in a browser)")
    if "result.json" in there:
        console.say(f"result:    {out / 'result.json'}")
    for line in last_lines(result, repeating(not result.planner, out)):
        console.say(line)
    if rerun is not None and rerun.is_file():
        console.say(f"rerun:     {rerun} (open it with: rerun {rerun})")
    if film is not None:
        if result.sim_time > 0.0:
            make_film_with_progress(out, film)
        else:
            console.say("film:      none, because the trial never began")


def _check_names(film: Path | None, rerun: Path | None, out: Path) -> None:
    """Raises UserInputError now for what could not be written at the end."""
    if film is not None:
        from quadpips_drake.visualization.film.encoding import check_film_name

        check_film_name(film, out)
    if rerun is not None:
        from quadpips_drake.visualization.replaying.rerun_stream import check_rerun_name

        check_rerun_name(rerun, out)


def resolve(schema: type, other: type, command: str, scenario: Path | None, options: dict, sets: list[str]):
    """Returns the configuration that scenario file, options and overrides make together; see ``resolve_config``.

    Args:
        schema: TrialConfig or WalkTrialConfig.
        other: the other one of them.
        command: for which files of that kind are.
        scenario: YAML file, or None.
        options: top-level keys of the schema.
        sets: texts of the form key=value.

    Raises:
        UserInputError: something in them is unknown or of the wrong type, or the file is one of the other kind.
    """
    from quadpips_drake.trials.trial_options import resolve_config

    def is_for(kind: type) -> bool:
        try:
            resolve_config(kind, scenario, {}, [])
        except UserInputError:
            return False
        return True

    try:
        return resolve_config(schema, scenario, options, sets)
    except UserInputError:
        if scenario is not None and is_for(other) and not is_for(schema):
            raise UserInputError(f"{scenario}: this is a configuration for 'quadpips {command}'; use that") from None
        raise


def pushes_of(texts: list[str] | None) -> list[dict] | None:
    """All ``--push`` as the keys of Push; None without any."""
    return [_push(text) for text in texts] if texts else None


def _push(text: str) -> dict:
    *force, time, duration = console.numbers("--push", text, "N,E,W,T0,DT")
    return {"force": force, "time": time, "duration": duration}


def watched_from(meshcat: bool, host: str | None) -> str | None:
    """The address on which Meshcat is to listen, from ``--meshcat`` and ``--meshcat-host``; None: there is to be none."""
    return host if host is not None else LOCAL if meshcat else None


def _tell_command(command: dict) -> None:
    """Prints how a stretch of a walk went, if it was long enough to be judged."""

    def words(key: str) -> str:
        return ", ".join(f"{v:.2f}" for v in command[key])

    limit = f"; the legs allow {words('feasible_velocity')} in this gait" if "feasible_velocity" in command else ""
    asked = f"{words('velocity')} was asked of {command['gait']}{limit}"
    if "mean_velocity" in command:
        console.say(f"velocity:  {words('mean_velocity')} in the mean (forward, left m/s; turn rad/s), {asked}")
    elif limit:
        console.say(f"velocity:  {asked} (forward, left m/s; turn rad/s)")


def _meshcat(host: str):
    """A Meshcat that listens on ``host``; says where it can be watched."""
    from quadpips_drake.visualization.recording import make_quiet_meshcat

    browser = make_quiet_meshcat(host=host)
    console.messages.print(f"watch it at {browser.web_url()}", markup=False)
    return browser


def _contents(out: Path) -> dict[str, tuple[int, int]]:
    """Files in ``out`` that are no hidden ones; each with what changes when it is written anew."""
    if not os.path.isdir(out):
        return {}
    files = [path for path in sorted(out.iterdir()) if path.is_file() and not path.name.startswith(".")]
    return {path.name: (path.stat().st_ino, path.stat().st_mtime_ns) for path in files}
