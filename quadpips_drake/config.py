"""Typed configuration: dataclasses in code, overlaid by YAML files and by ``key=value`` overrides.

A configuration is a tree of plain dataclasses whose defaults stand in the code. Layers are laid over it in order, usually
``models/<robot>/defaults.yaml``, the user's scenario file, options of the command line, ``--set a.b=value``; see
docs/configuration.md. Reading and writing is pydrake.common.yaml's; on top of it, every mistake is reported as one
UserInputError that names the source, the key, and what would be right, and ``__post_init__`` checks the final values (the
typed loader constructs first and assigns afterwards, so that its own result is unchecked).
"""

import dataclasses
import difflib
import types
import typing
from importlib import resources
from pathlib import Path
from typing import Any

import yaml
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed

from quadpips_drake.errors import UserInputError
from quadpips_drake.plain_yaml import parse_yaml, read_yaml


@dataclasses.dataclass(frozen=True)
class ConfigLayer:
    """A part of a configuration tree, and where it comes from."""

    source: str
    """For error messages: a file name, or an option as typed."""
    data: dict
    """Nested mappings; only the keys that the layer sets."""

    def under(self, key: str) -> "ConfigLayer":
        """The same layer, one level deeper: below ``key``."""
        return ConfigLayer(self.source, {key: self.data} if self.data else {})


def load_config(schema: type, layers: list[ConfigLayer]):
    """Returns an instance of the dataclass ``schema`` with the ``layers`` laid over its defaults, later ones on top.

    Mappings are merged key by key, anything else (lists too) is replaced as a whole.

    Raises:
        UserInputError: a key is unknown, a value has the wrong type, or a ``__post_init__`` refuses the final values.
    """
    config = schema()
    for layer in layers:
        _check(schema, schema, layer.data, (), layer.source)
        if layer.data:
            config = yaml_load_typed(schema=schema, defaults=config, data=yaml.safe_dump(layer.data))
    return _validated(config, (), layers)


def save_config(config, path: Path) -> None:
    """Writes the complete ``config`` (a dataclass) as YAML, defaults included; ``read_layer`` reads it back."""
    Path(path).write_text(yaml_dump_typed(config), encoding="utf-8")


def read_layer(path: Path) -> ConfigLayer:
    """Reads a YAML file as a layer; an empty file is an empty layer.

    Raises:
        UserInputError: there is no such file, it is not YAML, a key stands twice, or its root is not a mapping.
    """
    data = read_yaml(path)
    if data is not None and not isinstance(data, dict):
        raise UserInputError(f"{path}: the root must be a mapping of 'key: value' lines, not {_kind(data)}")
    return ConfigLayer(str(path), data or {})


def override_layer(text: str) -> ConfigLayer:
    """Reads one ``a.b.c=value``; the value is YAML, so numbers, true/false, text, [lists] and null work.

    Raises:
        UserInputError: the text is not of this form.
    """
    key, equals, value = text.partition("=")
    names = key.strip().split(".")
    if not equals or not all(names):
        raise UserInputError(f"--set '{text}' is not of the form key=value, for example --set seed=3")
    data = parse_yaml(value, f"--set {text}")
    for name in reversed(names):
        data = {name: data}
    return ConfigLayer(f"--set {text}", data)


def robot_defaults_layer(robot: str) -> ConfigLayer:
    """Returns ``models/<robot>/defaults.yaml`` (sections as in the stages' configuration); empty if there is none."""
    file = resources.files("quadpips_drake.models") / robot / "defaults.yaml"
    if not file.is_file():
        return ConfigLayer(f"models/{robot}/defaults.yaml", {})
    with resources.as_file(file) as path:
        return dataclasses.replace(read_layer(path), source=f"models/{robot}/defaults.yaml")


def config_keys(schema: type, prefix: str = "") -> list[str]:
    """Lists the dotted keys of all values in the tree of dataclasses ``schema``."""
    keys = []
    for name, kind in typing.get_type_hints(schema).items():
        section = _section(kind)
        keys += config_keys(section, f"{prefix}{name}.") if section else [prefix + name]
    return keys


