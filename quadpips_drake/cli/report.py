"""``quadpips report``: pages that explain trials, from the files that these have left."""

from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli import console
from quadpips_drake.errors import UserInputError

EPILOG = """
Examples:

  quadpips report out/anymal_c-flat-quadpips-0      writes report.html there anew

  quadpips report out/A out/B --out a_and_b.html    and compares both on one page

Exit status: 0 written, 2 bad input.
"""


def report(
    folders: Annotated[
        list[Path], typer.Argument(metavar="DIR...", help="Directories that 'quadpips run' or 'walk' has written.")
    ],
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="For the comparison of several. Default: comparison.html.")
    ] = None,
):
    """Explain trials: how they went and, after a failure, why; several of them side by side.

    Writes report.html into each DIR from its result.json, log.npz and config.yaml, and says in three lines what it says.
    """
    from quadpips_drake.trials.reporting.comparison_page import MOST
    from quadpips_drake.trials.reporting.reading import read_record
    from quadpips_drake.trials.reporting.report import compare, tell, write_report

    if len(folders) > MOST:
        raise UserInputError(f"at most {MOST} directories can be compared, not {len(folders)}")
    if out is not None and len(folders) == 1:
        raise UserInputError("--out is for the comparison of several directories; give another one")
    records = [read_record(folder) for folder in folders]
    trials = []
    for record in records:
        found = write_report(record)
        trials.append((record, found))
        for line in tell(record, found):
            console.say(line)
    if len(trials) > 1:
        place = out or Path("comparison.html")
        compare(trials, place)
        console.say(f"compared:  {place} (open it in a browser)")
