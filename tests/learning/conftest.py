"""A small dataset for all tests of the learning."""

import pytest
import torch

from quadpips_drake.learning.data_factory import make_dataset
from quadpips_drake.learning.dataset import load_split
from tests.learning.small import DATASET, FRAMES


@pytest.fixture(scope="session", autouse=True)
def one_thread():
    """The networks here are tiny; threads that wait for each other would only cost time."""
    torch.set_num_threads(1)


@pytest.fixture(scope="session")
def dataset_directory(tmp_path_factory):
    """A dataset that nobody may change."""
    directory = tmp_path_factory.mktemp("dataset")
    for _ in make_dataset(directory, FRAMES, 3, DATASET):
        pass
    return directory


@pytest.fixture(scope="session")
def train_frames(dataset_directory):
    """Its training split."""
    return load_split(dataset_directory, "train")
