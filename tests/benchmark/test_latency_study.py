"""From computing times to a preset, and from runs with scaled latencies to rates and their intervals."""

from inspect import signature

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

import quadpips_drake as qp
from quadpips_drake.benchmark import latency_study as study
from quadpips_drake.benchmark.latency_picture import clopper_pearson, sweep_figure
from quadpips_drake.cli.evaluation.evaluate_latency import latency_sweep
from quadpips_drake.cli.main import app

TIMES = {
    "anymal_c/flat/0": {
        "normals": [0.004] * 10,
        "self_filter": [0.001] * 10,
        "centroidal_mpc": [k / 1e3 for k in range(1, 11)],
    },
    "anymal_c/flat/1": {"centroidal_mpc": [k / 1e3 for k in range(11, 21)], "regions": [0.002], "torso_search": [0.03]},
    "go2/flat/0": {"centroidal_mpc": [0.002]},
}


def run_result(success, sim_time=10.0):
    return {"success": success, "sim_time": sim_time}


SWEEP = {
    **{f"flat/{factor:g}/{seed}": run_result(True, 10.0 + factor) for factor in (2.0, 0.5, 10.0) for seed in range(3)},
    **{f"stairs/1/{seed}": run_result(seed == 0) for seed in range(4)},
}


def test_a_latency_is_the_95th_percentile_of_all_runs_of_the_robot():
    preset = study.preset("anymal_c", TIMES)
    assert preset["tracking"]["mpc"]["latency"] == pytest.approx(np.percentile(np.arange(1, 21) / 1e3, 95), abs=5e-5)
    assert study.preset("go2", TIMES)["tracking"]["mpc"]["latency"] == 0.002


def test_what_a_stage_has_computed_for_it_is_charged_to_it():
    preset = study.preset("anymal_c", TIMES)
    assert preset["perception"]["normals"] == {"rate": 30.0, "latency": 0.005}
    assert preset["planning"]["torso"]["latency"] == pytest.approx(0.032)
    assert preset["planning"]["swings"]["latency"] == 0.0  # never computed


def test_every_stage_that_a_preset_delays_is_charged_for():
    def paths(tree, path=()):
        nested = [paths(value, (*path, key)) for key, value in tree.items() if isinstance(value, dict)]
        return {".".join(path)} if "latency" in tree else set().union(*nested)

    assert paths(study.preset("anymal_c", TIMES)) == study.CHARGED_TO.keys()


def test_the_file_is_one_for_the_command_line(tmp_path):
    path = study.write_preset("anymal_c", TIMES, tmp_path)
    assert path.name == "latency-anymal_c.yaml" and "2 runs of anymal_c" in path.read_text()
    assert yaml.safe_load(path.read_text()) == study.preset("anymal_c", TIMES)
    config = qp.load_config(latency=str(path), latency_scale=2.0)
    assert config.stages.perception.normals.latency == pytest.approx(0.01)


def test_successes_are_counted_by_terrain_and_factor():
    counts = study.successes(SWEEP)
    assert list(counts["flat"]) == [0.5, 2.0, 10.0] and counts["flat"][2.0] == (3, 3) and counts["stairs"] == {1.0: (1, 4)}
    assert "| flat | 10 | 3/3 | 20.0 |" in study.table(SWEEP) and "| stairs | 1 | 1/4 | 10.0 |" in study.table(SWEEP)


def test_nothing_is_run_twice():
    sweep = study.LatencySweep("anymal_c", ("flat", "stairs"), (0.5, 1.0), (0, 1))
    assert sorted(sweep.jobs({})) == sorted(f"{t}/{f}/{s}" for t in ("flat", "stairs") for f in ("0.5", "1") for s in (0, 1))
    assert list(sweep.jobs(SWEEP)) == ["flat/1/0", "flat/1/1", "stairs/0.5/0", "stairs/0.5/1"]


@pytest.mark.parametrize("robot", ["anymal_c", "go2"])
def test_stages_may_be_as_late_as_the_command_asks_by_itself(robot):
    factors = tuple(float(word) for word in signature(latency_sweep).parameters["factors"].default.split(","))
    study.LatencySweep(robot, ("flat",), factors, (0,)).check()
    with pytest.raises(qp.UserInputError, match="latency must be"):
        study.LatencySweep(robot, ("flat",), (*factors, 20.0), (0,)).check()


def test_intervals_of_rates_are_exact():
    low, high = clopper_pearson(np.array([0.0, 4.0, 5.0]), np.array([5.0, 5.0, 5.0]))
    np.testing.assert_allclose(low, [0.0, 0.2836, 0.4782], atol=1e-4)
    np.testing.assert_allclose(high, [0.5218, 0.9949, 1.0], atol=1e-4)


def test_the_picture_shows_each_terrain(tmp_path):
    figure = sweep_figure(SWEEP)
    figure.savefig(tmp_path / "sweep.png")
    labels = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert labels == ["flat", "stairs"] and (tmp_path / "sweep.png").stat().st_size > 5000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["latency", "--robots", "anymal"], "unknown robot 'anymal'"),
        (["latency", "--terrains", "moon"], "moon"),
        (["latency-sweep", "--factors", "1,x"], "--factors '1,x' is not of the form"),
        (["latency-sweep", "--factors", "nan"], "--factors 'nan' is not of the form"),
        (["latency-sweep", "--factors", "1,20"], "latency must be"),
        (["latency-sweep", "--latency", "papr"], "unknown latency 'papr'"),
        (["latency-sweep", "--seeds", "-1"], "--seeds '-1' is not of the form"),
    ],
)
def test_bad_input_is_refused_in_one_line(arguments, message, tmp_path):
    done = CliRunner().invoke(app, ["evaluate", *arguments, "--out", str(tmp_path / "out")])
    assert done.exit_code == 2 and message in done.output.replace("\n", " "), done.output
