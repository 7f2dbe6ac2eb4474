"""``quadpips evaluate gaits`` and ``... robustness``: studies of walking by velocity command."""

from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli.console import FAILURE, SUCCESS, messages, say, seconds, to_directory
from quadpips_drake.cli.warming import compile_kernels
from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.trials.result_directory import ResultDirectory

EPILOG_GAITS = """
Examples:

  quadpips evaluate gaits --seeds 100,101 --robots go2

  quadpips evaluate gaits --workers 2              both robots, five seeds: some 140 walks of 10 s

What has been computed is kept in DIR/gaits.json and not computed again, after Ctrl-C too.

Exit status: 0 done, 1 some trials ended without a result, 2 bad input.
"""

EPILOG_ROBUSTNESS = """
Examples:

  quadpips evaluate robustness --only payload,mpc_delay --robots go2

  quadpips evaluate robustness --target-only --workers 2

Disturbances: push_phase_0 ... push_phase_4, slipperiness, slope_up, slope_down, slope_across, bumps, payload, mpc_delay,
actuator_delay, solver_fault, ground_believed_higher, ground_believed_lower. What has been computed is kept in
DIR/robustness.json and not computed again, after Ctrl-C too.

Exit status: 0 done, 1 some trials ended without a result, 2 bad input.
"""

Robots = Annotated[str, typer.Option(metavar="A,B", help="Which robots.")]
Workers = Annotated[int, typer.Option(min=1, metavar="N", help="Trials at the same time.")]


def gaits(
    robots: Robots = "anymal_c,go2",
    seeds: Annotated[str, typer.Option(metavar="N,N,...", help="Seeds of the trials.")] = "100,101,102,103,104",
    duration: Annotated[float, typer.Option(parser=seconds, metavar="S", help="Of each walk, s.")] = 10.0,
    workers: Workers = 1,
    out: Annotated[Path, typer.Option(parser=to_directory, metavar="DIR", help="For gaits.json.")] = Path("out/gaits"),
):
    """Walk in every gait, and trot forwards, sideways and turning, on flat ground; print a markdown table."""
    from quadpips_drake.benchmark import gait_study
    from quadpips_drake.benchmark.study_pool import load_results

    known, numbers = known_robots(robots), known_seeds(seeds)
    with ResultDirectory(out, ()):  # what it holds is kept, and added to
        results = load_results(out / gait_study.STORE)
        compile_kernels()  # rather than in each of the workers
        done = gait_study.run_gaits(known, numbers, out, results, duration=duration, workers=workers)
    say(gait_study.table(done.results))
    raise typer.Exit(status_of(done))


def robustness(
    robots: Robots = "anymal_c,go2",
    only: Annotated[str, typer.Option(metavar="A,B", help="Which disturbances. Default: all.")] = "",
    seeds: Annotated[
        str, typer.Option(metavar="N,N,...", help="Of the trials at the targets; the first one is bisected with.")
    ] = "100,101,102,103,104",
    target_only: Annotated[bool, typer.Option("--target-only", help="Try the targets alone, without bisection.")] = False,
    workers: Workers = 1,
    out: Annotated[
        Path, typer.Option(parser=to_directory, metavar="DIR", help="For robustness.json and terrain files.")
    ] = Path("out/robustness"),
):
    """Find the largest push, slope, delay ... that a trotting robot survives; print a markdown table."""
    from quadpips_drake.benchmark import robustness as study
    from quadpips_drake.benchmark.disturbances import DISTURBANCES
    from quadpips_drake.benchmark.study_pool import load_results

    names = only.split(",") if only else list(DISTURBANCES)
    for name in names:
        if name not in DISTURBANCES:
            raise unknown_name("disturbance", name, DISTURBANCES)
    known, numbers = known_robots(robots), known_seeds(seeds)
    with ResultDirectory(out, ()):  # what it holds is kept, and added to
        results = load_results(out / study.STORE)
        compile_kernels()
        done = study.run_robustness(known, names, numbers, out, results, bisect=not target_only, workers=workers)
    say(study.table(done.results, known, names))
    raise typer.Exit(status_of(done))


def status_of(done) -> int:
    """Exit status of a study, and a line when something is missing in it."""
    if not done.failed:
        return SUCCESS
    messages.print(f"{len(done.failed)} jobs ended without a result, see above; the same command tries them again")
    return FAILURE


def known_robots(text: str) -> list[str]:
    """The robots of ``A,B``; raises UserInputError for an unknown one."""
    from quadpips_drake.robots.robot_library import robot_names

    names = text.split(",")
    for name in names:
        if name not in robot_names():
            raise unknown_name("robot", name, robot_names())
    return names


def known_seeds(text: str) -> list[int]:
    """The seeds of ``N,N,...``; raises UserInputError where it is not of that form."""
    try:
        seeds = [int(word) for word in text.split(",")]
    except ValueError:
        seeds = []
    if not seeds or min(seeds) < 0:
        raise UserInputError(f"--seeds '{text}' is not of the form N,N,... (whole numbers with commas and without spaces)")
    return seeds
