"""What a configuration class says about its keys: types, and ranges of all numbers; checked whenever one is made.

    @configuration
    class HorizonConfig:
        length: float = ranged(1.0, 0.05, 10.0)
        \"""Of the horizon [s].\"""

A class that leaves a number without a range is refused when it is defined, so that no key can be forgotten. Ranges are
generous: they leave out what crashes, never ends or fills the memory, and what means nothing, like a negative length.
"""

import dataclasses
import math
import numbers
import types
import typing
from collections.abc import Container
from functools import cache
from typing import Any

from quadpips_drake.configuration.field_docs import field_docs, field_unit
from quadpips_drake.errors import UserInputError, shown

MAX_ITEMS = 1000
"""Most items of a list that says nothing else."""
MAX_TEXT = 4096
"""Longest text [characters]: that of a path."""
MAX_SEED = 2**31 - 1
"""Largest seed of anything that is drawn at random."""
MAX_DURATION = 86_400.0
"""Longest time of a simulation, and latest time in one [s]: a day."""
_RANGE = "range"


@dataclasses.dataclass(frozen=True)
class Range:
    """What a number, or each number of a list, must be."""

    low: float
    """Least value."""
    high: float
    """Largest value; infinity only if that is itself a value with a meaning."""
    zero: bool = False
    """Whether zero is taken although it is less than ``low``: it switches something off."""
    lengths: Container[int] | None = None
    """Allowed numbers of items of a list."""

    def holds(self, value: float) -> bool:
        """Whether ``value`` is taken; NaN never is, nor a whole number that does not fit into 64 bits."""
        if isinstance(value, numbers.Integral) and not -(2**63) <= value < 2**63:
            return False
        return self.low <= value <= self.high or (self.zero and value == 0)

    def __str__(self):
        low, high = (str(end) if isinstance(end, int) else f"{end:g}" for end in (self.low, self.high))
        span = f"{low}..{high}" if self.high < math.inf else f"at least {low}"
        return f"0 or {span}" if self.zero else span


def ranged(default: Any, low: float, high: float, *, zero: bool = False, lengths: Container[int] | None = None) -> Any:
    """Returns the dataclass field of a number, an optional number or a list of numbers with its default and its range.

    Args:
        default: a number, None, or a list; a list that is not empty also fixes the number of items.
        low: least value, of each item in a list.
        high: largest value.
        zero: whether zero is taken as well.
        lengths: allowed numbers of items, if not that of ``default``.
    """
    if not isinstance(default, list):
        return dataclasses.field(default=default, metadata={_RANGE: Range(low, high, zero, lengths)})
    lengths = lengths if lengths is not None else (len(default),)
    return dataclasses.field(default_factory=default.copy, metadata={_RANGE: Range(low, high, zero, lengths)})


def range_of(field: dataclasses.Field) -> Range | None:
    """The range of a field of numbers, or None."""
    return field.metadata.get(_RANGE)


@typing.dataclass_transform(field_specifiers=(dataclasses.field, ranged))
def configuration(cls: type) -> type:
    """Makes ``cls`` a dataclass of which no instance holds a wrong type or a number out of its range.

    Its own ``__post_init__`` comes afterwards and checks how the values fit together.

    Raises:
        TypeError: a field of numbers has no range.
    """
    own_check = cls.__dict__.get("__post_init__")

    def __post_init__(self):
        check_fields(self)
        if own_check is not None:
            own_check(self)
        elif hasattr(super(cls, self), "__post_init__"):
            super(cls, self).__post_init__()

    cls.__post_init__ = __post_init__
    cls = dataclasses.dataclass(cls)
    for field in dataclasses.fields(cls):
        kind = item_type(without_none(field_types(cls)[field.name]))
        if kind in (int, float) and range_of(field) is None:
            raise TypeError(f"{cls.__name__}.{field.name}: a number needs its range, = ranged(default, low, high)")
    return cls


