"""Every key of every configuration with hostile values: refused in one line, or harmless.

What is refused is tried on the classes themselves and on the command line's way of loading. What is accepted is tried with
the ends of all ranges on the stages whose work or memory depends on it, in a process of its own with bounded memory, so
that a crash or an endless loop is a failed test and not the end of all tests.
"""

import math

import numpy as np
import pytest

from quadpips_drake.configuration.layers import override_layer
from quadpips_drake.configuration.loading import load_config
from quadpips_drake.configuration.schema import config_keys
from quadpips_drake.errors import UserInputError
from quadpips_drake.trials.trial import TrialConfig
from quadpips_drake.trials.walk_trial import WalkTrialConfig
from tests.configuration.classes import configuration_classes, number_fields

NO_NUMBERS = [math.nan, "many", True, [[1.0]], {}, object(), b"1", 1j, np.array([1.0, 2.0])]
BEYOND_ALL = [-math.inf, -1e300, -(10**23), 10**23, 10**5000]
TEXTS = ["nan", ".nan", ".inf", "-.inf", "0", "-1", "1e300", "-1e300", "1" + "0" * 23, "9" * 5000, "x", "''", "true", "[1]"]
TEXTS += ["[[]]", "{}", "{a: 1}", "null", "~", "!!bool abc", "!!timestamp x", "&a [*a]", "0x" + "f" * 100, "[" * 5000, "\0"]
CASES = 300
"""Keys and texts that are tried on the command line's way, chosen by a seed."""


def is_refused(cls: type, **values) -> bool:
    """Whether ``cls`` refuses the values as user errors are to be refused; any other exception goes on."""
    try:
        cls(**values)
    except UserInputError as error:
        assert str(error).isprintable() and len(str(error)) < 600
        return True
    return False


@pytest.mark.parametrize("cls", configuration_classes(), ids=lambda cls: cls.__name__)
def test_no_class_takes_what_is_not_in_its_ranges(cls):
    for name, kind, bounds in number_fields(cls):
        default = getattr(cls(), name)
        outside = [bounds.low - 1, bounds.high + 1] if bounds.high < math.inf else [bounds.low - 1]
        numbers = [*outside, *BEYOND_ALL, *([1.5] if kind is int else [math.inf] if bounds.high < math.inf else [])]
        for value in [*NO_NUMBERS, *numbers]:
            wrong = [value] * max(len(default), 1) if isinstance(default, list) else value
            assert is_refused(cls, **{name: wrong}), f"{cls.__name__}.{name} takes {value!r}"


def test_every_key_of_the_command_line_refuses_or_takes():
    random = np.random.default_rng(8)
    cases = [
        (schema, key, text) for schema in (TrialConfig, WalkTrialConfig) for key in config_keys(schema) for text in TEXTS
    ]
    refused = 0
    for index in random.choice(len(cases), CASES, replace=False):
        schema, key, text = cases[index]
        try:
            load_config(schema, [override_layer(f"{key}={text}")])
        except UserInputError as error:
            refused += 1
            assert str(error).isprintable() and len(str(error)) < 800
    assert refused > 0.6 * CASES


@pytest.mark.parametrize(
    "text",
    [
        "stages.perception.regions.margin=.inf",
        "stages.perception.regions.margin=1e6",
        "stages.perception.regions.overlap=.inf",
        "stages.perception.superpixels.iterations=1000000000",
        "stages.station.camera.max_range=.inf",
        "stages.station.camera.width=100000",
        "stages.station.camera={width: 4096, height: 4096}",
        "stages.station.model_error.payload=.inf",
        "stages.station.model_error.payload=1e300",
        "stages.perception.egocan.cylinder_width=1000000",
        "stages.perception.egocan.cylinder_height=10000000000000000000",
        "stages.perception.egocan.cap_size=100000",
        "stages.planning.torso.yaw_count=100000000",
        "stages.tracking.mpc.intervals=100000",
        "stages.tracking.mpc.uniform_interval=1e-9",
        "stages.tracking.mpc.rate=1e9",
        "stages.perception.egocan.latency=10",
        "stages.planning.swings.target.samples=1000000000",
        "duration=.nan",
        "duration=1e9",
        "log_rate=1e9",
        "{}=1",
    ],
)
def test_what_once_crashed_or_never_ended_is_refused(text):
    with pytest.raises(UserInputError):
        load_config(TrialConfig, [override_layer(text)])
