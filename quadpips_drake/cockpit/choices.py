"""What can be chosen in the cockpit, and the trial that a choice stands for."""

from dataclasses import dataclass
from functools import lru_cache

from quadpips_drake.diagrams.planners import planners
from quadpips_drake.errors import UserInputError
from quadpips_drake.gaits.gaits import GAITS, gait_names
from quadpips_drake.robots.robot_library import DEFAULT_ROBOT, robot_names
from quadpips_drake.terrain.library import terrain_names
from quadpips_drake.trials.simulated_trial import MAX_SAMPLES, SimulatedTrial, problem_with_trial_start
from quadpips_drake.trials.trial import Trial, TrialConfig
from quadpips_drake.trials.trial_options import load_trial_config
from quadpips_drake.trials.walk_trial import WalkTrial, WalkTrialConfig
from quadpips_drake.trials.world import world_of

BY_VELOCITY = "velocity"
"""In the place of a planner: the robot walks as it is told, and sees nothing."""
SAMPLE_RATE = 100.0
"""Samples per simulated second [Hz]; a single step leads to the next one."""
LONGEST = MAX_SAMPLES / SAMPLE_RATE
"""Longest run [s]."""


@dataclass(frozen=True)
class Choice:
    """Who walks where, and who plans."""

    robot: str = DEFAULT_ROBOT
    """Name, or path of its robot.yaml."""
    terrain: str = TrialConfig.terrain
    """Name in the library, or path of a terrain file."""
    planner: str = TrialConfig.planner
    """Name of the planner, or BY_VELOCITY."""
    seed: int = 0
    difficulty: float | None = None
    """Of a terrain of the library, in its unit; None: its own."""
    duration: float = LONGEST
    """Longest simulated time [s]."""
    sets: tuple[str, ...] = ()
    """Values of the configuration that are replaced, KEY=VALUE."""

    @property
    def is_walk(self) -> bool:
        """Whether the robot walks by velocity command."""
        return self.planner == BY_VELOCITY

    def config(self) -> TrialConfig | WalkTrialConfig:
        """The configuration of the trial; raises UserInputError for what there is not."""
        options = {"terrain": self.terrain, "seed": self.seed, "duration": self.duration, "log_rate": SAMPLE_RATE}
        if self.difficulty is not None:
            options["difficulty"] = self.difficulty
        if self.is_walk:
            options |= {"velocity": [0.0, 0.0, 0.0]}
        else:
            options["planner"] = self.planner
        schema = WalkTrialConfig if self.is_walk else TrialConfig
        return load_trial_config(schema, robot=self.robot, sets=self.sets, **options)

    def check(self) -> None:
        """Raises UserInputError if there is no such robot, terrain or planner, or the robot cannot stand there."""
        config = self.config()
        problem = problem_with_trial_start(config, *world_of(config, None, None))
        if problem:
            raise UserInputError(problem)

    def trial(self, **options) -> SimulatedTrial:
        """The trial, in which one may have a hand; for the ``options`` see Trial. Raises UserInputError."""
        return (WalkTrial if self.is_walk else Trial)(self.config(), live=True, **options)


@lru_cache(maxsize=8)  # installed packages are looked through for them
def possibilities(choice: Choice) -> dict[str, list[str]]:
    """What may be chosen: {"robot": names, ...}, with what is chosen now, which may be a file."""
    known = {"robot": robot_names(), "terrain": terrain_names(), "planner": [*planners.names(), BY_VELOCITY]}
    lists = {key: names if getattr(choice, key) in names else [*names, getattr(choice, key)] for key, names in known.items()}
    return lists | {"gait": [*GAITS, *(name for name in gait_names() if name not in GAITS)]}
