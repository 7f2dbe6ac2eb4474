"""Names for the directories of trials that tell different trials apart."""

import hashlib
import json
import re
from dataclasses import asdict
from pathlib import Path

_LENGTH = 60
"""Of what is readable in a name [characters]."""


def directory_name(config, plain, *first) -> str:
    """The words ``first``, joined by dashes, and what else is special about a configuration.

    Settings that differ from ``plain`` follow as ``key=value`` where they are short; when not all can be told so, a hash of
    all of them stands at the end. The same configuration always has the same name.

    Args:
        config: of the trial.
        plain: what ``config`` would be by default; of the same type.
        first: what names begin with: robot, terrain and the like; of paths, the stem.
    """
    special = _differences(asdict(config), asdict(plain))
    words = [Path(str(word)).stem for word in first]
    paths = [str(Path(str(word)).absolute()) for word, stem in zip(first, words, strict=True) if str(word) != stem]
    whole = "-".join(words + [f"{key}={_short(value)}" for key, value in special.items()])
    if len(whole) <= _LENGTH and whole == _safe(whole) and "." not in "".join(special) and not paths:
        return whole
    told = json.dumps([words, paths, special], sort_keys=True, default=str)
    hints = [f"{key.rsplit('.', 1)[-1]}={_short(value)}" if _is_plain(value) else key for key, value in special.items()]
    return f"{_safe('-'.join(words + hints))[:_LENGTH].rstrip('-')}-{hashlib.sha256(told.encode()).hexdigest()[:8]}"


def _differences(values: dict, plain: dict, prefix: str = "") -> dict:
    """What differs, by dotted key."""
    found = {}
    for key, value in values.items():
        if isinstance(value, dict) and isinstance(plain.get(key), dict):
            found |= _differences(value, plain[key], f"{prefix}{key}.")
        elif value != plain.get(key):
            found[prefix + key] = value
    return found


def _is_plain(value) -> bool:
    """Whether a value is a number, a word, or a list of them."""
    return not isinstance(value, dict) and (not isinstance(value, list) or all(map(_is_plain, value)))


def _short(value) -> str:
    """A value as one would type it."""
    if isinstance(value, list):
        return ",".join(map(_short, value))
    return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(value)


def _safe(text: str) -> str:
    """``text`` with nothing in it that needs care in a shell or on a terminal."""
    return re.sub(r"[^A-Za-z0-9._,=+-]+", "_", text)
