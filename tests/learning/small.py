"""Small settings, with which the whole learning takes seconds."""

import math
from pathlib import Path

import numpy as np
import torch

from quadpips_drake.learning.dataset_config import DatasetConfig
from quadpips_drake.learning.model_files import save_model
from quadpips_drake.learning.network import NetworkConfig, SteppabilityNetwork
from quadpips_drake.learning.training import TrainingConfig
from quadpips_drake.perception.steppability.features import make_features
from quadpips_drake.sensing.depth_camera import DepthCameraConfig, make_intrinsics

CAMERA = DepthCameraConfig(width=64, height=48)
SMALL = make_intrinsics(CAMERA)
DATASET = DatasetConfig(camera=CAMERA, frames_per_scene=1, scenes_per_shard=4)
FRAMES = 10
"""Scenes of DATASET: 8 for training in two shards, one to validate, one to test."""
NETWORK = NetworkConfig(stem=4, widths=(4, 6, 8), blocks=(1, 1, 1), expansion=1, pyramid=4, decoder=4)
TRAINING = TrainingConfig(epochs=2, batch=4, crop_width=48, network=NETWORK)

PITCH = 0.5236
DOWN_C = np.array([0.0, math.cos(PITCH), math.sin(PITCH)])
"""Gravity as a camera sees it that looks 30 degrees down."""


def floor_depth(height: float = 0.5, intrinsics=SMALL) -> np.ndarray:
    """Returns the depth image [m] of level ground, from a camera ``height`` above it that looks 30 degrees down."""
    v = np.arange(intrinsics.height)
    fall = DOWN_C[1] * (v - intrinsics.cy) / intrinsics.fy + DOWN_C[2]
    depth = np.where(fall > 1e-3, height / np.maximum(fall, 1e-3), np.inf)
    return np.repeat(depth[:, None], intrinsics.width, axis=1).astype(np.float32)


def save_small_model(directory: Path, card: dict | None = None) -> SteppabilityNetwork:
    """Writes the files of an untrained model into ``directory``; returns its network."""
    torch.manual_seed(0)
    network = SteppabilityNetwork(NETWORK).eval()
    save_model(directory, network, card or {}, [make_features(floor_depth(), DOWN_C, SMALL)])
    return network
