"""When a stage computes and when its results are there: what the configurations of all stages begin with."""

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError

MAX_LATE_RESULTS = 250
"""Most results of one stage that are on their way; some are megabytes."""


def stage_rate(default: float, *, on_demand: bool = False):
    """Returns the field ``rate`` of a stage [Hz]; ``on_demand``: zero computes whenever the output is read."""
    return ranged(default, 1e-3, 10_000.0, zero=on_demand)


@configuration
class StageConfig:
    """Rate and latency of a stage; its own configuration derives from this."""

    rate: float = stage_rate(10.0)
    """How often the stage computes, in simulated time [Hz]."""
    latency: float = ranged(0.0, 0.0, 10.0)
    """How much later than its inputs a result appears, in simulated time [s]."""

    def __post_init__(self):
        # A class of somebody else may have replaced the field, and with it its range.
        if not (1e-3 <= self.rate <= 10_000.0 or (self.rate == 0.0 and isinstance(self, OnDemandStageConfig))):
            raise UserInputError(f"rate must be 0.001..10000 Hz, not {self.rate:g}")
        if self.latency > 0.0 and self.rate == 0.0:
            raise UserInputError("a latency needs a rate: results that are computed when they are read are never late")
        if self.latency * self.rate > MAX_LATE_RESULTS:
            raise UserInputError(f"latency must be at most {MAX_LATE_RESULTS} / rate: later results would fill the memory")

    @property
    def period(self) -> float:
        """Time between two computations [s]; 0: whenever its output is read."""
        return 1.0 / self.rate if self.rate > 0.0 else 0.0


@configuration
class OnDemandStageConfig(StageConfig):
    """The same for a stage that needs no rate, because what it computes depends on its inputs alone."""

    rate: float = stage_rate(0.0, on_demand=True)
    """How often the stage computes, in simulated time [Hz]; 0: whenever its output is read."""
