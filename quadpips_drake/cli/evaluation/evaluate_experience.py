"""``quadpips evaluate experience``: what experience and steppability do for the foothold search, without a simulation."""

from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli.console import say, to_directory
from quadpips_drake.cli.evaluation.evaluate_tracking import Workers, known_robots, status_of
from quadpips_drake.cli.trials import Sets
from quadpips_drake.trials.result_directory import ResultDirectory

EPILOG = """
Examples:

  quadpips evaluate experience --terrain irregular_stones --trials 60 --seed 0 --repeats 5

  quadpips evaluate experience --modes none,steppability --labels exact --repeats 1

  quadpips evaluate experience --terrain sparse_stones --modes experience --scope general --seed 200 --repeats 20

Modes: none, experience, steppability, both; those that weigh labels run once with each kind of --labels, network and exact.
A trial is over at the goal or at the first swing that fails; a repeat, on the terrain of one seed each, at its first
success. With --scope general all repeats of a mode share one library, DIR/library-experience.npz for instance, which
'--set stages.planning.experience.file=...' takes. What has been computed is kept in DIR and not computed again, after
Ctrl-C too. docs/experience.md tells what is computed.

Exit status: 0 done, 1 some repeats ended without a result, 2 bad input.
"""


def experience(
    terrain: Annotated[str, typer.Option(metavar="NAME", help="A terrain of the library.")] = "irregular_stones",
    robot: Annotated[str, typer.Option(metavar="NAME", help="anymal_c or go2.")] = "anymal_c",
    trials: Annotated[int, typer.Option(min=1, max=10_000, metavar="N", help="Most trials of a repeat.")] = 60,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Of the first repeat's terrain.")] = 0,
    repeats: Annotated[int, typer.Option(min=1, max=1000, metavar="N", help="How many seeds.")] = 5,
    modes: Annotated[str, typer.Option(metavar="A,B", help="Which modes.")] = "none,experience,steppability,both",
    labels: Annotated[str, typer.Option(metavar="A,B", help="Whose labels.")] = "network,exact",
    scope: Annotated[str, typer.Option(metavar="NAME", help="Of the experience: site or general.")] = "site",
    overhead: Annotated[
        bool, typer.Option("--overhead", help="Only compare times of searches with and without experience and labels.")
    ] = False,
    workers: Workers = 1,
    out: Annotated[
        Path, typer.Option(parser=to_directory, metavar="DIR", help="For experience.json, experience.png and libraries.")
    ] = Path("out/experience"),
    sets: Sets = None,
):
    """Repeat search and swing optimisation until a way is found that really exists; print a table."""
    from quadpips_drake.benchmark.experience import experience_study as study
    from quadpips_drake.benchmark.experience.experience_picture import PICTURE, experience_figure
    from quadpips_drake.benchmark.study_pool import load_results
    from quadpips_drake.cli.run import resolve_trial_config
    from quadpips_drake.terrain.library import load_terrain

    (name,) = known_robots(robot)
    load_terrain(terrain)  # or it says what is wrong with it
    series = study.all_series(name, terrain, modes.split(","), labels.split(","), list(range(seed, seed + repeats)), scope)
    planning = resolve_trial_config(None, {"robot": name}, sets or []).stages.planning
    if overhead:
        from quadpips_drake.benchmark.experience.search_overhead import OVERHEAD_COLUMNS, measure_overhead, overhead_rows

        with ResultDirectory(out, ()):
            found = measure_overhead(name, terrain, list(range(seed, seed + repeats)), planning, out)
        _print_table(OVERHEAD_COLUMNS, overhead_rows(found))
        raise typer.Exit(0)
    with ResultDirectory(out, ()):  # what it holds is kept, and added to
        results = load_results(out / study.STORE)
        done = study.run_experience_study(series, trials, planning, out, results, workers=workers)
        experience_figure(series, done.results, trials).savefig(out / PICTURE, dpi=100)
    _print_table(study.COLUMNS, study.table_rows(series, done.results))
    say(f"curves: {out / PICTURE}")
    raise typer.Exit(status_of(done))


def _print_table(columns: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    from rich import print as show
    from rich.table import Table

    table = Table(*columns, title="trials without a simulation")
    for row in rows:
        table.add_row(*row)
    show(table)
