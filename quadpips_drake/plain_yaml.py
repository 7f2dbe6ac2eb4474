"""Reads YAML as plain data: mappings with keys of text, lists, numbers, true/false, text and null.

What can hurt is refused with the number of its line: anchors and aliases (a few lines of them unfold to gigabytes), tags
(they name types to construct), keys that appear twice or are not plain text, merge keys, more than one document, deep
nesting, too many values, whole numbers beyond 64 bits. The data is built from the parser's events in a loop: PyYAML's own
construction recurses, which ends deep nesting in a crash of its C parser.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from quadpips_drake.errors import UserInputError
from quadpips_drake.files import MAX_BYTES, MAX_DEPTH, MAX_VALUES, check_int, read_text

_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_RESOLVER = yaml.resolver.Resolver()
_CONSTRUCTOR = yaml.constructor.SafeConstructor()
_TAG = "tag:yaml.org,2002:"
_MAX_NUMBER_LENGTH = 100
"""Characters; what is longer is no number that anybody wrote, and may take very long to convert."""
_NO_KEY = object()


class _Refused(Exception):
    """What is wrong, and the mark where."""


def read_yaml(path: str | Path, source: str = "", max_bytes: int = MAX_BYTES) -> Any:
    """Returns the plain data in a YAML file, None if it is empty.

    Args:
        path: of a regular file of UTF-8 text.
        source: what the file is called in messages; its path by default.
        max_bytes: largest size [bytes].

    Raises:
        UserInputError: the file cannot be read, or is not YAML of this kind; one line with source, line and reason.
    """
    return parse_yaml(read_text(path, source, max_bytes), source or str(path))


def parse_yaml(text: str, source: str) -> Any:
    """Returns the plain data in YAML ``text`` from ``source``, None if it is empty; UserInputError as ``read_yaml``."""
    try:
        return _build(yaml.parse(text, Loader=_Loader))
    except yaml.YAMLError as error:
        # Errors of the reader, which stumbles over control characters, have a position instead of a mark.
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        where = f"line {mark.line + 1}: " if mark else ""
        why = getattr(error, "problem", None) or getattr(error, "reason", None) or type(error).__name__
    except _Refused as error:
        why, mark = error.args
        where = f"line {mark.line + 1}: "
    raise UserInputError(f"{source}: {where}not valid YAML: {why}")


def _build(events: Iterator[yaml.Event]) -> Any:
    """Puts the data together from a parser's ``events``."""
    root: list = []
    # Lists and mappings that are not finished, innermost last, and for each mapping the key that waits for its value.
    unfinished: list = [root]
    keys: list = [_NO_KEY]
    count = 0
    for event in events:
        if isinstance(event, yaml.CollectionEndEvent):
            unfinished.pop()
            keys.pop()
            continue
        if isinstance(event, yaml.DocumentStartEvent) and root:
            raise _Refused("more than one document", event.start_mark)
        if not isinstance(event, yaml.NodeEvent):
            continue
        count += 1
        _check(event, count, len(unfinished))
        value = _value(event)
        parent = unfinished[-1]
        if isinstance(parent, list):
            parent.append(value)
        elif keys[-1] is _NO_KEY:
            keys[-1] = _key(event, parent)
            continue
        else:
            parent[keys[-1]] = value
            keys[-1] = _NO_KEY
        if isinstance(value, dict | list):
            unfinished.append(value)
            keys.append(_NO_KEY)
    return root[0] if root else None


def _check(event: yaml.NodeEvent, count: int, depth: int) -> None:
    """Refuses what is never taken, in the ``count``-th value at some ``depth``."""
    if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
        raise _Refused("anchors and aliases (&, *) are not taken; write the value out", event.start_mark)
    if event.tag is not None:
        raise _Refused("tags (!) are not taken; write the plain value", event.start_mark)
    if count > MAX_VALUES:
        raise _Refused(f"more than {MAX_VALUES} values", event.start_mark)
    if depth > MAX_DEPTH:
        raise _Refused(f"nested more than {MAX_DEPTH} deep", event.start_mark)


def _key(event: yaml.NodeEvent, mapping: dict) -> str:
    """Returns a key as it is written; numbers and true/false are text here."""
    if not isinstance(event, yaml.ScalarEvent):
        raise _Refused("a key must be plain text", event.start_mark)
    if event.value in mapping:
        raise _Refused(f"the key '{event.value[:60]}' appears twice", event.start_mark)
    return event.value


def _value(event: yaml.NodeEvent) -> Any:
    """Returns a scalar's value, or an empty list or mapping to be filled."""
    if isinstance(event, yaml.SequenceStartEvent):
        return []
    if isinstance(event, yaml.MappingStartEvent):
        return {}
    kind = _RESOLVER.resolve(yaml.ScalarNode, event.value, event.implicit).removeprefix(_TAG)
    if kind not in ("null", "bool", "int", "float"):
        return event.value  # dates are text, too
    if kind == "null":
        return None
    try:
        if len(event.value) > _MAX_NUMBER_LENGTH:
            raise ValueError("a number of too many digits")
        node = yaml.ScalarNode(_TAG + kind, event.value)
        if kind == "int":
            return check_int(_CONSTRUCTOR.construct_yaml_int(node))
        return getattr(_CONSTRUCTOR, f"construct_yaml_{kind}")(node)
    except (ValueError, IndexError) as error:  # IndexError: PyYAML's for '0b' and the like
        why = error if "number" in str(error) else "not a number"
        raise _Refused(f"'{event.value[:40]}': {why}", event.start_mark) from None
