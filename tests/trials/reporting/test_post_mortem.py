"""The cause that comes first, of trials made by hand; and that a healthy one has none."""

import numpy as np
import pytest

from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.terrain import Box, Terrain, pose
from quadpips_drake.trials.loading import load_config, load_walk_config
from quadpips_drake.trials.reporting.measurements import impulses_of, lateness_of, mass_of, outages_of, sliding_of
from quadpips_drake.trials.reporting.post_mortem import post_mortem_of, repeating
from quadpips_drake.trials.reporting.suspects import Place, margin_of, regions_of, suspects_of
from quadpips_drake.trials.reporting.true_way import obstacle_before
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.steppability import Steppability
from tests.source_tree import ROOT
from tests.trials.reporting.hand_made import ROBOT, falling, lifted, noting, record, sliding, standing_log, with_sight


def first(made):
    return post_mortem_of(made).first


def causes(made) -> list[str]:
    return [finding.cause for finding in post_mortem_of(made).findings]


def test_who_succeeds_is_not_examined():
    for reason in ("upright", "goal_reached", "interrupted", "error"):
        assert post_mortem_of(record(standing_log(), reason)) is None
    assert post_mortem_of(record({}, "fell")) is None


def test_a_fall_out_of_nothing_is_told_by_its_first_event():
    found = post_mortem_of(record(falling(standing_log())))
    assert [finding.cause for finding in found.findings] == ["base off its reference"]
    assert found.first.time == pytest.approx(1.13)
    assert "roll is +0.10 rad off" in found.first.text
    assert found.command == "quadpips walk 'out/some trial/config.yaml' --out 'out/some trial-again'"


def test_mass_comes_from_the_feet():
    assert mass_of(record(standing_log(load=1.3))) == pytest.approx(1.3 * ROBOT.mass)
    falls = standing_log()
    falls["contact_forces"][:, :, 2] *= 0.5
    falls["v_WB"][:, 2] = -0.5 * 9.81 * falls["time"]
    assert mass_of(record(falls)) == pytest.approx(ROBOT.mass), "half the weight while it falls half as fast"
    assert mass_of(record(standing_log(10))) is None


def test_a_payload():
    heavy = first(record(falling(standing_log(load=1.6))))
    assert (heavy.cause, heavy.time) == ("payload", 0.0)
    assert "60% more" in heavy.text
    assert "payload" not in causes(record(falling(standing_log(load=1.1))))
    assert first(record(falling(standing_log(load=0.7)))).cause == "missing mass"


def test_friction_comes_from_feet_that_slide():
    found = sliding_of(record(sliding(standing_log(), 0.5, 0.12)))
    assert found.friction == pytest.approx(0.12)
    assert found.since == pytest.approx(0.5, abs=0.02)
    assert sliding_of(record(standing_log())) is None


def test_low_friction():
    slippery = first(record(falling(sliding(standing_log(), 0.9, 0.1))))
    assert slippery.cause == "low friction"
    assert "held back by 0.10 of their load" in slippery.text
    assert slippery.keys[0] == "stages.station.model_error.friction"
    assert "low friction" not in causes(record(falling(sliding(standing_log(), 0.9, 0.8)))), "it slid for another reason"


def test_a_push():
    log = falling(standing_log(), 1.05) | {"push": np.zeros((201, 3))}
    log["push"][100:110, 1] = -600.0
    ((begin, end, impulse),) = impulses_of(record(log))
    assert (begin, end) == (1.0, pytest.approx(1.1))
    assert impulse == pytest.approx([0.0, -60.0, 0.0])
    pushed = first(record(log))
    assert pushed.cause == "push"
    assert "600 N along -y" in pushed.text
    log["push"][:] = 0.0
    log["push"][5:10, 1] = 600.0
    late = falling(log, 1.9, 8.0)
    assert "push" in causes(record(late)), "1.85 s later"
    assert (
        first(record(falling(standing_log(401), 3.0) | {"push": np.vstack((log["push"], np.zeros((200, 3))))})).cause
        != "push"
    )


