"""Configuration of what is remembered of swings that were tried."""

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.stage_config import StageConfig, stage_rate

SCOPES = ("off", "site", "general")
MAX_RECORDS = 50_000


@configuration
class ExperienceConfig(StageConfig):
    """How experience enters the foothold search (Asselmeier et al., arXiv 2501.00112), and how it is gathered."""

    rate: float = stage_rate(50.0)
    """How often the recorder looks for a new swing plan [Hz]."""

    scope: str = "off"
    """Where it holds: "site", at the same places in W of the same terrain; "general", wherever the stance is alike; "off":
    there is none, and nothing in the diagram that would gather any."""
    file: str = ""
    """The library to begin with, a file of 'quadpips evaluate experience' or of an earlier run; empty: nothing is known."""
    learn: bool = True
    """Whether swings that are tried are added."""

    weight: float = ranged(2.0, 0.0, 1000.0)
    """Cost of a transition that is known to fail [m]; it is also the most that experience makes one cost."""
    easy_cost: float = ranged(-35.0, -1e6, 1e6)
    """Optimal cost of an easy swing [1], barriers make it negative; what a swing costs more is what counts."""
    scale: float = ranged(60.0, 1e-3, 1e6)
    """Mean cost above that at which a transition costs tanh 1 = 76 % of the weight [1]."""
    failure_cost: float = ranged(180.0, 0.0, 1e6)
    """What a swing counts for which there is no motion [1]; at three times the scale it saturates."""
    width: float = ranged(0.06, 1e-3, 10.0)
    """Standard deviation of the radial basis function over the places where feet land [m] ..."""
    start_width: float = ranged(0.15, 1e-3, 10.0)
    """... and over those where the four feet stand before [m]."""
    same: float = ranged(0.02, 0.0, 1.0)
    """Transitions whose feet are all nearer to each other than this are one record [m]."""
    half_life: float = ranged(0.0, 0.0, 1e9)
    """Plans after which a record that was not tried again counts half; 0: nothing is forgotten [1]."""
    max_records: int = ranged(5000, 1, MAX_RECORDS)
    """Most records; those that were tried least often go first, of these the oldest."""

    def __post_init__(self):
        super().__post_init__()
        if self.scope not in SCOPES:
            raise UserInputError(f"scope '{self.scope}' is unknown; known: {', '.join(SCOPES)}")

    @property
    def enabled(self) -> bool:
        """Whether there is any experience."""
        return self.scope != "off"
