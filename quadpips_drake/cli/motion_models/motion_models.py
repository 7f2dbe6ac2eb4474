"""``quadpips motion-models ...``: collects data, trains models, tests them."""

import typer

from quadpips_drake.cli.motion_models import collect, test, train

app = typer.Typer(
    no_args_is_help=True,
    help="Learn what a velocity command does to base and feet within a step, from walks.",
)
app.command("collect", epilog=collect.EPILOG)(collect.collect)
app.command("train", epilog=train.EPILOG)(train.train)
app.command("test", epilog=test.EPILOG)(test.test)