def test_a_solver_that_fails():
    log = noting(falling(standing_log()), (0.8, "mpc", "the solver found nothing: kSolverSpecificError"))
    log["mpc_failures"][80:] = np.minimum(np.arange(121) // 2 + 1, 25)
    (outage,) = outages_of(record(log), "mpc")
    assert (outage.begin, outage.failures) == (0.8, 25)
    failed = first(record(log))
    assert (failed.cause, failed.system, failed.time) == ("mpc solver failed", "centroidal_mpc", 0.8)
    assert "kSolverSpecificError" in failed.text
    log["mpc_failures"][:] = np.where(log["time"] >= 1.5, 30, 0)
    assert "mpc solver failed" not in causes(record(log)), "one failure, after the fall had begun"


def test_an_mpc_that_is_late():
    log = falling(standing_log())
    assert lateness_of(record(log)).latency == pytest.approx(0.0, abs=1e-6)
    log["mpc_age"] = log["mpc_age"] + 0.08
    late = lateness_of(record(log))
    assert (late.latency, late.period) == (pytest.approx(0.08), pytest.approx(0.02))
    assert first(record(log)).cause == "MPC delay"


def test_a_push_counts_more_than_what_was_always_so():
    log = falling(standing_log(load=1.6), 1.05) | {"push": np.zeros((201, 3))}
    log["push"][100:110, 1] = 600.0
    log["mpc_age"] += 0.08
    assert causes(record(log))[:3] == ["push", "payload", "MPC delay"] or set(causes(record(log))[1:3]) == {
        "payload",
        "MPC delay",
    }


def test_footholds_at_a_wrong_height():
    log = falling(lifted(standing_log(), Leg.LF, 0.4, 0.8, height=0.08))
    found = first(record(log))
    assert found.cause == "footholds at a wrong height"
    assert "8 cm above the true ground" in found.text


def test_a_camera_that_sees_nothing():
    log = with_sight(standing_log(), measured=0.0)
    blind = first(record(log, "timeout", walk=False))
    assert blind.cause == "camera blind"
    assert "camera blind" not in causes(record(with_sight(standing_log()), "timeout", walk=False))


def test_nothing_to_step_on():
    log = with_sight(standing_log())
    log["region_labels"][:] = [0, 0, 0, 12]
    assert "no steppable ground" in causes(record(log, "no_plan", walk=False, detail="5 plans in a row failed"))


def way(*boxes) -> Terrain:
    """Level ground with boxes (size, centre), a goal 3 m ahead."""
    ground = Box(size=[16.0, 16.0, 0.2], X_WE=pose([0.0, 0.0, -0.1]))
    walls = [Box(size=size, X_WE=pose(center), label=Steppability.NON_PASSABLE) for size, center in boxes]
    return Terrain(name="way", start=[0.0, 0.0, 0.0], goal=[3.0, 0.0], friction=1.0, elements=(ground, *walls))


WALL = ([0.2, 15.0, 0.6], [1.5, 0.0, 0.3])


def search(terrain, **more):
    return obstacle_before(terrain, np.zeros(2), **({"step": 0.25, "gap": 0.5, "half_width": 0.2} | more))


def test_what_stands_in_the_way():
    assert search(way()) is None
    assert search(way(([0.2, 2.0, 0.6], [1.5, 0.0, 0.3]))) is None, "it can be walked round"
    wall = search(way(WALL))
    assert (wall.kind, wall.size) == ("wall", pytest.approx(0.6, abs=0.01))
    assert wall.place[0] == pytest.approx(1.2, abs=0.15)
    gap = search(load_terrain("gap", 0, difficulty=0.9))
    assert (gap.kind, gap.size) == ("gap", pytest.approx(0.9, abs=0.12))
    assert search(load_terrain("gap", 0, difficulty=0.3)) is None
    assert search(load_terrain("stairs_10", 0), step=0.12) is None
    assert search(load_terrain("stairs_10", 0), step=0.08).kind == "step"


def test_a_goal_that_is_blocked_and_a_gap():
    failed = (1.2, "planner", "pausing: the plan failed: the way is blocked")
    log = noting(with_sight(standing_log()), failed)
    found = first(record(log, "no_plan", terrain=way(WALL), walk=False))
    assert (found.cause, found.time, found.system) == ("goal blocked", 0.0, "torso_planner"), "it never came nearer"
    assert "the way is blocked" in found.text
    log["p_WB"][:, 0] -= 1.0
    found = first(record(log, "no_plan", terrain=load_terrain("gap", 0, difficulty=0.9), walk=False))
    assert found.cause == "gap in the way"


def test_a_wall_that_appeared():
    log = with_sight(standing_log()) | {
        "appeared_time": np.array([0.7]),
        "appeared_low": np.array([[1.4, -7.5, 0.0]]),
        "appeared_high": np.array([[1.6, 7.5, 0.6]]),
    }
    found = first(record(log, "timeout", terrain=way(), walk=False))
    assert (found.cause, found.time) == ("spawned obstacle", 0.7)
    assert "60 cm high" in found.text
    hit = {"what": "box@<foothold>", "at": 0.9, "noticed": None, "touched": True, "touched_by": ["LF_foot"]}
    fell = record(falling(with_sight(standing_log())), "fell", walk=False, spawned=[hit])
    assert first(fell).cause == "spawned obstacle"
    assert "never noticed, touched by LF_foot" in first(fell).text


PLANNERS = {"quadpips": "superpixels", "s_mpc": "superpixels", "em_mpc": "elevation", "motion_models": "oracle", "": ""}
"""And their region sources; without a planner: a walk."""


@pytest.mark.parametrize("planner", PLANNERS)
def test_systems_and_keys_to_look_at_are_there(planner):
    sets = (f"stages.region_source={PLANNERS[planner]}",)
    config = load_config(planner=planner, sets=sets) if planner else load_walk_config()
    made = record(standing_log(), config=config, walk=not planner, planner=planner)
    who = vars(suspects_of(made)).values()
    places = [place for place in who if isinstance(place, Place)] + [margin_of(made), regions_of(made)] * bool(planner)
    page = (ROOT / "docs" / "systems.md").read_text(encoding="utf-8")
    for place in places:
        assert f"### {place.system.title().replace('_', '')}\n" in page, place
        assert place.keys and all(made.setting(key) is not None for key in place.keys), place
    assert all(made.setting(key) > 0.0 for key in who if isinstance(key, str) and key)


def test_a_rival_is_told_where_to_look_in_its_own_words():
    log = noting(with_sight(standing_log()), (1.2, "planner", "pausing: the plan failed"))
    named = {}
    for planner in ("quadpips", "s_mpc", "motion_models", "one_that_nobody_knows"):
        log["p_WB"][:, 0] = -1.0
        gap = first(record(log, "timeout", terrain=load_terrain("gap", 0, difficulty=0.9), walk=False, planner=planner))
        assert gap.cause == "gap in the way"
        fell = first(record(falling(lifted(with_sight(standing_log()), Leg.LF, 0.5, 0.9)), walk=False, planner=planner))
        slow = first(record(with_sight(standing_log()), "timeout", walk=False, planner=planner))
        named[planner] = {key.split(".")[1] for f in (gap, fell, slow) for key in f.keys if key.startswith("stages.")}
        named[planner] -= {"tracking"}
    assert named == {
        "quadpips": {"planning"},
        "s_mpc": {"heuristic"},
        "motion_models": {"motion_models"},
        "one_that_nobody_knows": set(),
    }


def test_a_step_too_high_for_the_robot():
    stairs = load_terrain("stairs", 0, difficulty=0.2)
    log = lifted(standing_log(), Leg.LF, 0.5, 0.9)
    place = np.array(stairs.start[:2]) + np.array([1.0, 0.0])
    for name in ("p_WB", "reference_p_WB"):
        log[name][:, :2] += place
    found = causes(record(falling(log, 0.9), terrain=stairs, walk=False))
    assert "step too high" in found
    assert "step too high" not in causes(record(falling(lifted(standing_log(), Leg.LF, 0.5, 0.9), 0.9)))


def test_too_slow():
    found = first(record(with_sight(standing_log()), "timeout", walk=False))
    assert found.cause == "too slow"


def test_the_command_quotes_what_a_shell_would_read(tmp_path):
    assert repeating(False, tmp_path / "a;b") == f"quadpips run '{tmp_path}/a;b/config.yaml' --out '{tmp_path}/a;b-again'"
