"""Configuration of the steppability segmentation; the network itself is in quadpips_drake.learning."""

from dataclasses import dataclass

from quadpips_drake.errors import UserInputError


@dataclass
class SteppabilityConfig:
    """Whether and how often depth images are labelled by the network."""

    enabled: bool = False
    """Whether the network runs; without it all ground is of unknown steppability and judged by its geometry."""
    period: float = 0.2
    """Time between two label images [s] (5 Hz in QuadPiPS); in between, points keep the labels they have."""
    latency: float = 0.05
    """How much later than their image labels appear [s], in simulated time; less than the period."""
    model: str = ""
    """Directory of a model that 'quadpips train' has written; empty: the one that comes with the package."""

    def __post_init__(self):
        if not 0.001 <= self.period <= 1000:
            raise UserInputError(f"steppability: period must be 0.001..1000 s, got {self.period}")
        if not 0 <= self.latency < self.period:
            raise UserInputError(f"steppability: latency must be 0 s or more and less than the period, got {self.latency}")
