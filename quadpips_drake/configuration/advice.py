"""Which key may have been meant by one that does not exist."""

import difflib
from typing import Any

from quadpips_drake.configuration.schema import config_keys

_LIKENESS = 0.75
"""Least similarity (of difflib) of a misspelt key to the one that is suggested; below, suggestions seem arbitrary."""
_MAX_PLACES = 3
"""A name that is in use at more places than this is in none of them likelier than in the others."""


def advice(root: type, fields: dict[str, Any], path: tuple[str, ...], key: str) -> str:
    """Returns what to write instead of the unknown ``key``.

    This is the same name at another place, or a similar name among the ``fields`` of the section at ``path``, or else only
    the names that there are.

    Args:
        root: the class of the whole configuration.
        fields: the section's keys.
        path: where the section lies.
        key: the unknown one.
    """
    known = f"known: {', '.join(fields)}"
    similar = difflib.get_close_matches(key, fields, n=1, cutoff=_LIKENESS)
    if similar:
        return f"did you mean '{similar[0]}'? {known}"
    places = _places(root, key)
    beside = [place for place in places if path and set(path) & set(place.split(".")[:-1])]
    meant = beside if 0 < len(beside) <= _MAX_PLACES else places
    if 0 < len(meant) <= _MAX_PLACES:
        return f"did you mean {' or '.join(repr(place) for place in meant)}?"
    return known


def _places(root: type, key: str) -> list[str]:
    """All paths in the tree that end in ``key``, be it a value or a section."""
    dotted = [f".{known}." for known in config_keys(root) if f".{key}." in f".{known}."]
    return sorted({known[1 : known.index(f".{key}.") + len(key) + 1] for known in dotted})
