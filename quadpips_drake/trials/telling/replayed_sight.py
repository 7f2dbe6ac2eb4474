"""What the robot saw, computed anew from its log: perception fed with images that are rendered at moments of a replay."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator

from quadpips_drake.diagrams.perception_module import PerceptionModule
from quadpips_drake.trials.telling.replay import Replay
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.visualization.film.words import depth_picture


class ReplayedSight:
    """Goes forward through a replay. The sensors' noise is another one than in the trial, all else the same."""

    def __init__(self, replay: Replay):
        config, station = replay.files.config, replay.station
        self._station, self._max_range = station, config.stages.station.camera.max_range
        self._perception = PerceptionModule(
            replay.robot,
            station.camera_intrinsics,
            config.stages.perception,
            camera=config.stages.station.camera_name,
            seed=config.seed,
        )
        self._simulator: Simulator | None = None

    def look(self, station_context, state: RobotState):
        """Takes in the moment that the station's context shows; returns AffordanceImage and RegionSet."""
        depth = self._station.GetOutputPort("depth_image").Eval(station_context)
        if self._simulator is None:
            context = self._perception.CreateDefaultContext()
            context.SetTime(state.stamp)
            self._fix(context, depth, state)
            self._simulator = Simulator(self._perception, context)
        context = self._simulator.get_mutable_context()
        self._fix(context, depth, state)
        self._simulator.AdvanceTo(max(state.stamp, context.get_time()))
        ports = (self._perception.GetOutputPort(name) for name in ("affordance_image", "region_set"))
        return tuple(port.Eval(context) for port in ports)

    def picture(self, image) -> np.ndarray:
        """An AffordanceImage as a picture, uint8 (height, width, 3)."""
        return depth_picture(image.depth, image.labels, self._max_range)

    def _fix(self, context, depth, state: RobotState) -> None:
        self._perception.GetInputPort("depth_image").FixValue(context, AbstractValue.Make(depth))
        self._perception.GetInputPort("robot_state").FixValue(context, AbstractValue.Make(state))
