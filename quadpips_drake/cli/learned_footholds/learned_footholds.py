"""``quadpips learned-footholds ...``: asks the foothold search, trains a network on its answers."""

import typer

from quadpips_drake.cli.learned_footholds import collect, train

app = typer.Typer(
    no_args_is_help=True,
    help="Learn from our own foothold search where to put the feet, for the planner lf_mpc.",
)
app.command("collect", epilog=collect.EPILOG)(collect.collect)
app.command("train", epilog=train.EPILOG)(train.train)
