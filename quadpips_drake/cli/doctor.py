"""``quadpips doctor``: is this machine able to run the simulation?"""

import os
import platform
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli import console
from quadpips_drake.cli.warming import compile_kernels
from quadpips_drake.solvers.missing_solver import MissingSolverError
from quadpips_drake.worker_pool import available_cores, run_jobs

OK, NOTE, FAIL = "OK", "NOTE", "FAIL"
_COLORS = {OK: "green", NOTE: "yellow", FAIL: "red"}
STANDING_TIME = 1.0
"""Simulated time of the standing robot [s]."""


class CheckFailed(Exception):
    """A check that failed; the message says what is wrong."""


class CheckNoted(Exception):
    """A check that found something worth knowing, which is no failure; the message says what."""


@dataclass(frozen=True)
class Check:
    """One line of the report."""

    name: str
    run: Callable[[], str]
    """Returns a remark, or raises anything when the check fails."""
    remedy: str
    """What to do when it fails."""
    optional: bool = False
    """Whether a missing package is a remark and no failure."""
    isolated: bool = False
    """Whether to run in a process of its own, because a missing system library may end the process."""


def doctor(
    warm: Annotated[
        bool, typer.Option("--warm", help="Check nothing, but compile all numerical kernels that are not compiled yet.")
    ] = False,
):
    """Check this machine: Python, Drake, rendering, solvers, cores, caches, and one second of standing.

    Each line says OK, FAIL (the next one says what to do) or NOTE (something is missing that only some settings need).
    Exit status: 0 nothing failed, 1 something did.
    """
    if warm:
        try:
            raise typer.Exit(console.SUCCESS if compile_kernels() else console.FAILURE)
        except KeyboardInterrupt as interrupt:
            console.end_interrupted(interrupt, "what has been compiled so far is kept")
    output = console.PlainConsole(highlight=False, soft_wrap=True)
    failures = 0
    for check in checks():
        with output.status(check.name):
            verdict, remark = outcome(check)
        failures += verdict == FAIL
        output.print(f"[{_COLORS[verdict]}]{verdict:4}[/]", end=" ")
        output.print(f"{check.name}: {remark}", markup=False)
        if verdict == FAIL:
            output.print(f"     -> {check.remedy}", markup=False)
    if failures:
        output.print(f"{failures} of {len(list(checks()))} checks failed")
    raise typer.Exit(console.FAILURE if failures else console.SUCCESS)


def checks() -> Iterator[Check]:
    """The checks, cheap ones first."""
    reinstall = "install the pinned versions: pip install -c constraints.txt -e . (or: make clean setup)"
    yield Check("Python", _python, "use Python 3.11 or newer")
    yield Check("Drake", _drake, reinstall, isolated=True)
    yield Check("processor cores", _cores, "use a machine with 2 cores or more; with one it works, slowly")
    yield Check("compiled-code cache", _numba_cache, "make the package's folder writable, or set NUMBA_CACHE_DIR")
    yield Check("compiled kernels", _kernels, reinstall)
    for solver in ("PIQP", "ProxQP", "OSQP", "Clarabel"):
        optional = solver == "ProxQP"  # no default names it, and PIQP is what all are made with
        yield Check(f"solver {solver}", partial(_solve, solver.lower()), reinstall, optional, isolated=True)
    egl = "install libEGL; on Debian or Ubuntu: apt install libegl1 libgl1"
    yield Check("depth camera (EGL)", _render, egl, isolated=True)
    yield Check("films (ffmpeg)", _ffmpeg, reinstall)
    yield Check("Rerun", _rerun, reinstall)
    yield Check("standing for a second", _stand, "run 'make test' to see which part fails", isolated=True)


def outcome(check: Check) -> tuple[str, str]:
    """Returns OK, NOTE or FAIL, and the check's remark or the reason."""
    try:
        if not check.isolated:
            return OK, check.run()
        (ended,) = run_jobs({check.name: check.run}, workers=1)
        if ended.error is not None:
            raise ended.error
        return OK, ended.value
    except Exception as error:  # a doctor reports whatever the matter is
        lines = str(error).strip().splitlines()
        is_note = isinstance(error, CheckNoted) or (check.optional and isinstance(error, MissingSolverError))
        return NOTE if is_note else FAIL, lines[0] if lines else type(error).__name__


def _python() -> str:
    return f"{platform.python_version()} ({sys.executable})"  # pip lets no version in that is too old


def _drake() -> str:
    from importlib.metadata import version

    import pydrake.all  # noqa: F401  (the import is the check)

    return version("drake")