def check_fields(config: Any) -> None:
    """Raises UserInputError if a field of ``config`` has the wrong type or leaves its range."""
    for field in dataclasses.fields(config):
        value, kind = getattr(config, field.name), field_types(type(config))[field.name]
        if value is None and kind is not without_none(kind):
            continue
        kind, bounds = without_none(kind), range_of(field)
        if typing.get_origin(kind) is not list:
            _check_value(config, field.name, field.name, kind, bounds, value)
            continue
        if not isinstance(value, list | tuple):
            raise UserInputError(f"{field.name} must be {describe(kind)}, not {shown(value)}")
        _check_length(config, field.name, bounds, len(value))
        for index, item in enumerate(value):
            _check_value(config, field.name, f"{field.name}[{index}]", item_type(kind), bounds, item)


def check_tree(config: Any) -> None:
    """Checks ``config`` and all its sections once more, after values were assigned; UserInputError as when it was made."""
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        for item in value if isinstance(value, list | tuple) else [value]:
            if dataclasses.is_dataclass(item):
                check_tree(item)
    dataclasses.replace(config)


def _check_value(config: Any, name: str, where: str, kind: type, bounds: Range | None, value: Any) -> None:
    if not _is_a(value, kind):
        raise UserInputError(f"{where} must be {describe(kind)}, not {shown(value)}")
    if bounds is not None and not bounds.holds(value):
        unit = field_unit(type(config), name)
        raise UserInputError(f"{where} must be {bounds}{unit and ' ' + unit}, not {shown(value)}")
    if kind is str and not (len(value) <= MAX_TEXT and value.isprintable()):
        raise UserInputError(f"{where} must be printable text of at most {MAX_TEXT} characters, not {shown(value)}")


def _check_length(config: Any, name: str, bounds: Range | None, length: int) -> None:
    lengths = range(MAX_ITEMS + 1) if bounds is None or bounds.lengths is None else bounds.lengths
    if length not in lengths:
        meaning = field_docs(type(config)).get(name, "").removesuffix(".")
        raise UserInputError(f"{name} must have {describe_lengths(lengths)} items, not {length}{meaning and ': '}{meaning}")


def describe_lengths(lengths: Container[int]) -> str:
    """Allowed numbers of items in the user's words: '3', '0 or 3', '0..100'."""
    if isinstance(lengths, range):
        return f"{lengths.start}..{lengths.stop - 1}"
    return " or ".join(str(length) for length in lengths)


def _is_a(value: Any, kind: type) -> bool:
    """Whether ``value`` is of a field's ``kind``, as Python code may give it: 2 is a float, True no number."""
    if kind in (int, float):
        wanted = numbers.Integral if kind is int else numbers.Real
        return isinstance(value, wanted) and not isinstance(value, bool)
    return isinstance(value, kind)


@cache
def field_types(schema: type) -> dict[str, Any]:
    """The types of the fields of a dataclass, by name."""
    hints = typing.get_type_hints(schema)
    return {field.name: hints[field.name] for field in dataclasses.fields(schema)}


def without_none(kind: Any) -> Any:
    """Optional[T] -> T; anything else as it is."""
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        inner = [k for k in typing.get_args(kind) if k is not type(None)]
        if len(inner) == 1:
            return inner[0]
    return kind


def item_type(kind: Any) -> Any:
    """list[T] -> T; anything else as it is."""
    return typing.get_args(kind)[0] if typing.get_origin(kind) is list else kind


def section_of(kind: Any) -> type | None:
    """The dataclass behind a field's type, or None if the field is a value."""
    kind = without_none(kind)
    return kind if dataclasses.is_dataclass(kind) else None


def describe(kind: Any) -> str:
    """A type in the user's words."""
    words = {float: "a number", int: "a whole number", bool: "true or false", str: "text"}
    inner = without_none(kind)
    item = item_type(inner)
    if item is inner:
        text = words.get(inner, getattr(inner, "__name__", str(inner)))
    else:
        text = "a list, [...], each item " + words.get(item, "a section of keys")
    return text if inner is kind else f"{text} or null"


def config_keys(schema: type, prefix: str = "") -> list[str]:
    """Lists the dotted keys of all values in the tree of dataclasses ``schema``."""
    keys = []
    for name, kind in field_types(schema).items():
        section = section_of(kind)
        keys += config_keys(section, f"{prefix}{name}.") if section else [prefix + name]
    return keys
