"""The wired way from depth images by way of an elevation map to regions: spoiled input, jumps, repetition."""

import numpy as np
import pytest

from quadpips_drake.diagrams.elevation_module import ElevationModule
from quadpips_drake.perception.elevation.elevation_config import ElevationConfig
from tests.perception.scenes import SMALL
from tests.perception.test_bad_input import BAD_IMAGES, BAD_STATES, CONFIG, ROBOT, FedModule, floor, state_at


class Module(FedModule):
    """With a D435's noise."""

    def __init__(self, preset="fine"):
        options = {"images": CONFIG, "seed": 3, "with_distance": True}
        module = ElevationModule(ROBOT, SMALL, ElevationConfig(preset=preset), **options)
        super().__init__(module, 0.25, ("elevation_map", "ground_heights", "signed_distance"))


@pytest.mark.parametrize("name", BAD_IMAGES)
def test_a_bad_image_raises_nothing_and_takes_no_region_away_for_good(name):
    module = Module()
    before = module.show(floor(state_at(0)), state_at(0))
    during = module.show(BAD_IMAGES[name], state_at(1))
    after = module.show(floor(state_at(2)), state_at(2))
    assert len(before) > 15 and len(after) > 15
    for region in (*before, *during, *after):
        assert abs(region.center[2]) < 0.02
    for region in Module().show(BAD_IMAGES[name], state_at(0)):  # of what is assumed below the robot
        assert -0.8 < region.center[0] < 1.2 and abs(region.center[1]) < 0.5


@pytest.mark.parametrize("name", BAD_STATES)
def test_a_bad_state_raises_nothing(name):
    module = Module("paper")
    module.show(floor(state_at(0)), state_at(0))
    module.show(floor(state_at(1)), state_at(1, **BAD_STATES[name]))
    regions = module.show(floor(state_at(2)), state_at(2))
    assert regions and all(np.isfinite(region.X_WR).all() for region in regions)


def test_after_a_jump_of_the_pose_regions_lie_around_the_new_place():
    module, jump = Module(), np.array([3.0, 2.0, 0.4])
    module.show(floor(state_at(0)), state_at(0))
    state = state_at(1, p_WB=state_at(1).p_WB + jump)
    regions = module.show(floor(state_at(1)), state)
    assert len(regions) > 10
    for region in regions:
        assert np.hypot(*(region.center[:2] - state.p_WB[:2])) < 2.2, "nothing from before is kept"
        assert abs(region.center[2] - jump[2]) < 0.02


def test_the_same_seed_gives_the_same_bits_and_a_cloned_context_the_same_answer():
    one, two = Module(), Module()
    regions = [[module.show(floor(state_at(k)), state_at(k)) for k in range(2)][-1] for module in (one, two)]
    clone = one.simulator.get_context().Clone()
    regions.append(one.module.GetOutputPort("region_set").Eval(clone).regions)
    assert len(regions[0]) > 15
    for other in regions[1:]:
        assert [region.id for region in other] == [region.id for region in regions[0]]
        for a, b in zip(regions[0], other, strict=True):
            np.testing.assert_array_equal(a.X_WR, b.X_WR)
            np.testing.assert_array_equal(a.inset, b.inset)
