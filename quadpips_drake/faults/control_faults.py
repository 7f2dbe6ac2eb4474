"""Faults of the controllers' side: solver outages and footholds that are not where they are believed to be."""

from quadpips_drake.configuration.schema import configuration, ranged


@configuration
class ControlFaultConfig:
    """What goes wrong between planning and the MPC; nothing by default."""

    outage_start: list[float] = ranged([], 0.0, 1e6, lengths=range(1001))
    """Times at which the MPC's solver begins to fail [s]."""
    outage_duration: float = ranged(0.1, 0.0, 1e6)
    """How long it fails each time [s]."""
    terrain_height_error: float = ranged(0.0, -0.5, 0.5)
    """So much higher than they are the footholds are believed to be [m]; negative: lower."""

    def is_out(self, time: float) -> bool:
        """Whether the solver is to fail at ``time`` [s]."""
        return any(0.0 <= time - start + 1e-9 < self.outage_duration for start in self.outage_start)
