"""Errors whose message is meant for the user: one line that says what was wrong and what would be right."""


class UserInputError(ValueError):
    """Bad input from outside (a name, a file, an option).

    The command line prints the message as its only line and exits with status 2.
    """


def unknown_name(kind: str, name: str, known) -> UserInputError:
    """Returns the error for an unknown ``name`` of some ``kind``, listing the ``known`` ones."""
    return UserInputError(f"unknown {kind} '{name}'; known: {', '.join(sorted(known))}")
