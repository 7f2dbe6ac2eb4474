"""Parts of a configuration tree, read from files, options and ``--set`` overrides."""

import dataclasses
from pathlib import Path

from quadpips_drake.errors import UserInputError, shown
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


def read_layer(path: Path) -> ConfigLayer:
    """Reads a YAML file as a layer; an empty file is an empty layer.

    Raises:
        UserInputError: there is no such file, it is not YAML of the plain kind, or its root is not a mapping.
    """
    data = read_yaml(path)
    if data is not None and not isinstance(data, dict):
        raise UserInputError(f"{path}: the root must be a mapping of 'key: value' lines, not {shown(data)}")
    return ConfigLayer(str(path), data or {})


def override_layer(text: str) -> ConfigLayer:
    """Reads one ``a.b.c=value``; the value is YAML, so numbers, true/false, text, [lists] and null work.

    Raises:
        UserInputError: the text is not of this form.
    """
    key, equals, value = text.partition("=")
    names = key.strip().split(".")
    if not equals or not all(names):
        raise UserInputError(f"--set {shown(text)} is not of the form key=value, for example --set seed=3")
    data = parse_yaml(value, f"--set {text[:60]}")
    for name in reversed(names):
        data = {name: data}
    return ConfigLayer(f"--set {text}", data)
