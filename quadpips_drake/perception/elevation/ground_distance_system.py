"""The system around the signed distance from the ground."""

from quadpips_drake.framework.stage import Inputs, Stage
from quadpips_drake.perception.elevation.elevation_config import DistanceConfig
from quadpips_drake.perception.elevation.signed_distance import signed_distance
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.regions import ElevationMap, SignedDistance


class GroundDistance(Stage):
    """Works out how far from the ground each point around the robot is.

    Euclidean distance transforms of both signs; see perception.elevation.signed_distance.

    .. pydrake_system::

        name: GroundDistance
        input_ports:
        - elevation_map
        output_ports:
        - signed_distance

    - elevation_map: abstract ElevationMap, frame W.
    - signed_distance: abstract SignedDistance, frame W, around the base, at ``config.rate`` (5 Hz); empty when nothing is
      known.
    """

    WORTH_A_THREAD = True

    def __init__(self, config: DistanceConfig | None = None, *, timings: StageTimings | None = None):
        super().__init__("ground_distance", config or DistanceConfig(), memory=SignedDistance.empty(), timings=timings)
        self.declare_input("elevation_map", ElevationMap)
        self.declare_output("signed_distance", SignedDistance)

    def update(self, inputs: Inputs, memory: SignedDistance, time: float) -> SignedDistance:
        """The distances from the map of this moment."""
        return signed_distance(inputs.elevation_map, self.config)
