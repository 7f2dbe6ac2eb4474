"""Exponents of growth: the fit on known powers, the worlds that grow, and the command from outside."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from quadpips_drake.benchmark import growth
from quadpips_drake.benchmark.growth import FAMILIES, MEMORY, curves, exponents, fitted_power, table_rows, upper_half
from quadpips_drake.benchmark.growth_picture import growth_figure
from quadpips_drake.benchmark.growth_worlds import field_of_boxes, paved_lane, square_of_stones
from quadpips_drake.cli.main import app
from quadpips_drake.terrain.placement import check_start_and_goal
from quadpips_drake.terrain.truth import GroundTruth

SIZES = np.array([10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0])


def point(size, memory=50.0, **seconds):
    return {"seconds": seconds, "memory_mb": {"peak": 500.0 + memory, "added": memory}}


def results_with(power):
    """As of a whole study of knots whose update grows with this power."""
    return {f"knots/{n}": point(n, memory=0.5 * n, update=1e-4 * n**power) for n in FAMILIES["knots"].sizes}


@pytest.mark.parametrize("power", [0.0, 0.5, 1.0, 2.0])
def test_a_power_is_found(power):
    factor, exponent = fitted_power(SIZES, 3e-4 * SIZES**power)
    assert exponent == pytest.approx(power, abs=1e-9)
    assert factor == pytest.approx(3e-4)


def test_small_sizes_and_their_constants_do_not_count():
    np.testing.assert_array_equal(SIZES[upper_half(SIZES)], [500, 1000, 2000, 5000])
    quadratic = 1.0 + 1e-3 * SIZES**2
    assert fitted_power(SIZES, quadratic)[1] == pytest.approx(2.0, abs=0.01)
    spoiled = np.where(upper_half(SIZES), quadratic, 1e6)
    assert fitted_power(SIZES, spoiled) == fitted_power(SIZES, quadratic)


def test_noise_moves_an_exponent_little():
    noisy = SIZES * np.exp(np.random.default_rng(0).normal(0.0, 0.05, len(SIZES)))
    assert fitted_power(SIZES, noisy)[1] == pytest.approx(1.0, abs=0.1)


def test_what_cannot_be_fitted_has_no_exponent():
    assert fitted_power(SIZES, np.zeros(9)) is None
    assert fitted_power(SIZES, np.full(9, np.nan)) is None
    assert fitted_power(SIZES[:1], SIZES[:1]) is None
    assert fitted_power(np.array([5.0, 7.0]), np.array([1.0, 1.4]))[1] == pytest.approx(1.0)


def test_exponents_and_table_of_a_study():
    results = {**results_with(1.5), "knots/10/quick": point(10, update=9.0), "regions/5": point(5, search=0.01)}
    assert exponents(results, ["knots"]) == {"knots": {"update": 1.5, MEMORY: 1.0}}
    assert exponents(results, ["regions", "image"]) == {"regions": {}, "image": {}}
    sizes, values = curves(results, "knots")["update"]
    assert list(sizes) == [10, 20, 50, 100, 200] and values[0] == pytest.approx(1e-4 * 10**1.5)
    rows = table_rows(results, ["knots"])
    assert rows[0] == ("knots of the control problem", "update", "3.16 ms at 10", "0.28 s at 200", "1.50")
    assert rows[1][1:] == (MEMORY, "5 MB at 10", "100 MB at 200", "1.00")


def test_what_has_been_measured_is_not_measured_again(tmp_path, monkeypatch):
    wanted = []
    monkeypatch.setattr(growth, "run_study", lambda jobs, *_, **__: wanted.extend(jobs))
    growth.run_growth(["knots"], tmp_path, results_with(1.0))
    assert wanted == []
    growth.run_growth(["knots"], tmp_path, results_with(1.0), quick=True)
    growth.run_growth(["regions"], tmp_path, {"regions/5": {}, "regions/500": {}})
    assert wanted == ["knots/10/quick", "knots/20/quick", *(f"regions/{n}" for n in (10, 20, 50, 100, 200))]


def test_the_picture_has_a_column_for_each_family(tmp_path):
    figure = growth_figure(results_with(1.0), ["knots", "image"])
    assert [axes.get_xlabel() for axes in figure.axes][2:] == [FAMILIES[name].counted for name in ("knots", "image")]
    assert "$n^{1.00}$" in figure.axes[0].get_legend().get_texts()[0].get_text()
    figure.savefig(tmp_path / "growth.png")


@pytest.mark.parametrize("count", [10, 200, 1000])
def test_the_robot_stands_in_the_middle_of_as_many_boxes_as_are_asked_for(count):
    terrain = field_of_boxes(count)
    assert len(terrain.elements) == count == len({tuple(box.X_WE[:2, 3].round(3)) for box in terrain.elements})
    check_start_and_goal(terrain)
    near = GroundTruth(terrain).height(*np.meshgrid(np.linspace(-0.5, 0.5, 9), np.linspace(-0.28, 0.28, 5)))
    assert (np.abs(near) < 0.01).all()


@pytest.mark.parametrize("world", [square_of_stones, paved_lane])
@pytest.mark.parametrize("count", [5, 10, 50, 500])
def test_there_are_as_many_regions_as_are_asked_for(world, count):
    regions, goal = world(count)
    assert abs(len(regions.regions) - count) <= 0.04 * count
    assert len({region.id for region in regions.regions}) == len(regions.regions)
    assert goal[0] >= 0.9


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_each_family_is_measured(family, tmp_path):
    done = CliRunner().invoke(app, ["evaluate", "growth", "--quick", "--only", family, "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    fitted = json.loads((tmp_path / growth.EXPONENTS).read_text())
    points = json.loads((tmp_path / growth.STORE).read_text())
    assert set(points) == {f"{family}/{size}/quick" for size in FAMILIES[family].quick_sizes}
    for result in points.values():
        assert all(seconds > 0.0 for seconds in result["seconds"].values())
        assert result["memory_mb"]["peak"] > 50.0
        assert fitted[family].keys() >= result["seconds"].keys()
    assert np.isfinite(list(fitted[family].values())).all()
    assert (tmp_path / growth.PICTURE).stat().st_size > 10_000
    assert "exponent" in done.output and FAMILIES[family].counted in done.output


def test_bad_input_is_refused_in_one_line(tmp_path):
    (tmp_path / "file").touch()
    for arguments, message in (
        (["--only", "knots,moons"], "unknown family 'moons'; known: elements, image, knots, regions"),
        (["--out", str(tmp_path / "file" / "below")], "file/below"),
        (["--out", ""], "an empty name is no directory"),
    ):
        done = CliRunner().invoke(app, ["evaluate", "growth", "--quick", *arguments])
        assert done.exit_code == 2, done.output
        assert message in done.output.replace("\n", " ") and "Traceback" not in done.output
