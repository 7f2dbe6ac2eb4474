"""Ranges of the keys: declared with the field, held in Python as well as in files."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from quadpips_drake.configuration.field_docs import field_docs, field_unit
from quadpips_drake.configuration.schema import check_tree, configuration, ranged
from quadpips_drake.errors import UserInputError


@configuration
class BaseConfig:
    """What others derive from."""

    rate: float = ranged(10.0, 0.1, 1000.0, zero=True)
    """How often [Hz];
    0: never."""

    def __post_init__(self):
        if self.rate == 13.0:
            raise UserInputError("unlucky")


@configuration
class PartConfig(BaseConfig):
    """All kinds of fields."""

    count: int = ranged(3, 1, 10)
    """[1]"""
    limit: float = ranged(float("inf"), 1.0, float("inf"))
    """Of time [s]."""
    point: list[float] = ranged([0.0, 1.0], -5.0, 5.0)
    """x, y [m]; yaw [rad]."""
    pitch: float | None = ranged(None, -1.0, 1.0)
    """[rad]"""
    name: str = "x"
    on: bool = True


@configuration
class WholeConfig:
    """A section and a list of sections."""

    part: PartConfig = field(default_factory=PartConfig)
    parts: list[PartConfig] = field(default_factory=list)


def test_values_in_range_are_taken_as_python_gives_them():
    part = PartConfig(rate=np.float32(2.0), count=np.int64(5), point=(1, 2), pitch=0.5, on=False)
    assert (part.rate, part.count, tuple(part.point), part.pitch, part.on) == (2.0, 5, (1, 2), 0.5, False)
    part = PartConfig(rate=0, limit=float("inf"), pitch=None)
    assert (part.rate, part.limit, part.pitch) == (0, float("inf"), None)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"rate": -1.0}, "rate must be 0 or 0.1..1000 Hz, not -1.0"),
        ({"rate": 0.01}, "rate must be 0 or 0.1..1000 Hz"),
        ({"rate": float("nan")}, "rate must be 0 or 0.1..1000 Hz, not nan"),
        ({"rate": float("inf")}, "not inf"),
        ({"rate": 10**5000}, "not a whole number beyond 64 bits"),
        ({"rate": "fast"}, "rate must be a number, not 'fast'"),
        ({"rate": True}, "rate must be a number, not true"),
        ({"rate": None}, "rate must be a number, not nothing"),
        ({"rate": 13.0}, "unlucky"),
        ({"count": 2.0}, "count must be a whole number, not 2.0"),
        ({"count": 0}, "count must be 1..10, not 0"),
        ({"limit": 0.5}, "limit must be at least 1 s, not 0.5"),
        ({"limit": float("nan")}, "limit must be at least 1 s, not nan"),
        ({"point": [1.0]}, "point must have 2 items, not 1"),
        ({"point": [1.0, 6.0]}, r"point\[1\] must be -5..5 m, rad, not 6.0"),
        ({"point": 3}, "point must be a list"),
        ({"pitch": 2.0}, "pitch must be -1..1 rad, not 2.0"),
        ({"name": "a\nb"}, "name must be printable text"),
        ({"name": "a" * 5000}, "name must be printable text of at most 4096 characters"),
        ({"name": 3}, "name must be text, not 3"),
        ({"on": 1}, "on must be true or false, not 1"),
    ],
)
def test_others_are_refused_where_they_are_made(values, said):
    with pytest.raises(UserInputError, match=said):
        PartConfig(**values)


def test_what_was_assigned_is_checked_on_demand():
    whole = WholeConfig(parts=[PartConfig()])
    check_tree(whole)
    whole.parts[0].count = 11
    with pytest.raises(UserInputError, match="count must be"):
        check_tree(whole)


def test_lists_are_not_shared():
    PartConfig().point.append(3.0)
    assert PartConfig().point == [0.0, 1.0]


def test_a_number_without_a_range_is_no_configuration():
    with pytest.raises(TypeError, match=r"Bad\.size: a number needs its range"):

        @configuration
        class Bad:
            size: list[float] = field(default_factory=list)

    @dataclass
    class Plain:
        size: float = 1.0

    with pytest.raises(TypeError, match=r"Derived\.size"):

        @configuration
        class Derived(Plain):
            pass


def test_documentation_and_units_come_from_the_line_below():
    assert field_docs(PartConfig)["rate"] == "How often [Hz]; 0: never."
    assert field_unit(PartConfig, "point") == "m, rad"
    assert field_unit(PartConfig, "count") == ""
    assert field_unit(PartConfig, "name") == ""
