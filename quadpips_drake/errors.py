"""Errors whose message is meant for the user: one line that says what was wrong and what would be right."""

MAX_MESSAGE = 2000
"""Longest message [characters]; what is longer repeats a hostile input."""


class UserInputError(ValueError):
    """Bad input from outside (a name, a file, an option).

    The command line prints the message as its only line and exits with status 2. Line breaks and control characters, which
    can only come from the input, are written as escapes, so that a file cannot steer the terminal.
    """

    def __init__(self, message: object = ""):
        super().__init__(one_line(str(message)))


def one_line(text: str) -> str:
    """Returns ``text`` without characters that are not printable (they become escapes), cut to MAX_MESSAGE characters."""
    text = text if len(text) <= MAX_MESSAGE else text[: MAX_MESSAGE - 3] + "..."
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def unknown_name(kind: str, name: str, known) -> UserInputError:
    """Returns the error for an unknown ``name`` of some ``kind``, listing the ``known`` ones."""
    return UserInputError(f"unknown {kind} '{name}'; known: {', '.join(sorted(known))}")


def shown(value: object) -> str:
    """Returns a wrong value as it is shown in a message: quoted if it is text, never the whole of a huge one."""
    if value is None:
        return "nothing"
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int) and not -(2**63) <= value < 2**64:  # Python refuses to print one of 5,000 digits
        return "a whole number beyond 64 bits"
    text = str(value)
    text = text if len(text) <= 60 else text[:57] + "..."
    return f"'{text}'" if isinstance(value, str) else text
