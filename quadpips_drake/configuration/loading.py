"""Typed configuration: dataclasses in code, overlaid by YAML files and by ``key=value`` overrides.

A configuration is a tree of the classes of ``schema``, whose defaults stand in the code. Layers are laid over it in order,
usually ``models/<robot>/defaults.yaml``, the user's scenario file, options of the command line, ``--set a.b=value``; see
docs/configuration.md. Values are converted and written by pydrake.common.yaml; on top of it, every mistake is reported as
one UserInputError that names the source, the key, and what would be right, and the final values are checked (the typed
loader constructs first and assigns afterwards, so that its own result is unchecked).
"""

import dataclasses
import typing
from functools import cache
from pathlib import Path
from typing import Any

import yaml
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed

from quadpips_drake.configuration.advice import advice
from quadpips_drake.configuration.layers import ConfigLayer
from quadpips_drake.configuration.schema import describe, field_types, item_type, section_of, without_none
from quadpips_drake.errors import UserInputError, shown


def load_config(schema: type, layers: list[ConfigLayer], base=None):
    """Returns an instance of the dataclass ``schema`` with the ``layers`` laid over its defaults, later ones on top.

    Mappings are merged key by key, anything else (lists too) is replaced as a whole. ``base``: an instance whose values take
    the place of the defaults.

    Raises:
        UserInputError: a key is unknown, a value has the wrong type or is out of its range, or values do not fit together.
    """
    config = schema() if base is None else base
    for layer in layers:
        _check_section(schema, schema, layer.data, (), layer.source)
        if layer.data:
            config = yaml_load_typed(schema=schema, defaults=config, data=yaml.safe_dump(layer.data))
    return _validated(config, (), layers)


def save_config(config, path: Path) -> None:
    """Writes the complete ``config`` (a dataclass) as YAML, defaults included; ``read_layer`` reads it back."""
    Path(path).write_text(yaml_dump_typed(config), encoding="utf-8")


def _check_section(root: type, schema: type, data: Any, path: tuple, source: str) -> None:
    """Raises UserInputError for the first key of ``data`` that does not fit ``schema``."""
    fields = field_types(schema)
    if not isinstance(data, dict):
        known = ", ".join(fields)
        raise UserInputError(f"{source}: '{'.'.join(path)}' is a section and needs keys ({known}), not {shown(data)}")
    for key, value in data.items():
        if key not in fields:
            section = f" in '{'.'.join(path)}'" if path else ""
            raise UserInputError(f"{source}: unknown key {shown(key)}{section}; {advice(root, fields, path, key)}")
        section = section_of(fields[key])
        items = section_of(item_type(without_none(fields[key])))
        if section is not None:
            if value is not None or section is fields[key]:
                _check_section(root, section, value, (*path, key), source)
        elif items is not None and isinstance(value, list):
            for index, item in enumerate(value):
                _check_section(root, items, item, (*path, f"{key}[{index}]"), source)
        else:
            _check_value(fields[key], value, (*path, key), source)


@cache
def _probe(kind: Any) -> type:
    """A dataclass with one field of some type, to ask the typed loader what it takes for that."""
    return dataclasses.make_dataclass("Probe", [("value", kind, dataclasses.field(default=None))])


def _check_value(kind: Any, value: Any, path: tuple, source: str) -> None:
    """Raises UserInputError if pydrake's typed loader does not take ``value`` for a field of type ``kind``."""
    try:
        # The loader iterates over whatever stands where a list is wanted, so that "12" would become [1.0, 2.0].
        if typing.get_origin(without_none(kind)) is list and value is not None and not isinstance(value, list):
            raise TypeError
        yaml_load_typed(schema=_probe(kind), data=yaml.safe_dump({"value": value}))
    except Exception:
        # One line whatever it was that the loader did not like: it raises several types, with Python's names in them.
        raise UserInputError(f"{source}: '{'.'.join(path)}' must be {describe(kind)}, not {shown(value)}") from None


def _validated(config, path: tuple, layers: list[ConfigLayer]):
    """Rebuilds the tree from its leaves up, so that every ``__post_init__`` sees the final values."""
    changes = {}
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        if dataclasses.is_dataclass(value):
            changes[field.name] = _validated(value, (*path, field.name), layers)
        elif isinstance(value, list) and value and dataclasses.is_dataclass(value[0]):
            changes[field.name] = [
                _validated(item, (*path, f"{field.name}[{index}]"), layers) for index, item in enumerate(value)
            ]
    try:
        return dataclasses.replace(config, **changes)
    except UserInputError as error:
        sources = [layer.source for layer in layers if _touches(layer.data, path)]
        origin = f" (set by {', '.join(sources)})" if sources else ""
        section = f"{'.'.join(path)}: " if path else ""
        raise UserInputError(f"{section}{error}{origin}") from None


def _touches(data: Any, path: tuple) -> bool:
    """Whether a layer sets a value directly in the section at ``path``."""
    for name in path:
        name = name.partition("[")[0]
        data = data.get(name, {}) if isinstance(data, dict) else {}
    return isinstance(data, list) or (isinstance(data, dict) and any(not isinstance(value, dict) for value in data.values()))
