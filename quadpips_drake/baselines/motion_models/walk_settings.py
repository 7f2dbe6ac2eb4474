"""The walk that motion models are learned from, and how to tell it from another one.

The only module here that knows how the walk is made: for the planner and its models it is a black box.
"""

import hashlib
import json
from typing import Any

from quadpips_drake.configuration.schema import config_keys
from quadpips_drake.control.mpc.mpc_config import walking_mpc
from quadpips_drake.control.references.velocity_reference import VelocityReferenceConfig

MAX_ACCELERATION = 4.0
"""How fast the walk takes up a commanded velocity [m/s^2]; docs/motion_models.md says why not 0.5, as otherwise."""
_NOT_THE_WALK = ("faults", "latency", "safety")
"""Sections and keys that spoil a walk or make results late, for studies, or say when it is broken off: what was learned is
used as it is under them."""


def motion_models_walk() -> VelocityReferenceConfig:
    """The velocity reference of this planner's walk; it differs from that of ``quadpips walk`` in MAX_ACCELERATION alone."""
    return VelocityReferenceConfig(max_acceleration=MAX_ACCELERATION)


def walk_settings(velocity_reference, tracking) -> dict[str, Any]:
    """What decides the walk's motion: dotted key -> value, of a VelocityReferenceConfig and a TrackingConfig."""
    settings = {}
    for section, config in (("velocity_reference", velocity_reference), ("tracking", tracking)):
        for key in config_keys(type(config)):
            if not set(key.split(".")) & set(_NOT_THE_WALK):
                settings[f"{section}.{key}"] = _plain(_value(config, key))
    return settings


def differing_setting(learned: dict[str, Any], velocity_reference, tracking) -> str | None:
    """What is otherwise than in the walk that a model was ``learned`` from, in words; None where nothing is.

    A key that is newer than the model must have its default, which is what the walk did without it; one that has gone
    since counts for nothing.
    """
    present = walk_settings(velocity_reference, tracking)
    defaults = walk_settings(motion_models_walk(), type(tracking)(mpc=walking_mpc()))
    for key, value in present.items():
        then = learned.get(key, defaults[key])
        if then != value:
            return f"{key} is {value}, and was {then} when it was learned"
    return None


def settings_digest(settings: dict[str, Any]) -> str:
    """A short name for settings."""
    return hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()[:12]


def _value(config, key: str):
    for name in key.split("."):
        config = getattr(config, name)
    return config


def _plain(value):
    """The value as JSON gives it back."""
    return json.loads(json.dumps([*value] if isinstance(value, tuple | list) else value))