def _cores() -> str:
    cores = available_cores()
    if cores < 2:
        raise CheckFailed(f"only {cores}")
    return str(cores)


def _numba_cache() -> str:
    import numba

    import quadpips_drake

    folder = Path(numba.config.CACHE_DIR or Path(quadpips_drake.__file__).parent)
    if not os.access(folder, os.W_OK):
        raise CheckFailed(f"{folder} is not writable, so that every start would compile anew")
    return f"{folder} is writable"


def _kernels() -> str:
    from quadpips_drake.trials.warming.warm_up import EXERCISES, cold_groups

    cold = cold_groups()
    if cold:
        raise CheckNoted(f"not compiled yet: {', '.join(cold)}; the first run does it, or now: quadpips doctor --warm")
    return f"all there ({', '.join(EXERCISES)})"


def _solve(name: str) -> str:
    """Solves min (x - 1)^2 + (y - 2)^2 with x + y = 1 and y <= 0.5; the answer is (0.5, 0.5)."""
    import numpy as np
    from pydrake.solvers import MathematicalProgram

    from quadpips_drake.solvers.registry import make_solver, solve_program

    program = MathematicalProgram()
    x = program.NewContinuousVariables(2)
    program.AddQuadraticErrorCost(np.eye(2), np.array([1.0, 2.0]), x)
    program.AddLinearEqualityConstraint(np.ones((1, 2)), np.ones(1), x)
    program.AddBoundingBoxConstraint(-np.inf, 0.5, x[1])
    solution, details = solve_program(make_solver(name), program)
    if not details.success or not np.allclose(solution, 0.5, atol=1e-3):
        raise CheckFailed(f"a small quadratic program was not solved ({details.status})")
    return f"solves a small quadratic program ({1e3 * details.solve_time:.1f} ms)"


def _station(terrain: str):
    """Builds ANYmal C, standing on a terrain; returns the station and a Simulator of it with its inputs fixed."""
    import numpy as np
    from pydrake.systems.analysis import Simulator

    from quadpips_drake.diagrams.observed_station import ObservedStation
    from quadpips_drake.robots.robot_library import load_robot
    from quadpips_drake.terrain.library import load_terrain

    robot = load_robot("anymal_c")
    station = ObservedStation(robot, load_terrain(terrain))
    simulator = Simulator(station)
    context = simulator.get_mutable_context()
    station.set_initial_state(context, 0.0, 0.0, 0.0)
    station.GetInputPort("feedforward_torque").FixValue(context, np.zeros(12))
    desired = np.concatenate((robot.nominal_joints, np.zeros(12)))
    station.GetInputPort("desired_joint_state").FixValue(context, desired)
    return station, simulator


def _render() -> str:
    """Renders one depth image of the flat ground in front of the robot."""
    import numpy as np

    station, simulator = _station("flat")
    port = station.GetOutputPort("depth_image")
    simulator.Initialize()
    started = time.perf_counter()
    image = port.Eval(simulator.get_context())
    elapsed = time.perf_counter() - started
    seen = np.isfinite(image.data).mean()
    if not seen > 0.05:
        raise CheckFailed("the ground in front of the robot does not appear in the depth image")
    return f"{image.width()}x{image.height()} depth image rendered ({1e3 * elapsed:.0f} ms for the first)"


def _ffmpeg() -> str:
    from imageio_ffmpeg import get_ffmpeg_version

    return f"ffmpeg {get_ffmpeg_version()}"


def _rerun() -> str:
    from quadpips_drake.errors import UserInputError
    from quadpips_drake.visualization.replaying.rerun_stream import import_rerun

    try:
        return f"rerun-sdk {import_rerun().__version__}"
    except UserInputError:
        raise CheckNoted("not installed; only --rerun needs it: pip install -c constraints.txt -e '.[rerun]'") from None


def _stand() -> str:
    """Simulates the robot standing on the flat."""
    station, simulator = _station("flat")
    port = station.GetOutputPort("robot_state")
    before = port.Eval(simulator.get_context())
    started = time.perf_counter()
    simulator.AdvanceTo(STANDING_TIME)
    factor = STANDING_TIME / (time.perf_counter() - started)
    after = port.Eval(simulator.get_context())
    sunk = before.p_WB[2] - after.p_WB[2]
    tilt = abs(after.rpy_WB[:2]).max()
    if sunk > 0.05 or tilt > 0.1:
        raise CheckFailed(f"the robot sank by {sunk:.2f} m and tilted by {tilt:.2f} rad")
    return f"upright, real-time factor {factor:.1f}"
