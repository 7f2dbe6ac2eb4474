"""What the commands share that simulate: their configuration, their progress, and what is said at the end."""

import time
from collections.abc import Callable
from pathlib import Path

import typer
from rich.progress import BarColumn, Progress, TextColumn

from quadpips_drake.cli import console

LINE_PERIOD = 5.0
"""Simulated time between two lines of progress where no bar can be drawn [s]."""


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


def run_and_report(simulate: Callable, config, out: Path, *, recording: bool, meshcat: bool, **options) -> int:
    """Runs a trial, prints what came out and returns the exit status.

    Args:
        simulate: run_trial or run_walk.
        config: its configuration.
        out: directory for the files.
        recording: whether to write recording.html.
        meshcat: whether to show the trial in a browser.
        options: further keyword arguments of ``simulate``.
    """
    browser = None
    if meshcat:
        from pydrake.geometry import Meshcat

        browser = Meshcat()
        console.messages.print(f"watch it at {browser.web_url()}")
    try:
        with RunProgress(config.duration) as progress:
            result = simulate(config, out, recording=recording, meshcat=browser, progress=progress, **options)
    except KeyboardInterrupt:
        console.messages.print(f"interrupted; what was simulated so far lies in {out}")
        return console.INTERRUPTED
    ended = f"{result.reason.replace('_', ' ')} after {result.sim_time:.1f} s"
    detail = f": {result.detail}" if result.detail else ""
    typer.echo(
        f"{'success' if result.success else 'failure'}: {ended} (real-time factor {result.realtime_factor:.2f}){detail}"
    )
    for command in result.walk.get("commands", ()):
        if "mean_velocity" in command:
            asked, mean = (", ".join(f"{v:.2f}" for v in command[key]) for key in ("velocity", "mean_velocity"))
            typer.echo(
                f"velocity:  {mean} in the mean (forward, left m/s; turn rad/s), {asked} was asked of {command['gait']}"
            )
    if recording:
        typer.echo(f"recording: {out / 'recording.html'} (open it in a browser)")
    typer.echo(f"result:    {out / 'result.json'}")
    return console.SUCCESS if result.success else console.FAILURE
