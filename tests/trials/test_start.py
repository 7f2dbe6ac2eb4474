"""Where a trial starts, and how hard its terrain is."""

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.trials.loading import load_config, load_walk_config
from quadpips_drake.trials.walk_trial import WalkTrial
from quadpips_drake.trials.world import world_of

STILL = {"start_position_noise": 0.0, "start_yaw_noise": 0.0}


def start_of(seed: int, **options) -> np.ndarray:
    return WalkTrial(load_walk_config("go2", seed=seed, **options)).start


@pytest.mark.parametrize("start", [None, [0.5, -0.3, 0.7]])
def test_the_seed_moves_the_start_unless_told_not_to(start):
    options = {} if start is None else {"start": start}
    nominal = np.zeros(3) if start is None else np.array(start)
    first, again, other = (start_of(seed, **options) - nominal for seed in (4, 4, 5))
    np.testing.assert_array_equal(first, again)
    assert (first != other).all() and (first != 0).all() and (np.abs([first, other]) <= 0.05).all()
    np.testing.assert_array_equal(start_of(4, **options, **STILL), nominal)


def test_a_start_from_which_the_seed_moves_a_foot_off_the_ground_is_refused():
    edge = {"terrain": "gap", "start": [-0.22, 0.0, 0.0]}  # the front feet stand 2 to 3 cm before the edge
    start_of(1, **edge, **STILL)
    refused = 0
    for seed in range(6):
        try:
            start_of(seed, **edge)
        except UserInputError as error:
            refused += 1
            assert f"seed {seed} moves the start by 0.0" in str(error) and "start_position_noise" in str(error)
    assert 0 < refused < 6


def test_the_difficulty_of_a_configuration_makes_the_world():
    _, terrain = world_of(load_config("go2", terrain="gap", difficulty=0.35), None, None)
    assert terrain.goal[0] == load_terrain("gap", difficulty=0.35).goal[0] != load_terrain("gap").goal[0]
    with pytest.raises(UserInputError, match="given as an object"):
        world_of(load_config("go2", terrain="gap", difficulty=0.35), None, load_terrain("gap"))
