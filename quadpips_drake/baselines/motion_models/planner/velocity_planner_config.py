"""Settings of the planner over velocity commands."""

from dataclasses import field

from quadpips_drake.baselines.motion_models.exchange import SAMPLE_RATE
from quadpips_drake.baselines.motion_models.planner.adaptation import AdaptationConfig
from quadpips_drake.baselines.motion_models.planner.command_search import CommandSearchConfig
from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.framework.stage_config import StageConfig, stage_rate


@configuration
class VelocityPlannerConfig(StageConfig):
    """When the planner stops, waits and gives up."""

    rate: float = stage_rate(SAMPLE_RATE)
    """How often it looks for exchanges of the feet [Hz]; as often as when the models' data were collected."""

    search: CommandSearchConfig = field(default_factory=CommandSearchConfig)
    """Of commands."""
    adaptation: AdaptationConfig = field(default_factory=AdaptationConfig)
    """Of learned models to the walk as it is."""
    goal_tolerance: float = ranged(0.10, 0.01, 1.0)
    """The robot stops when its base is this near to the goal, or past it within ``restart_distance`` [m]."""
    restart_distance: float = ranged(0.25, 0.01, 10.0)
    """And walks again when it is this far from it afterwards [m]."""
    max_map_age: float = ranged(0.5, 0.0, 100.0)
    """A map older than this is none [s]."""
    max_wait: float = ranged(2.0, 0.0, 100.0)
    """How long it waits for a map before it gives up [s]."""
    max_failures: int = ranged(8, 0, 1_000_000)
    """It gives up after more searches without result than this in a row [1]."""
    patience: int = ranged(12, 1, 1_000_000)
    """After so many plans in a row without ``progress`` it looks further ahead (``search.far_horizon``) until it gets on
    [1]."""
    progress: float = ranged(0.25, 0.01, 100.0)
    """How much nearer to the goal counts as getting on [m]."""
    max_idle: int = ranged(60, 1, 1_000_000)
    """It gives up after more plans in a row than this without ``progress`` [1]."""
    pause: float = ranged(1.0, 0.0, 100.0)
    """How long it stands after a stop because no foothold was safe [s]."""
    blind_speed: float = ranged(0.4, -1.0, 2.0)
    """Forward command of the variant that looks at nothing [m/s]."""
