import numpy as np
import pytest

from quadpips_drake.benchmark.perception_scores import Floor, PerceptionSample, PerceptionScorer
from quadpips_drake.benchmark.perception_scores_runs import ShownSource, score_camera_path
from quadpips_drake.diagrams.simulation_station import SimulationStation
from quadpips_drake.errors import UserInputError
from quadpips_drake.estimation.pose_drift import PoseDriftConfig, drift_state, drifted_world
from quadpips_drake.perception.regions.oracle_regions import OracleRegionConfig, regions_from_terrain
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.trials.loading import load_config
from quadpips_drake.values.regions import RegionSet
from quadpips_drake.values.robot_state import RobotState
from tests.perception.scenes import FOOT_RADIUS, SMALL


def sample_of(terrain, X_WO):
    """A sample without a floor, whose regions are the true ones, displaced by ``X_WO``."""
    regions = RegionSet(0.0, regions_from_terrain(terrain, FOOT_RADIUS, OracleRegionConfig()))
    depth = np.full((SMALL.height, SMALL.width), np.inf, np.float32)
    return PerceptionSample(0.0, np.eye(4), depth, SMALL, X_WO, Floor(), regions)


@pytest.mark.parametrize(
    ("shift", "cause"),
    [((0.0, 0.0, 0.0), None), ((0.0, 0.0, 0.05), "off_surface"), ((0.15, 0.0, 0.0), "off_surface")],
)
def test_true_regions_are_safe_and_displaced_ones_are_not(shift, cause):
    terrain, X_WO = load_terrain("stepping_stones"), np.eye(4)
    X_WO[:3, 3] = shift
    row = PerceptionScorer(terrain, 2.5).add(sample_of(terrain, X_WO))
    assert row["region_m2"] > 1.0
    if cause is None:
        assert row["false_safe_m2"] == 0.0
    else:
        assert row["false_safe_m2"] >= row[f"{cause}_m2"] > 0.05


def test_nothing_counts_as_steppable_before_it_is_seen():
    terrain = load_terrain("stepping_stones")
    scorer = PerceptionScorer(terrain, 2.5)
    assert scorer.add(sample_of(terrain, np.eye(4)))["target_m2"] == 0.0
    assert scorer.map.steppable.any() and not scorer.map.steppable.all()
    assert scorer.summary()["coverage"] is None


def test_drift_is_one_rigid_motion_for_the_whole_state():
    state, config = RobotState.empty(), PoseDriftConfig(0.01, 0.005, 0.02)
    X_WO = drifted_world(2.0, 7, config)
    drifted = drift_state(state, X_WO)
    np.testing.assert_allclose(X_WO[:3, :3] @ drifted.R_WB, state.R_WB, atol=1e-12)
    np.testing.assert_allclose(X_WO[:3, :3] @ drifted.p_WB + X_WO[:3, 3], state.p_WB, atol=1e-12)
    assert np.linalg.norm(X_WO[:2, 3]) == pytest.approx(0.02) and abs(X_WO[2, 3]) == pytest.approx(0.01)
    assert abs(drifted.rpy_WB[2]) == pytest.approx(0.04)
    np.testing.assert_array_equal(drifted_world(2.0, 7, PoseDriftConfig()), np.eye(4))
    with pytest.raises(UserInputError):
        PoseDriftConfig(horizontal_rate=-1.0)


SMALL_CAMERA = (
    "stages.station.camera.width=160",
    "stages.station.camera.height=120",
    "stages.perception.steppability.enabled=false",
    "stages.perception.depth_noise.sigma=0.003",
)


def test_all_sources_are_scored_on_the_same_images():
    sources = ["superpixels", "elevation", "oracle"]
    config = load_config(terrain="flat", goal=[0.6, 0.0], sets=SMALL_CAMERA)
    scorers, ended = score_camera_path(config, sources, speed=1.0)
    assert list(scorers) == sources and ended["reason"] == "path_ended"
    rows = [scorers[name].rows for name in sources]
    assert len(rows[0]) >= 3
    for name in ("t", "target_m2"):
        assert [row[name] for row in rows[0]] == [row[name] for row in rows[1]] == [row[name] for row in rows[2]]
    for name in sources:
        summary = scorers[name].summary()
        assert summary["false_safe_share"] == 0.0 and summary["coverage"] > 0.6, name
        assert (summary["height_rms_m"] is None) == (name == "oracle")
    images = []
    for name in ("superpixels", "elevation"):
        station = SimulationStation(load_robot("anymal_c"), load_terrain("flat"), config.stages.station)
        onlooker = ShownSource(name, config, station, load_terrain("flat"))
        context = station.CreateDefaultContext()
        onlooker.show(station, context, RobotState.empty())
        noise = onlooker.system.GetSubsystemByName("depth_noise")
        of_noise = noise.GetMyContextFromRoot(onlooker.context)
        images.append(noise.GetOutputPort("depth_image").Eval(of_noise).data.copy())
    np.testing.assert_array_equal(images[0], images[1])
