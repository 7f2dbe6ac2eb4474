"""What a planner may believe about the walk: learned, or one of those that learning is compared with.

``ideal``: a command is followed at once. ``kinematic``: a white box, which knows how fast the walk takes up commands and by
which rule it places feet (M. Raibert, Legged Robots That Balance, 1986), as a good engineer would write it; nothing in it is
learned. ``blind``: a constant command, nobody looks where feet come down.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from quadpips_drake.baselines.motion_models.model_file import check_walk, load_models
from quadpips_drake.baselines.motion_models.models import MotionModels, ideal_coefficients, models_of_both_pairs
from quadpips_drake.baselines.motion_models.state import (
    BASE_SHIFT,
    COMMAND,
    CONSTANT,
    FEET,
    FEET_SHIFT,
    INPUTS,
    NEXT_VELOCITY,
    OUTPUTS,
    PAIRS,
)
from quadpips_drake.control.references.velocity_reference import longest_stance
from quadpips_drake.errors import UserInputError
from quadpips_drake.gaits.gaits import Gait, load_gait

VARIANTS = ("learned", "ideal", "kinematic", "blind")
GAITS = ("trot", "standing_trot", "slow_trot")
"""In which diagonal pairs swing in turn."""


@dataclass(frozen=True)
class Belief:
    """What the search works with."""

    models: MotionModels
    acceleration: float = np.inf
    """How fast the walk takes up commands [m/s^2]; infinite: the models say all."""


def check_gait(gait: str) -> None:
    """Raises UserInputError for a gait in which no diagonal pairs swing in turn."""
    load_gait(gait)
    if gait not in GAITS:
        raise UserInputError(f"gait '{gait}': diagonal pairs must swing in turn, as in {', '.join(GAITS)}")


def belief_of(variant: str, robot, gait: str, directory: Path | None, velocity_reference, tracking) -> Belief | None:
    """What a variant believes about a walk; None: nothing, nobody looks.

    Args:
        variant: one of VARIANTS.
        robot: RobotModel.
        gait: name.
        directory: of learned models; None: those that come with the package.
        velocity_reference: VelocityReferenceConfig of the walk, which learned models are checked against and only the
            white box looks into.
        tracking: TrackingConfig of the walk, for the check; None: not to be checked.

    Raises:
        UserInputError: there are no such models, or they are of another walk.
    """
    if variant == "learned":
        models = load_models(robot.name, gait, directory)
        if tracking is not None:
            check_walk(models, velocity_reference, tracking)
        return Belief(models)
    if variant == "ideal":
        T = step_duration(load_gait(gait))
        return Belief(_unlearned(robot, gait, T, ideal_coefficients(T)))
    if variant == "kinematic":
        T, coefficients = step_duration(load_gait(gait)), kinematic_coefficients(robot, load_gait(gait))
        return Belief(_unlearned(robot, gait, T, coefficients), velocity_reference.max_acceleration)
    return None


def step_duration(gait: Gait) -> float:
    """From one exchange of the pairs to the next [s]."""
    return 0.5 * gait.duration


def kinematic_coefficients(robot, gait: Gait) -> np.ndarray:
    """Coefficients (2, OUTPUTS, INPUTS) of a walk that reaches its command within a step; what it covers less while its
    velocity still changes is for the search to add.

    A foot comes down where its nominal foothold will be in the middle of its stance, below a base that goes on as commanded:
    base shift + nominal foothold + v (stance / 2), seen from where the base was.
    """
    T, ahead, first = step_duration(gait), 0.5 * longest_stance(gait), np.zeros((OUTPUTS, INPUTS))
    nominal = robot.nominal_footholds_B
    for axis in range(2):
        command = COMMAND.start + axis
        first[BASE_SHIFT.start + axis, command] = T
        first[NEXT_VELOCITY.start + axis, command] = 1.0
        for foot, leg in enumerate(PAIRS[0]):
            row = FEET_SHIFT.start + 2 * foot + axis
            first[row, command] = T + ahead
            first[row, CONSTANT] = nominal[leg, axis]
            first[row, FEET.start + 2 * leg + axis] = -1.0
    return models_of_both_pairs(first)


def _unlearned(robot, gait: str, step_duration: float, coefficients: np.ndarray) -> MotionModels:
    return MotionModels(robot.name, gait, step_duration, coefficients, np.zeros((2, OUTPUTS, OUTPUTS)))
