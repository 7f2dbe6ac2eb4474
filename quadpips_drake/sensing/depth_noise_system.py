"""The depth camera's noise as a system."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.sensors import ImageDepth32F

from quadpips_drake.framework.systems import LeafSystem
from quadpips_drake.sensing.depth_noise import DepthNoiseConfig, add_depth_noise
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.sensing import CameraIntrinsics


class DepthNoise(LeafSystem):
    """Makes an ideal depth image noisy: z' = z + (sigma + sigma_growth z^2) n with standard normal n; pixels may be lost.

    The noise depends on the seed and on the time alone; see ``add_depth_noise``.

    .. pydrake_system::

        name: DepthNoise
        input_ports:
        - depth_image
        output_ports:
        - depth_image

    - depth_image (input): ImageDepth32F (width, height) [m], along the optical axis; 0 is too near, inf too far.
    - depth_image (output): the same with noise; additionally NaN where a pixel is lost, and everywhere if the input has not
      the expected size.
    """

    def __init__(
        self,
        config: DepthNoiseConfig,
        *,
        intrinsics: CameraIntrinsics,
        seed: int = 0,
        timings: StageTimings | None = None,
    ):
        """Args: config; the camera's pinhole parameters (for the image's size); seed, not negative; stopwatch."""
        LeafSystem.__init__(self)
        self._config, self._seed = config, seed
        self._timings = timings or StageTimings()
        image = ImageDepth32F(intrinsics.width, intrinsics.height)
        self._image = self.DeclareAbstractInputPort("depth_image", AbstractValue.Make(image))
        self.DeclareAbstractOutputPort("depth_image", lambda: AbstractValue.Make(image), self._calc_image)

    def _calc_image(self, context, output):
        depth = self._image.Eval(context).data[:, :, 0]
        result = output.get_mutable_value().mutable_data[:, :, 0]
        if depth.shape != result.shape:
            result[:] = np.nan
            return
        with self._timings.measure("depth_noise"):
            result[:] = add_depth_noise(depth, context.get_time(), self._seed, self._config)
