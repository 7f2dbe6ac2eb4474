"""The command ``quadpips``. Heavy modules are imported inside the commands, so that ``--help`` answers at once."""

import os

# The matrices are small: BLAS threads cost more than they bring, and with one thread sums have one order, so that the
# same seed gives the same bits. It has to be said before NumPy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from typing import Annotated

import typer

from quadpips_drake import __version__
from quadpips_drake.cli import bench, cockpit, dataset, diagram, doctor, film, report, run, terrain, train, walk
from quadpips_drake.cli.console import OneLineErrors
from quadpips_drake.cli.evaluation import evaluate
from quadpips_drake.cli.learned_footholds import learned_footholds
from quadpips_drake.cli.motion_models import motion_models

EPILOG = """
Try 'quadpips doctor' first, then 'quadpips run'; each command explains itself with --help.
"""

app = typer.Typer(
    cls=OneLineErrors,
    name="quadpips",
    help="A quadruped sees rough ground with a depth camera, decides where to step and walks there, simulated in Drake.",
    epilog=EPILOG,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool):
    if wanted:
        typer.echo(f"quadpips_drake {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version and exit.")
    ] = False,
):
    pass


app.command(epilog=run.EPILOG)(run.run)
app.command(epilog=walk.EPILOG)(walk.walk)
app.command(epilog=cockpit.EPILOG)(cockpit.cockpit)
app.command(epilog=film.EPILOG)(film.film)
app.add_typer(bench.app, name="bench")
app.command(epilog=report.EPILOG)(report.report)
app.add_typer(terrain.app, name="terrain")
app.add_typer(evaluate.app, name="evaluate")
app.command(epilog=dataset.EPILOG)(dataset.dataset)
app.command(epilog=train.EPILOG)(train.train)
app.add_typer(motion_models.app, name="motion-models")
app.add_typer(learned_footholds.app, name="learned-footholds")
app.command(epilog=diagram.EPILOG)(diagram.diagram)
app.command()(doctor.doctor)


def main():
    """Entry point of the console script."""
    app(prog_name="quadpips")


if __name__ == "__main__":
    main()
