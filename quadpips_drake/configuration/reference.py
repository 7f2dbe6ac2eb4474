"""The reference of all keys as Markdown: default, range, unit and meaning, from what the classes say themselves."""

import dataclasses
import inspect
import math
from typing import Any

from quadpips_drake.configuration.field_docs import field_docs, field_unit
from quadpips_drake.configuration.schema import (
    describe,
    describe_lengths,
    field_types,
    item_type,
    range_of,
    section_of,
    without_none,
)

_HEAD = "| Key | Default | Range | Unit | Meaning |\n| --- | --- | --- | --- | --- |"


def reference(config: Any, *, without: Any = None) -> str:
    """Returns one table of keys for each section of ``config``, an instance whose values are the defaults.

    Args:
        config: of a configuration class.
        without: an instance of another class; keys that both have with the same default are left out.
    """
    known = dict(_rows(without)) if without is not None else {}
    sections: dict[str, list[str]] = {}
    for (section, key), row in _rows(config):
        if known.get((section, key)) != row:
            sections.setdefault(section, []).append(row)
    parts = []
    for section, rows in sections.items():
        title = f"### {section}\n\n" if section else ""
        parts.append(f"{title}{_summary(config, section)}\n\n{_HEAD}\n" + "\n".join(rows) + "\n")
    return "\n".join(parts)


def _rows(config: Any, section: str = ""):
    """Yields ((section, key), row of the table) for all keys below ``config``, values before sections."""
    schema = type(config)
    subsections = []
    for field in dataclasses.fields(schema):
        value, kind = getattr(config, field.name), field_types(schema)[field.name]
        if section_of(kind) is not None:
            subsections.append((f"{section}.{field.name}".lstrip("."), value))
            continue
        meaning = field_docs(schema).get(field.name, "")
        unit = field_unit(schema, field.name) if range_of(field) is not None else ""
        cells = (f"`{field.name}`", f"`{_text(value)}`", _range(field, kind), unit, meaning)
        yield (section, field.name), "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"
        items = section_of(item_type(without_none(kind)))
        if items is not None:
            subsections.append((f"{section}.{field.name}[i]".lstrip("."), items()))
    for name, value in subsections:
        yield from _rows(value, name)


def _summary(config: Any, section: str) -> str:
    """What the section's class says about itself in its first paragraph."""
    for name in filter(None, section.split(".")):
        config = getattr(config, name, None) if not name.endswith("[i]") else _item(config, name[:-3])
    return " ".join((inspect.getdoc(type(config)) or "").split("\n\n")[0].split())


def _item(config: Any, name: str) -> Any:
    return item_type(without_none(field_types(type(config))[name]))()


def _range(field: dataclasses.Field, kind: Any) -> str:
    bounds, inner = range_of(field), without_none(kind)
    text = str(bounds) if bounds is not None else describe(inner).replace("a list, [...], each item ", "list of ")
    if item_type(inner) is int:
        text += ", whole"
    if bounds is not None and item_type(inner) is not inner:
        text = f"{describe_lengths(bounds.lengths)} of {text}"
    return text if inner is kind else f"{text}, or null"


def _text(value: Any) -> str:
    """A value as YAML has it."""
    if isinstance(value, bool) or value is None:
        return {True: "true", False: "false", None: "null"}[value]
    if isinstance(value, float):
        return ".inf" if math.isinf(value) else f"{value:g}" if float(f"{value:g}") == value else repr(value)
    if isinstance(value, list | tuple):
        if value and dataclasses.is_dataclass(value[0]):
            return f"[...{len(value)}]"
        return "[" + ", ".join(_text(item) for item in value) + "]"
    return str(value) or '""'
