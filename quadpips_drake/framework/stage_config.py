"""When a stage computes and when its results are there: what the configurations of all stages begin with."""

from dataclasses import dataclass

from quadpips_drake.errors import UserInputError


@dataclass
class StageConfig:
    """Rate and latency of a stage; its own configuration derives from this."""

    rate: float = 10.0
    """How often the stage computes, in simulated time [Hz]."""
    latency: float = 0.0
    """How much later than its inputs a result appears, in simulated time [s]."""

    def __post_init__(self):
        if not self.least_rate() <= self.rate <= 10_000.0:
            raise UserInputError(f"rate must be {self.least_rate():g}..10000 Hz, is {self.rate:g}")
        if not 0.0 <= self.latency <= 10.0:
            raise UserInputError(f"latency must be 0..10 s, is {self.latency:g}")
        if self.latency > 0.0 and self.rate == 0.0:
            raise UserInputError("a latency needs a rate: results that are computed when they are read are never late")

    @staticmethod
    def least_rate() -> float:
        """[Hz]"""
        return 1e-3

    @property
    def period(self) -> float:
        """Time between two computations [s]; 0: whenever its output is read."""
        return 1.0 / self.rate if self.rate > 0.0 else 0.0


@dataclass
class OnDemandStageConfig(StageConfig):
    """The same for a stage that needs no rate, because what it computes depends on its inputs alone."""

    rate: float = 0.0
    """How often the stage computes, in simulated time [Hz]; 0: whenever its output is read."""

    @staticmethod
    def least_rate() -> float:
        """[Hz]"""
        return 0.0
