"""What the page may ask for: everything else is refused with one line."""

import pytest

from quadpips_drake.cockpit.choices import Choice
from quadpips_drake.cockpit.messages import obey
from quadpips_drake.cockpit.snapshot import Snapshot
from quadpips_drake.errors import UserInputError


class Recorder:
    """Takes down what is called in the place of a session."""

    def __init__(self):
        self.snapshot, self.calls = Snapshot("paused", choice=Choice(terrain="gap", difficulty=0.2)), []

    def __getattr__(self, name):
        return lambda *arguments: self.calls.append((name, *arguments))


@pytest.mark.parametrize(
    ("message", "call"),
    [
        ({"do": "goal", "x": 1, "y": -0.5}, ("move_goal", 1.0, -0.5)),
        ({"do": "push", "forward": 0, "left": 100, "up": 0, "duration": 0.1}, ("push", 0.0, 100.0, 0.0, 0.1)),
        ({"do": "spawn", "kind": "wall", "x": 2, "y": 0}, ("spawn", "wall", 2.0, 0.0)),
        ({"do": "command", "gait": "trot", "forward": 0.3, "left": 0, "turn": -0.2}, ("command", "trot", (0.3, 0.0, -0.2))),
        ({"do": "step", "number": 10}, ("step", 10)),
        ({"do": "pause"}, ("pause", True)),
        ({"do": "speed", "speed": None}, ("set_speed", None)),
        ({"do": "layer", "layer": "labels", "shown": False}, ("show_layer", "labels", False)),
        ({"do": "begin", "seed": 4}, ("begin", Choice(terrain="gap", difficulty=0.2, seed=4))),
        ({"do": "begin", "terrain": "flat"}, ("begin", Choice(terrain="flat"))),
    ],
    ids=lambda value: value["do"] if isinstance(value, dict) else "",
)
def test_a_message_becomes_a_call(message, call):
    session = Recorder()
    obey(session, message)
    assert session.calls == [call]


@pytest.mark.parametrize(
    "message",
    [
        None,
        [],
        {},
        {"do": "fly"},
        {"do": ["goal"]},
        {"do": "goal", "x": 1},
        {"do": "goal", "x": "1", "y": 0},
        {"do": "goal", "x": float("nan"), "y": 0},
        {"do": "goal", "x": 1e9, "y": 0},
        {"do": "goal", "x": True, "y": 0},
        {"do": "goal", "x": float("inf"), "y": 0},
        {"do": "goal", "x": 10**400, "y": 0},
        {"do": "spawn", "kind": "tree", "x": 0, "y": 0},
        {"do": "command", "gait": "gallop", "forward": 0, "left": 0, "turn": 0},
        {"do": "begin", "terrain": "/etc/passwd"},
        {"do": "begin", "seed": -1},
        {"do": "begin", "seed": 0.5},
        {"do": "begin", "robot": ["go2"]},
        {"do": "speed", "speed": 0},
        {"do": "step", "number": 0},
        {"do": "layer", "layer": "/drake", "shown": False},
    ],
    ids=lambda message: f"{message!s:.40}",
)
def test_nonsense_is_refused(message):
    session = Recorder()
    with pytest.raises(UserInputError):
        obey(session, message)
    assert session.calls == []
