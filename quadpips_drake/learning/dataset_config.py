"""What a steppability dataset is made of."""

from dataclasses import field

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.learning.camera_path import CameraPathConfig
from quadpips_drake.learning.depth_corruption import CorruptionConfig
from quadpips_drake.learning.primitives import LabelPolicy
from quadpips_drake.sensing.depth_camera import DepthCameraConfig

SPLITS = ("train", "val", "test")


@configuration
class DatasetConfig:
    """All settings of the data factory; saved in the dataset's manifest."""

    camera: DepthCameraConfig = field(default_factory=lambda: DepthCameraConfig(width=320, height=240))
    """Half the resolution of the robots' cameras, with their field of view and range."""
    policy: LabelPolicy = field(default_factory=LabelPolicy)
    path: CameraPathConfig = field(default_factory=CameraPathConfig)
    corruption: CorruptionConfig = field(default_factory=CorruptionConfig)
    robots: list[str] = field(default_factory=lambda: ["anymal_c", "go2"])
    """Robots whose camera mounts are used, drawn scene by scene."""
    frames_per_scene: int = ranged(5, 1, 100)
    """Images along one walk."""
    scenes_per_shard: int = ranged(10, 1, 1000)
    """Scenes in one file."""
    gravity_noise: float = ranged(0.01, 0.0, 0.5)
    """Standard deviation of the measured direction of gravity [rad]."""

    def __post_init__(self):
        if not self.robots:
            raise UserInputError("robots must name at least one robot")


def split_of_scene(scene: int) -> str:
    """Returns the split of a scene by its number: of each ten scenes eight train, one validates, one tests."""
    return {8: "val", 9: "test"}.get(scene % 10, "train")
