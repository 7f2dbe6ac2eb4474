"""Which velocities the walks go through that motion models are learned from.

Forward speeds in steps of 0.1 m/s, in an order in which each pair of them follows each other once before any does twice
(an Eulerian circuit through all ordered pairs), each held for 1 to 6 steps; a part of them with a sideways or a turning
velocity on top. Walks of one length are cut out of that; each begins, from standing, with the speed that the one before
ended with, so that no pair is lost.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from quadpips_drake.baselines.motion_models.command_sequence import HeldCommand
from quadpips_drake.errors import UserInputError

SPEED_STEP, TOP_SPEED = 0.1, 1.0
"""Of the forward speeds [m/s]."""
SIDEWAYS, TURN = 0.2, 0.3
"""On top of some of them [m/s, rad/s]."""
ASIDE_SHARE = 0.25
"""Part of the commands with something on top [1]."""
MOST_STEPS = 6
"""Longest hold of a command [1]."""
MOST_WALKS = 2000
"""More are not planned."""
SPLITS = ("train", "val", "test")
_SPLIT_CYCLE = ("train", "train", "val", "train", "train", "test", "train", "train")


@dataclass(frozen=True)
class PlannedWalk:
    """One walk of the data."""

    number: int
    """Which one it is, from 0 on."""
    commands: tuple[HeldCommand, ...]
    """In order."""
    bumpy: bool = False
    """Whether on uneven ground."""

    @property
    def split(self) -> str:
        """train, val or test: by walk, since neighbouring steps know each other."""
        return _SPLIT_CYCLE[self.number % len(_SPLIT_CYCLE)]


def speeds_up_to(top: float) -> np.ndarray:
    """The forward speeds [m/s] that a robot is asked for whose legs allow ``top`` [m/s]."""
    return SPEED_STEP * np.arange(int(min(top, TOP_SPEED) / SPEED_STEP + 1e-6) + 1)


def plan_walks(walks: int, steps: int, speeds: np.ndarray, seed: int, *, feasible, bumpy_share: float = 0.0) -> list:
    """Returns PlannedWalks.

    Args:
        walks: how many.
        steps: how many steps each of them has.
        speeds: forward speeds [m/s], from ``speeds_up_to``.
        seed: of order, holds and what comes on top.
        feasible: velocity (3,) -> what the legs can do of it; a velocity on top that they cannot is left out.
        bumpy_share: part of the walks on uneven ground; those go straight ahead.
    """
    if walks > MOST_WALKS:
        raise UserInputError(f"--minutes: at most {MOST_WALKS} walks, not {walks}")
    rng = np.random.default_rng([seed, 13])
    forward = _speeds_in_pairs(speeds, rng)
    planned, last = [], next(forward)
    for number in range(walks):
        # Evenly spread: the share of uneven walks among the first n is as close to it as it can be, for each n.
        bumpy = int((number + 1) * bumpy_share + 1e-9) > int(number * bumpy_share + 1e-9)
        commands, left = [], steps
        while left > 0:
            speed = last if not commands else next(forward)
            hold = min(int(rng.integers(1, MOST_STEPS + 1)), left)
            commands.append(HeldCommand(_with_something_on_top(float(speed), rng, feasible, allowed=not bumpy), hold))
            left, last = left - hold, speed
        planned.append(PlannedWalk(number, tuple(commands), bumpy))
    return planned


def _with_something_on_top(speed: float, rng, feasible, allowed: bool) -> tuple[float, float, float]:
    aside, kind = rng.random() < ASIDE_SHARE, rng.integers(4)
    left, turn = ((SIDEWAYS, 0.0), (-SIDEWAYS, 0.0), (0.0, TURN), (0.0, -TURN))[kind]
    velocity = (round(speed, 3), left, turn)
    if not (aside and allowed and np.allclose(feasible(np.array(velocity)), velocity)):
        return (round(speed, 3), 0.0, 0.0)
    return velocity


def _speeds_in_pairs(speeds: np.ndarray, rng) -> Iterator[float]:
    """Speeds without end in which each ordered pair, also of one with itself, comes once a round; the first is standing."""
    yield speeds[0]
    while True:
        for index in _circuit(len(speeds), rng)[1:]:
            yield speeds[index]


def _circuit(nodes: int, rng) -> list[int]:
    """A walk from 0 to 0 along each of the ``nodes`` x ``nodes`` directed edges once, in random order (Hierholzer 1873)."""
    left = [list(rng.permutation(nodes)) for _ in range(nodes)]
    stack, circuit = [0], []
    while stack:
        if left[stack[-1]]:
            stack.append(int(left[stack[-1]].pop()))
        else:
            circuit.append(stack.pop())
    return circuit[::-1]
