"""``quadpips evaluate latency`` and ``... latency-sweep``: computing time as simulated time."""

from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli.console import say, to_directory
from quadpips_drake.cli.evaluation.evaluate_tracking import Workers, known_robots, known_seeds, status_of
from quadpips_drake.errors import UserInputError
from quadpips_drake.trials.result_directory import ResultDirectory

EPILOG_LATENCY = """
Examples:

  taskset -c 0 quadpips evaluate latency --robots go2

  quadpips run --robot go2 --latency out/latency/latency-go2.yaml

Run it on a calm machine, on one core. What comes out is a file for --latency; that of the package, the preset "measured",
lies beside each robot's robot.yaml as latency.yaml.

Exit status: 0 done, 1 some runs ended without a result, 2 bad input.
"""

EPILOG_SWEEP = """
Examples:

  quadpips evaluate latency-sweep --terrains flat --factors 0,1,4 --seeds 0,1

What has been computed is kept in DIR/latency.json and not computed again, after Ctrl-C too.

Exit status: 0 done, 1 some runs ended without a result, 2 bad input.
"""

Terrains = Annotated[str, typer.Option(metavar="A,B", help="Which terrains.")]


def latency(
    robots: Annotated[str, typer.Option(metavar="A,B", help="Which robots.")] = "anymal_c,go2",
    terrains: Terrains = "stepping_stones,stairs",
    seeds: Annotated[str, typer.Option(metavar="N,N,...", help="Seeds of the runs.")] = "0,1",
    out: Annotated[
        Path, typer.Option(parser=to_directory, metavar="DIR", help="For latency-ROBOT.yaml and latency.json.")
    ] = Path("out/latency"),
):
    """Measure how long each stage computes and write it as latencies of a preset, one file for each robot."""
    from quadpips_drake.benchmark import latency_study as study
    from quadpips_drake.benchmark.study_pool import load_results

    known, names, numbers = known_robots(robots), _known_terrains(terrains), known_seeds(seeds)
    with ResultDirectory(out, ()):  # what it holds is kept, and added to
        done = study.run_measurement(known, names, numbers, out, load_results(out / study.STORE))
        for robot in known:
            if any(key.startswith(f"{robot}/") for key in done.results):
                path = study.write_preset(robot, done.results, out)
                say(f"{path}:\n{path.read_text(encoding='utf-8')}")
    raise typer.Exit(status_of(done))


def latency_sweep(
    robot: Annotated[str, typer.Option(metavar="NAME", help="Which robot.")] = "anymal_c",
    terrains: Terrains = "flat,stairs,stepping_stones",
    factors: Annotated[str, typer.Option(metavar="X,X,...", help="On all latencies.")] = "0.5,1,2,4",
    seeds: Annotated[str, typer.Option(metavar="N,N,...", help="Seeds of the runs.")] = "0,1,2,3,4",
    latency: Annotated[str, typer.Option(metavar="NAME|FILE", help="The latencies with factor 1.")] = "measured",
    workers: Workers = 1,
    out: Annotated[
        Path, typer.Option(parser=to_directory, metavar="DIR", help="For latency.json and latency_sweep.png.")
    ] = Path("out/latency_sweep"),
):
    """Run with all latencies scaled, and show how many runs still reach the goal; print a markdown table."""
    from quadpips_drake.benchmark import latency_study as study
    from quadpips_drake.benchmark.latency_picture import sweep_figure
    from quadpips_drake.benchmark.study_pool import load_results
    from quadpips_drake.robots.stage_latencies import latency_layer

    known, names, numbers = known_robots(robot), _known_terrains(terrains), known_seeds(seeds)
    latency_layer(latency, known[0])  # or it says what is wrong with it
    sweep = study.LatencySweep(known[0], tuple(names), _known_factors(factors), tuple(numbers), latency)
    sweep.check()
    with ResultDirectory(out, ()):
        done = sweep.run(out, load_results(out / study.STORE), workers=workers)
        if done.results:
            sweep_figure(done.results).savefig(out / "latency_sweep.png", dpi=100)
    say(study.table(done.results))
    raise typer.Exit(status_of(done))


def _known_terrains(text: str) -> list[str]:
    from quadpips_drake.terrain.library import load_terrain

    names = text.split(",")
    for name in names:
        load_terrain(name)
    return names


def _known_factors(text: str) -> tuple[float, ...]:
    try:
        factors = tuple(float(word) for word in text.split(","))
    except ValueError:
        factors = ()
    if not factors or not all(0.0 <= factor <= 100.0 for factor in factors):
        raise UserInputError(f"--factors '{text}' is not of the form X,X,... (numbers of 0 to 100, without spaces)")
    return factors
