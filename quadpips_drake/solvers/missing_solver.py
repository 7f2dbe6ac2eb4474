"""Packages of solvers are imported when a solver is asked for: one that is missing is missed by nobody else."""

from collections.abc import Iterator
from contextlib import contextmanager

from quadpips_drake.errors import UserInputError


class MissingSolverError(UserInputError):
    """The package of a solver is not there, or cannot be imported."""


@contextmanager
def needed_for(solver: str) -> Iterator[None]:
    """Turns an ImportError of what is done inside into a MissingSolverError that names the ``solver``."""
    try:
        yield
    except ImportError as error:
        raise MissingSolverError(f"the solver '{solver}' is not installed ({error}); choose another or install it") from None
