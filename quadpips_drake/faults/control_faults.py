"""Faults of the controllers' side: solver outages and footholds that are not where they are believed to be."""

from dataclasses import dataclass, field

from quadpips_drake.errors import UserInputError


@dataclass
class ControlFaultConfig:
    """What goes wrong between planning and the MPC; nothing by default."""

    outage_start: list[float] = field(default_factory=list)
    """Times at which the MPC's solver begins to fail [s]."""
    outage_duration: float = 0.1
    """How long it fails each time [s]."""
    terrain_height_error: float = 0.0
    """So much higher than they are the footholds are believed to be [m]; negative: lower."""

    def __post_init__(self):
        if not abs(self.terrain_height_error) <= 0.5:
            raise UserInputError(f"terrain_height_error must be -0.5..0.5 m, not {self.terrain_height_error}")
        if not 0.0 <= self.outage_duration <= 1e6:
            raise UserInputError(f"outage_duration must be 0..1e6 s, not {self.outage_duration}")

    def is_out(self, time: float) -> bool:
        """Whether the solver is to fail at ``time`` [s]."""
        return any(0.0 <= time - start + 1e-9 < self.outage_duration for start in self.outage_start)
