"""What the commands share: one-line errors with the exit codes of the command line, and reading of option values."""

import math
import sys
from pathlib import Path

import typer
from rich.console import Console
from typer.core import TyperGroup

from quadpips_drake.errors import UserInputError

SUCCESS, FAILURE, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130

messages = Console(stderr=True, highlight=False, soft_wrap=True)
"""For progress, remarks and errors; results go to stdout."""


class OneLineErrors(TyperGroup):
    """Root of the commands: bad input ends with one line on stderr and exit status 2, never with a traceback or a box."""

    def main(self, args=None, prog_name=None, complete_var=None, standalone_mode=True, **extra):
        if not standalone_mode:
            return super().main(args, prog_name, complete_var, standalone_mode=False, **extra)
        try:
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
            status = INTERRUPTED
        sys.exit(status if isinstance(status, int) else SUCCESS)


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


def writable_directory(path: Path) -> Path:
    """Makes the directory ``path`` when it is missing.

    Raises:
        UserInputError: it cannot be made or written to.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe = path / ".write_probe"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise UserInputError(f"--out {path}: cannot write there ({error.strerror}); give a writable directory") from None
    return path


def _help_hint(error: typer.TyperException) -> str:
    context = getattr(error, "ctx", None)
    return f"(see '{context.command_path if context else 'quadpips'} --help')"
