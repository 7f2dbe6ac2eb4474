"""``quadpips evaluate growth``: how computing time and memory grow with the size of what is computed."""

from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli.console import say, to_directory
from quadpips_drake.cli.evaluation.evaluate_tracking import status_of
from quadpips_drake.errors import unknown_name
from quadpips_drake.trials.result_directory import ResultDirectory

EPILOG = """
Examples:

  taskset -c 0 quadpips evaluate growth

  quadpips evaluate growth --only knots,regions

Families: elements (of the terrain), image (pixels), knots (of the optimal control problem), regions. Times are medians of
CPU seconds of the process; each size has a process of its own, for its memory. What has been measured is kept in
DIR/growth.json and not measured again, after Ctrl-C too.

Exit status: 0 done, 1 some sizes ended without a result, 2 bad input.
"""


def growth(
    only: Annotated[str, typer.Option(metavar="A,B", help="Which families. Default: all.")] = "",
    quick: Annotated[bool, typer.Option("--quick", help="Two small sizes of each, to see that it works.")] = False,
    out: Annotated[
        Path, typer.Option(parser=to_directory, metavar="DIR", help="For growth.json, exponents.json and growth.png.")
    ] = Path("out/growth"),
):
    """Measure computing time and memory against terrain elements, pixels, knots and regions, and fit exponents."""
    from quadpips_drake.benchmark import growth as study
    from quadpips_drake.benchmark.growth_picture import save_report
    from quadpips_drake.benchmark.study_pool import load_results

    names = only.split(",") if only else list(study.FAMILIES)
    for name in names:
        if name not in study.FAMILIES:
            raise unknown_name("family", name, study.FAMILIES)
    with ResultDirectory(out, ()):  # what it holds is kept, and added to
        done = study.run_growth(names, out, load_results(out / study.STORE), quick=quick)
        save_report(done.results, names, out, quick=quick)
    _print_table(study.table_rows(done.results, names, quick=quick))
    say(f"curves: {out / study.PICTURE}")
    raise typer.Exit(status_of(done))


def _print_table(rows: list[tuple]) -> None:
    from rich import print as show
    from rich.table import Column, Table

    table = Table(Column(no_wrap=True), "smallest", "largest", "exponent", title="growth of CPU time and memory")
    family = None
    for counted, *cells in rows:
        if counted != family:
            table.add_section()
            table.add_row(f"[bold]{counted}[/]")
        family = counted
        table.add_row(*cells)
    show(table)
