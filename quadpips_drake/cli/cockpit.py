"""``quadpips cockpit``: everything by hand, on one page in a browser."""

from typing import Annotated

import typer

from quadpips_drake.cli import console
from quadpips_drake.cli.trials import Difficulty, Robot, RunTerrain, Sets
from quadpips_drake.cli.warming import compile_kernels

PORT = 8421
"""Where the page is unless the user says otherwise."""
EPILOG = """
Examples:

  quadpips cockpit                           then open the address that it prints

  quadpips cockpit --robot go2 --terrain stairs

  quadpips cockpit --walk --terrain bumps    by velocity: sliders, keys or a gamepad

Exit status: 0 the run is over and no page is open, or it was ended on the page; 2 bad input; 130 Ctrl-C, 143 SIGTERM.
"""


def cockpit(
    robot: Robot = None,
    terrain: RunTerrain = None,
    difficulty: Difficulty = None,
    planner: Annotated[str | None, typer.Option(metavar="NAME", help="Who plans. Default: quadpips.")] = None,
    walk: Annotated[bool, typer.Option("--walk", help="Nobody plans: walk by velocity, on flat ground by default.")] = False,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="Of all random numbers.")] = 0,
    duration: Annotated[
        float | None, typer.Option(parser=console.seconds, metavar="S", help="Longest simulated time, s. Default: 3000.")
    ] = None,
    port: Annotated[int, typer.Option(metavar="N", min=0, max=65535, help="Of the page; 0: any free one.")] = PORT,
    host: Annotated[
        str,
        typer.Option(metavar="ADDRESS", help="Where it listens; * for the whole network. There is no password."),
    ] = "localhost",
    sets: Sets = None,
):
    """Steer a simulated robot in a browser: set its goal, push it, put things in its way, look through its eyes."""
    from quadpips_drake.cockpit.choices import BY_VELOCITY, Choice
    from quadpips_drake.cockpit.server import address, open_port, run
    from quadpips_drake.cockpit.session import Session

    options = {"robot": robot, "difficulty": difficulty, "duration": duration, "sets": tuple(sets or ())}
    options |= {"planner": BY_VELOCITY if walk else planner, "terrain": terrain or ("flat" if walk else None)}
    choice = Choice(seed=seed, **{key: value for key, value in options.items() if value is not None})
    choice.check()  # what is wrong with it is said before anything else happens
    sockets = open_port(host, port)
    compile_kernels()
    session = Session(choice, meshcat_host=host, paused=True)
    where = address(host, sockets[0].getsockname()[1])

    def ready() -> None:
        console.say(f"cockpit: {where} (open it in a browser; Ctrl-C ends it)")

    try:
        run(session, sockets, host=host, ready=ready)
    except KeyboardInterrupt as interrupt:
        console.end_interrupted(interrupt, "the cockpit is closed")
    if session.snapshot.note:
        console.say(f"over:    {session.snapshot.note}")
