"""``quadpips evaluate ...``: scores against the truth; one command for each thing that is scored."""

import typer

from quadpips_drake.cli import evaluate_perception

app = typer.Typer(no_args_is_help=True, help="Score perception against the truth.")
app.command("perception", epilog=evaluate_perception.EPILOG)(evaluate_perception.perception)
