"""The system around the elevation map."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.sensors import ImageDepth32F

from quadpips_drake.framework.stage import FirstUpdate, Inputs, Stage
from quadpips_drake.perception.elevation.elevation_config import FINE, ElevationMapConfig, with_preset
from quadpips_drake.perception.elevation.elevation_mapping import DepthView, begin_map, update_map, usable
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.regions import ElevationMap, GroundHeights
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.sensing import CameraIntrinsics


class ElevationMapper(Stage):
    """Fuses depth images into a robot-centred elevation map.

    A Kalman filter per cell behind a Mahalanobis gate, and a visibility check (P. Fankhauser et al., RA-L 2018); see
    perception.elevation.elevation_mapping. The first update assumes flat ground around the feet, as the egocan's does.

    .. pydrake_system::

        name: ElevationMapper
        input_ports:
        - depth_image
        - depth_image_<camera> (optional)
        - robot_state
        output_ports:
        - elevation_map
        - ground_heights

    - depth_image: ImageDepth32F (height, width) [m] in the optical frame C, sampled at ``config.rate``; NaN, 0 and negative
      are not measured, +inf is further than the sensor's range. One of another size is skipped.
    - depth_image_<camera>: the same of each further camera, at the same time.
    - robot_state: abstract RobotState, frame W, at the time of exposure; its joints tell where the feet stand at the start.
    - elevation_map: abstract ElevationMap, frame W, around the base; without a known cell before the first image.
    - ground_heights: GroundHeights, frame W: the same heights, as other stages take them.
    """

    WORTH_A_THREAD = True

    def __init__(
        self,
        robot: RobotModel,
        intrinsics: CameraIntrinsics,
        config: ElevationMapConfig | None = None,
        *,
        preset: str = FINE,
        camera: str = "front",
        further_cameras: Sequence[str] = (),
        timings: StageTimings | None = None,
    ):
        """Args: robot; pinhole parameters of its cameras; config, and what null stands for in it; names of the cameras."""
        config = config or ElevationMapConfig()
        filled = with_preset(config, preset)
        super().__init__(
            "elevation_mapper",
            config,
            memory=ElevationMap.empty(filled.cells, filled.cell),
            label="elevation_map",
            timings=timings,
            first=FirstUpdate.AT_INITIALIZATION,
        )
        self._robot, self._intrinsics, self._filled = robot, intrinsics, filled
        names = {"depth_image": camera} | {f"depth_image_{name}": name for name in further_cameras}
        self._X_BC = {port: np.array(robot.camera(name).X_BC, float) for port, name in names.items()}
        for port in self._X_BC:
            example = ImageDepth32F(intrinsics.width, intrinsics.height)
            self.declare_input(port, ImageDepth32F, example=example)
        self.declare_input("robot_state", RobotState)
        self.declare_output("elevation_map", ElevationMap)
        self.declare_output("ground_heights", GroundHeights, _heights)

    def initialize(self, inputs: Inputs, memory: ElevationMap, time: float) -> ElevationMap:
        """Assumes ground around the feet and takes in the first images."""
        state, X_WB = inputs.robot_state, _base_pose(inputs.robot_state)
        views = self._views(inputs, X_WB)
        if not state.is_known or not usable(state.stamp, views, X_WB):
            return memory  # as if there had been no update: the assumption is for the first images
        p_WG = self._robot.soles_W(self._robot.foot_positions_W(state))
        return begin_map(state.stamp, views, X_WB, p_WG, self._filled)

    def update(self, inputs: Inputs, memory: ElevationMap, time: float) -> ElevationMap:
        """Takes in the images of this moment."""
        if self.is_initial(memory):  # there was no estimate of the state, or no image, until now
            return self.initialize(inputs, memory, time)
        X_WB = _base_pose(inputs.robot_state)
        return update_map(memory, inputs.robot_state.stamp, self._views(inputs, X_WB), X_WB, self._filled)

    def _views(self, inputs: Inputs, X_WB: np.ndarray) -> list[DepthView]:
        views, shape = [], (self._intrinsics.height, self._intrinsics.width)
        for port, X_BC in self._X_BC.items():
            depth = np.squeeze(getattr(inputs, port).data, axis=2)
            depth = depth if depth.shape == shape else np.zeros((0, 0), np.float32)
            views.append(DepthView(X_WB @ X_BC, self._intrinsics, depth))
        return views


def _base_pose(state: RobotState) -> np.ndarray:
    """X_WB (4, 4); all NaN if any of it is not finite."""
    X_WB = np.eye(4)
    X_WB[:3, :3], X_WB[:3, 3] = state.R_WB, state.p_WB
    return X_WB if np.isfinite(X_WB).all() else np.full((4, 4), np.nan)


def _heights(memory: ElevationMap) -> GroundHeights:
    return GroundHeights(memory.stamp, memory.corner, memory.cell, memory.height)
