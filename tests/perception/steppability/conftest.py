"""A small model for the tests of the network."""

import pytest

from quadpips_drake.perception.steppability.model import SteppabilityModel, load_model
from tests.learning.small import save_small_model


@pytest.fixture(scope="session")
def model_directory(tmp_path_factory):
    """The files of a small, untrained model, which nobody may change."""
    directory = tmp_path_factory.mktemp("model")
    save_small_model(directory, {"data": {"seed": 5}})
    return directory


@pytest.fixture(scope="session")
def model(model_directory) -> SteppabilityModel:
    """The model in them."""
    return load_model(model_directory)
