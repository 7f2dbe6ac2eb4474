"""What the page asks for, JSON objects like {"do": "goal", "x": 1.0, "y": 0.5}: checked, and passed on to the session."""

from dataclasses import replace

from quadpips_drake.cockpit.choices import possibilities
from quadpips_drake.cockpit.live_trial import LAYERS
from quadpips_drake.cockpit.session import Session
from quadpips_drake.cockpit.stock import KINDS
from quadpips_drake.configuration.schema import MAX_SEED
from quadpips_drake.errors import UserInputError

MAX_STEPS = 1000
"""Largest number of steps at once."""
MAX_SPEED = 100.0
"""Larger ones count as this [1]."""


def obey(session: Session, message: object) -> None:
    """Does what ``message`` asks for.

    Raises:
        UserInputError: it asks for nothing that there is.
    """
    action = message.get("do") if isinstance(message, dict) else None
    if not isinstance(action, str) or action not in _ACTIONS:
        raise UserInputError(f"the page asks for {str(action)!r:.40}; there are: {', '.join(_ACTIONS)}")
    _ACTIONS[action](session, message)


def _number(message: dict, key: str, low: float = -1000.0, high: float = 1000.0) -> float:
    value = message.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
        raise UserInputError(f"'{key}' must be a number")
    if not low <= value <= high:  # also an integer that is too large to be written as a float
        raise UserInputError(f"'{key}' must be {low:g} to {high:g}, not {value!s:.20}")
    return float(value)


def _whole_number(message: dict, key: str, low: int, high: int) -> int:
    value = _number(message, key, low, high)
    if not value.is_integer():
        raise UserInputError(f"'{key}' must be a whole number, not {value:g}")
    return int(value)


def _one_of(message: dict, key: str, names) -> str:
    value = message.get(key)
    if value not in list(names):
        raise UserInputError(f"'{key}' must be one of: {', '.join(names)}")
    return value


def _begin(session: Session, message: dict) -> None:
    choice = session.snapshot.choice
    known = possibilities(choice)
    names = {key: _one_of(message, key, known[key]) for key in ("robot", "terrain", "planner") if key in message}
    if "seed" in message:
        names["seed"] = _whole_number(message, "seed", 0, MAX_SEED)
    if names.get("terrain", choice.terrain) != choice.terrain:
        names["difficulty"] = None  # it was that of the other one
    session.begin(replace(choice, **names))


def _speed(session: Session, message: dict) -> None:
    session.set_speed(None if message.get("speed") is None else _number(message, "speed", 0.001, MAX_SPEED))


def _push(session: Session, message: dict) -> None:
    force = [_number(message, key, -1e4, 1e4) for key in ("forward", "left", "up")]
    session.push(*force, _number(message, "duration", 0.0, 10.0))


def _command(session: Session, message: dict) -> None:
    gait = _one_of(message, "gait", possibilities(session.snapshot.choice)["gait"])
    session.command(gait, tuple(_number(message, key, -10.0, 10.0) for key in ("forward", "left", "turn")))


_ACTIONS = {
    "begin": _begin,
    "pause": lambda session, message: session.pause(True),
    "go_on": lambda session, message: session.pause(False),
    "step": lambda session, message: session.step(_whole_number(message, "number", 1, MAX_STEPS)),
    "speed": _speed,
    "goal": lambda session, message: session.move_goal(_number(message, "x"), _number(message, "y")),
    "push": _push,
    "spawn": lambda session, message: session.spawn(
        _one_of(message, "kind", KINDS), _number(message, "x"), _number(message, "y")
    ),
    "command": _command,
    "layer": lambda session, message: session.show_layer(_one_of(message, "layer", LAYERS), message.get("shown") is True),
}
