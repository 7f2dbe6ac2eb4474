"""Settings of the tests of the network."""

import pytest
import torch


@pytest.fixture(scope="session", autouse=True)
def one_thread():
    """The networks here are tiny; threads that wait for each other would only cost time."""
    torch.set_num_threads(1)
