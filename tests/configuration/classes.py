"""All configuration classes of the package and their keys."""

import dataclasses

from quadpips_drake.configuration.schema import field_types, item_type, range_of, without_none
from tests.source_tree import package_modules


def configuration_classes() -> list[type]:
    """Every configuration class of the package: those called so, and the sections in their trees."""
    found = set()
    for module in package_modules():
        for name, member in vars(module).items():
            if name.endswith("Config") and dataclasses.is_dataclass(member) and member.__module__ == module.__name__:
                found |= _with_sections(member)
    return sorted(found, key=lambda cls: cls.__qualname__)


def number_fields(cls: type) -> list[tuple[str, type, object]]:
    """Name, type (int or float) and range of the numbers, and lists of numbers, in a class."""
    kinds = {name: item_type(without_none(kind)) for name, kind in field_types(cls).items()}
    return [
        (field.name, kinds[field.name], range_of(field))
        for field in dataclasses.fields(cls)
        if kinds[field.name] in (int, float)
    ]


def _with_sections(cls: type) -> set[type]:
    found = {cls}
    for kind in field_types(cls).values():
        inner = item_type(without_none(kind))
        if dataclasses.is_dataclass(inner):
            found |= _with_sections(inner)
    return found
