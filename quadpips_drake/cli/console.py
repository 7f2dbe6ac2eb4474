"""What the commands share: what they print and how they end, and reading of option values."""

import math
import sys
import unicodedata
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from pickle import UnpicklingError
from typing import NoReturn

import typer
from rich.console import Console
from typer.core import TyperGroup

from quadpips_drake import interruption
from quadpips_drake.errors import UserInputError

SUCCESS, FAILURE, BAD_INPUT = 0, 1, 2
"""An interrupted command ends with 130 (Ctrl-C) or 128 and the number of the signal."""
PICTURES = (".png", ".jpg", ".svg", ".pdf")
"""What pictures may be written as."""
_CONTROL = ("Cc", "Cf", "Cs", "Zl", "Zp")
"""Unicode categories of what changes how other text is shown instead of being shown."""


def printable(text: str) -> str:
    """``text`` with control characters written out (ESC as \\x1b), line ends and tabs apart.

    Names and messages out of files must not move the cursor, colour the terminal or hide what stands beside them.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(
        character.encode("unicode_escape").decode("ascii")
        if unicodedata.category(character) in _CONTROL and character not in "\n\t"
        else character
        for character in text
    )


class PlainConsole(Console):
    """A console that shows control characters in text instead of obeying them."""

    def print(self, *objects, **options):
        super().print(*(printable(item) if isinstance(item, str) else item for item in objects), **options)


messages = PlainConsole(stderr=True, highlight=False, soft_wrap=True)
"""For progress, remarks and errors; results go to stdout."""


def say(text: str) -> None:
    """Prints ``text``, a result, on stdout."""
    typer.echo(printable(text))


class OneLineErrors(TyperGroup):
    """Root of the commands: bad input ends with one line on stderr and exit status 2, never with a traceback or a box.

    Ctrl-C, and SIGTERM like it, ends a command with exit status 128 and the number of the signal.
    """

    def main(self, args=None, prog_name=None, complete_var=None, standalone_mode=True, **extra):
        if not standalone_mode:
            return super().main(args, prog_name, complete_var, standalone_mode=False, **extra)
        try:
            with interruption.interruptible():
                status = super().main(args, prog_name, complete_var, standalone_mode=False, **extra)
        except UserInputError as error:
            print_error(str(error))
            status = BAD_INPUT
        except typer.TyperException as error:  # the command line itself: an unknown option, a missing value
            message = error.format_message()
            if message:  # a group of commands without any argument has printed its help already, and says nothing more
                print_error(f"{message} {_help_hint(error)}")
            status = BAD_INPUT
        except typer.Abort:
            status = FAILURE
        sys.exit(status if isinstance(status, int) else SUCCESS)

    def invoke(self, ctx):
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as interrupt:
            raise typer.Exit(interruption.exit_status(interrupt)) from None
        except (EOFError, UnpicklingError):  # what numba makes of a damaged file in its cache
            from quadpips_drake.compiling import remove_broken_kernels

            broken = remove_broken_kernels()
            if not broken:
                raise
            print_error(f"{len(broken)} damaged files were in the cache of compiled kernels; now run the same command again")
            raise typer.Exit(FAILURE) from None


def end_interrupted(interrupt: KeyboardInterrupt, remark: str) -> NoReturn:
    """Ends the command with the exit status of an interruption; says so, and what is left (``remark``)."""
    messages.print(f"interrupted; {remark}", markup=False)
    raise typer.Exit(interruption.exit_status(interrupt)) from None


def with_progress(pieces: Iterator[tuple[int, ...]], label: str, what: str, out: Path) -> tuple[int, ...]:
    """Goes through what is collected piece by piece into a directory, and shows how far it is.

    Args:
        pieces: (done, in all, ...) at first and after each piece; what it refuses at first is left to the caller.
        label: of the bar.
        what: what the pieces are called, in the plural.
        out: where they lie.

    Returns: the last tuple. An interruption, a full disk or a dead process ends the command.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from quadpips_drake.worker_pool import JobFailed

    columns = (TextColumn(label), BarColumn(), MofNCompleteColumn(), TextColumn(what), TimeRemainingColumn())
    now: tuple[int, ...] = (0, 0)
    try:
        with closing(pieces):
            now = next(pieces)  # a refusal comes before the bar
            with Progress(*columns, console=messages) as progress:
                bar = progress.add_task(label, completed=now[0], total=now[1])
                for now in pieces:
                    progress.update(bar, completed=now[0])
    except KeyboardInterrupt as interrupt:
        end_interrupted(interrupt, f"{now[0]} of {now[1]} {what} lie in {out}, --resume goes on")
    except (OSError, JobFailed) as error:
        reason = getattr(error, "strerror", None) or str(error)
        print_error(f"--out {out}: {reason}; {now[0]} of {now[1]} {what} lie there, --resume goes on")
        raise typer.Exit(FAILURE) from None
    return now


def run_alone(command: Callable) -> None:
    """Runs ``command`` as a program of its own, its parameters are the options; errors as of all commands. For examples."""
    app = typer.Typer(
        cls=OneLineErrors,
        invoke_without_command=True,
        subcommand_metavar="",
        add_completion=False,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(command)
    app()


def print_error(message: str) -> None:
    """Prints ``message`` as one line on stderr."""
    messages.print("[bold red]error:[/]", end=" ")
    messages.print(" ".join(message.split()), markup=False)


def numbers(option: str, text: str, names: str) -> list[float]:
    """Reads ``text`` as comma-separated finite numbers, one for each comma-separated word of ``names``.

    Raises:
        UserInputError: there are too few, too many, or something else stands there.
    """
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        values = []
    if len(values) != len(names.split(",")) or not all(math.isfinite(value) for value in values):
        raise UserInputError(f"{option} '{text}' is not of the form {names} (numbers with commas and without spaces)")
    return values


def seconds(text: str) -> float:
    """Reads the value of an option that is a duration; the ``parser`` of the option.

    Raises:
        typer.BadParameter: it is no positive, finite number.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise typer.BadParameter(f"the duration must be a positive number of seconds, not '{text}'.")
    return value


def to_directory(text: str) -> Path:
    """Reads the value of an option that is a directory for results; the ``parser`` of the option.

    Raises:
        typer.BadParameter: it is empty, which as a path would mean the working directory.
    """
    if not str(text).strip():
        raise typer.BadParameter("an empty name is no directory; for the working directory give a dot.")
    return Path(text)


def writable_directory(path: Path, option: str = "--out") -> Path:
    """Makes the directory ``path``, which ``option`` names, when it is missing.

    Raises:
        UserInputError: it cannot be made or written to.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe = path / ".write_probe"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise UserInputError(f"{option} {path}: cannot write there ({error.strerror}); give a writable directory") from None
    return path


def picture_file(option: str, path: Path) -> Path:
    """Makes the directory of the picture ``path``, the value of ``option``, when it is missing.

    Raises:
        UserInputError: its name does not end as a picture's, or it cannot be written.
    """
    if path.suffix.lower() not in PICTURES:
        raise UserInputError(f"{option} {path}: the name of a picture must end in {', '.join(PICTURES)}")
    writable_directory(path.parent, option)
    return path


def _help_hint(error: typer.TyperException) -> str:
    context = getattr(error, "ctx", None)
    return f"(see '{context.command_path if context else 'quadpips'} --help')"