def _check(root: type, schema: type, data: Any, path: tuple, source: str) -> None:
    """Raises UserInputError for the first key of ``data`` that does not fit ``schema``."""
    where = ".".join(path)
    if not isinstance(data, dict):
        known = ", ".join(typing.get_type_hints(schema))
        raise UserInputError(f"{source}: '{where}' is a section and needs keys ({known}), not {_kind(data)}")
    fields = typing.get_type_hints(schema)
    for key, value in data.items():
        if key not in fields:
            section = f" in '{where}'" if where else ""
            raise UserInputError(f"{source}: unknown key '{key}'{section}; {_advice(root, fields, str(key))}")
        section = _section(fields[key])
        if section is None:
            _check_value(fields[key], key, value, (*path, key), source)
        elif value is not None or section is fields[key]:
            _check(root, section, value, (*path, key), source)


def _check_value(kind: Any, key: str, value: Any, path: tuple, source: str) -> None:
    """Raises UserInputError if pydrake's typed loader does not take ``value`` for a field of type ``kind``."""
    probe = dataclasses.make_dataclass("Probe", [(key, kind, dataclasses.field(default=None))])
    inner = _without_none(kind)
    try:
        # The loader iterates over whatever stands where a list is wanted, so that "12" would become [1.0, 2.0].
        if typing.get_origin(inner) is list and value is not None and not isinstance(value, list):
            raise TypeError
        loaded = getattr(yaml_load_typed(schema=probe, data=yaml.safe_dump({key: value})), key)
        if isinstance(loaded, float) and loaded != loaded:
            raise ValueError
    except Exception:
        # One line whatever it was that the loader did not like: it raises several types, with Python's names in them.
        raise UserInputError(
            f"{source}: '{'.'.join(path)}' must be {_describe(kind)}, not {_kind(value)} ({value!r})"
        ) from None


def _validated(config, path: tuple, layers: list[ConfigLayer]):
    """Rebuilds the tree from its leaves up, so that every ``__post_init__`` sees the final values."""
    changes = {}
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        if dataclasses.is_dataclass(value):
            changes[field.name] = _validated(value, (*path, field.name), layers)
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
        data = data.get(name, {}) if isinstance(data, dict) else {}
    return isinstance(data, dict) and any(not isinstance(value, dict) for value in data.values())


def _advice(root: type, fields: dict, key: str) -> str:
    """Says which key may have been meant: the same name elsewhere, a similar one here, or else all that there are."""
    elsewhere = [known for known in config_keys(root) if f".{key}." in f".{known}."]
    if elsewhere:
        meant = sorted({known[: f"{known}.".index(f"{key}.") + len(key)] for known in elsewhere})
        return f"did you mean {' or '.join(repr(m) for m in meant[:3])}?"
    similar = difflib.get_close_matches(key, fields, n=1)
    return (f"did you mean '{similar[0]}'? " if similar else "") + f"known: {', '.join(fields)}"


def _without_none(kind: Any) -> Any:
    """Optional[T] -> T; anything else as it is."""
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        inner = [k for k in typing.get_args(kind) if k is not type(None)]
        if len(inner) == 1:
            return inner[0]
    return kind


def _section(kind: Any) -> type | None:
    """The dataclass behind a field's type, or None if the field is a value."""
    kind = _without_none(kind)
    return kind if dataclasses.is_dataclass(kind) else None


def _describe(kind: Any) -> str:
    """A type in the user's words."""
    words = {float: "a number", int: "a whole number", bool: "true or false", str: "text"}
    inner = _without_none(kind)
    if typing.get_origin(inner) is list:
        (item,) = typing.get_args(inner)
        text = "a list, [...], each item " + words.get(item, getattr(item, "__name__", str(item)))
    else:
        text = words.get(inner, getattr(inner, "__name__", str(inner)))
    return text if inner is kind else f"{text} or null"


def _kind(value: Any) -> str:
    """What a YAML value is, in the user's words."""
    if value is None:
        return "nothing"
    words = {bool: "true/false", int: "a number", float: "a number", str: "text", list: "a list", dict: "a mapping"}
    return words.get(type(value), type(value).__name__)
