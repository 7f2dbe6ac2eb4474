"""The files that a bench leaves."""

import re

import matplotlib.image
import pytest

from quadpips_drake.benchmark.bench.reporting.pictures import difficulty_figure, pictures_of, progress_figure, timings_figure
from quadpips_drake.benchmark.bench.reporting.reports import PAGE, SUMMARY, page_of, write_reports
from quadpips_drake.benchmark.bench.settings import BenchSettings, Course, difficulties_of
from tests.benchmark.bench.fake_trials import SETTINGS, fake_row

ROWS = [fake_row(spec) for spec in SETTINGS.trial_specs()]


def test_the_page_needs_nothing_beside_it(tmp_path):
    write_reports(SETTINGS, ROWS, tmp_path)
    page = (tmp_path / PAGE).read_text()
    assert page.count('src="data:image/png;base64,') == 2
    assert not re.search(r'(src|href)="(?!data:|recordings/)', page)
    assert "<td>4/6</td>" in page and "<td>roll | pitch reached 0.81 rad</td>" in page
    assert page.count("<td>push, since 4.0 s: 60 N s</td>") == 4
    for name in ("progress-anymal_c.png", "timings-anymal_c.png"):
        assert f"]({name})" in (tmp_path / SUMMARY).read_text()
        assert matplotlib.image.imread(tmp_path / name).std() > 0.05


def test_html_in_a_message_stays_text(tmp_path):
    assert "<script>" not in page_of("# a\n\n| b |\n|---|\n| <script>alert(1)</script> |\n", tmp_path)


def test_progress_is_drawn_as_in_the_paper():
    figure = progress_figure(ROWS)
    assert len(figure.axes) == 4
    curves = [line for line in figure.axes[1].lines if len(line.get_xdata()) > 1]
    assert len(curves) == 6
    assert sum(line.get_linestyle() == "--" for line in curves) == 2, "failures"
    (paper,) = (line for line in figure.axes[0].lines if line.get_linestyle() == ":")
    assert paper.get_ydata()[0] == 1.0, "the ramp: ten of ten"


def test_a_bench_of_errors_has_pictures_too(tmp_path):
    bare = [{**row, "success": False, "reason": "error", "progress": [], "timings_ms": {}, "sim_time": 0.0} for row in ROWS]
    assert [name for name, _, _ in pictures_of(bare)] == ["progress-anymal_c.png"]
    write_reports(SETTINGS, bare, tmp_path)


def test_timings_are_of_all_stages():
    (axes,) = timings_figure(ROWS).axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["torso search  (n = 120)", "foothold search  (n = 60)"]
    assert [bar.get_width() for bar in axes.patches] == pytest.approx([5.0, 24.0])


def test_sweeps_are_drawn_for_each_terrain():
    courses = [Course("anymal_c", "flat"), Course("go2", "flat"), Course("go2", "stairs")]
    settings = BenchSettings(courses=courses, trials=3, seed=1, difficulties=difficulties_of("0.1:0.4:4"))
    rows = [{**row, "success": row["difficulty"] < 0.25} for row in map(fake_row, settings.trial_specs())]
    figure = difficulty_figure(rows)
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["flat", "stairs"]
    labels = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert labels == ["anymal_c, quadpips: half at 0.25", "go2, quadpips: half at 0.25"]
