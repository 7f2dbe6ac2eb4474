"""``quadpips film``: a film of a trial, from the files that it has left."""

from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli import console

EPILOG = """
Examples:

  quadpips film out/anymal_c-stepping_stones-quadpips-0

  quadpips film DIR --out crossing.gif --speed 2     at most 3 MB, for a README

  quadpips film DIR --begin 8 --end 12 --speed 0.25  slow motion

'run' and 'walk' make a film at their end with --film FILE.

Exit status: 0 the film is there, 2 bad input, 130 Ctrl-C.
"""


def film(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Directory of a run or a walk.")],
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Film to write, .mp4 or .gif. Default: DIR/film.mp4.")
    ] = None,
    width: Annotated[int, typer.Option(metavar="PIXELS", help="Default: 960 of an MP4, 640 of a GIF.")] = 0,
    height: Annotated[int, typer.Option(metavar="PIXELS", help="Default: 9/16 of the width.")] = 0,
    fps: Annotated[float, typer.Option(metavar="HZ", help="Pictures per second. Default: 25 of an MP4, 10 of a GIF.")] = 0.0,
    speed: Annotated[float, typer.Option(metavar="X", help="Simulated seconds in one of the film.")] = 1.0,
    begin: Annotated[float, typer.Option(metavar="S", help="Where in the trial it begins, s.")] = 0.0,
    end: Annotated[float, typer.Option(metavar="S", help="Where it ends, s. Default: with the trial.")] = 0.0,
    no_inset: Annotated[bool, typer.Option("--no-inset", help="Without the picture of what the robot sees.")] = False,
):
    """Make a film of a trial, without a display: the robot on its terrain, with words, plans and what it sees.

    It is made from config.yaml and log.npz; what the robot sees is computed anew.
    """
    from quadpips_drake.trials.telling.film import FilmConfig

    options = {"width": width, "height": height, "fps": fps, "speed": speed, "begin": begin, "end": end}
    make_film_with_progress(directory, out or directory / "film.mp4", FilmConfig(**options, inset=not no_inset))


def make_film_with_progress(directory: Path, path: Path, config=None) -> None:
    """Makes a film and says so; see ``make_film``."""
    from rich.progress import Progress

    from quadpips_drake.trials.telling.film import make_film

    with Progress(console=console.messages, transient=True, disable=not console.messages.is_terminal) as progress:
        task = progress.add_task("filming", total=None)

        def show(time: float, end: float) -> None:
            progress.update(task, completed=time, total=end)

        try:
            size = make_film(directory, path, config, show)
        except KeyboardInterrupt as interrupt:
            console.end_interrupted(interrupt, "there is no film")
    console.say(f"film:      {path} ({size / 1e6:.1f} MB)")
