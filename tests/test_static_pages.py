"""The pages that a run, a walk, a comparison and a bench leave, in a real browser: whole, quiet, and alone in the world."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from quadpips_drake.benchmark.bench.reporting.comparison import load_rows
from quadpips_drake.benchmark.bench.reporting.reports import PAGE, write_reports
from quadpips_drake.benchmark.bench.reporting.summary import stage_timings
from quadpips_drake.benchmark.bench.settings import load_settings
from quadpips_drake.trials.loading import load_config, load_walk_config
from quadpips_drake.trials.reporting.post_mortem import post_mortem_of
from quadpips_drake.trials.reporting.report import compare
from quadpips_drake.trials.reporting.report_page import report_page
from quadpips_drake.trials.trial import run_trial
from quadpips_drake.trials.walk_trial import run_walk
from tests.browser import browser, complaints, requests_of
from tests.source_tree import ROOT
from tests.trials.reporting.hand_made import falling, record, sliding, standing_log

BENCH = ROOT / "examples" / "notebooks" / "paper_bench"
DURATION = 0.6
"""Of the trials [s]: they stand up."""
PATIENCE = 240.0
"""Only ends a test that hangs [s]."""
NARROW, WIDE = 800, 1280
"""Windows in which nothing may lie beyond the right edge [pixels]."""

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def window():
    """``window(path)``: the page there, in the one tab of a browser, with what it has asked for and complained of."""
    with browser() as chromium:
        page = chromium.new_context(viewport={"width": WIDE, "height": 720}, offline=True).new_page()
        page.set_default_timeout(1000 * PATIENCE)
        found, asked = complaints(page), requests_of(page)

        def opened(path: Path) -> SimpleNamespace:
            found.clear()
            asked.clear()
            page.goto(path.as_uri())
            return SimpleNamespace(page=page, found=found, asked=asked, alone=[path.as_uri()])

        yield opened


@pytest.fixture(scope="module")
def trials(tmp_path_factory):
    """Folder with a trial in "run" and one in "walk"."""
    folder = tmp_path_factory.mktemp("trials")
    run_trial(load_config(robot="go2", terrain="stepping_stones", duration=DURATION), folder / "run")
    pushes = [{"force": [0.0, 5.0, 0.0], "time": 0.2, "duration": 0.2}]
    run_walk(load_walk_config(robot="go2", duration=DURATION, pushes=pushes), folder / "walk")
    return folder


def check_still(shown) -> None:
    """A page without a scene: nothing fetched or complained of, pictures there, no link into the void, no sideways way."""
    page = shown.page
    assert (shown.asked, shown.found) == (shown.alone, [])
    assert page.eval_on_selector_all("img", "all => all.map(i => i.complete && i.naturalWidth > 100)").count(False) == 0
    here = Path(page.evaluate("decodeURIComponent(location.pathname)")).parent
    links = page.eval_on_selector_all("a", "all => all.map(a => a.getAttribute('href'))")
    assert [link for link in links if not (here / link).is_file()] == []
    for width in (NARROW, WIDE):
        page.set_viewport_size({"width": width, "height": 720})
        assert page.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize(
    ("kind", "verdict"), [("run", "did not reach its goal in time"), ("walk", "stayed upright after 0.6 s")]
)
def test_a_report(trials, window, kind, verdict):
    shown = window(trials / kind / "report.html")
    check_still(shown)
    page = shown.page
    assert verdict in page.locator("p.story").first.text_content()
    names = page.locator("a").all_text_contents()
    assert {"recording.html", "result.json", "config.yaml", "log.npz"} <= set(names)
    torques = page.get_by_alt_text("joint torques over time")
    assert not torques.is_visible()
    page.click("summary:has-text('Torques')")
    assert torques.is_visible()
    assert page.locator("td:has-text('whole_body_control')").count() == 1, "of the timings"


def test_reports_of_a_fall_and_of_two_side_by_side(tmp_path, window):
    fallen = record(falling(sliding(standing_log(), 0.9, 0.1)), detail="roll or pitch reached 0.80 rad")
    found = post_mortem_of(fallen)
    (tmp_path / "report.html").write_text(report_page(fallen, found))
    shown = window(tmp_path / "report.html")
    check_still(shown)
    assert "most likely because of low friction" in shown.page.locator("p.story").first.text_content()
    assert shown.page.locator("td:has-text('quadpips walk')").is_visible(), "the command that repeats it"
    fallen, stood = replace(fallen, folder=tmp_path), replace(record(standing_log(151), "upright"), folder=tmp_path)
    compare([(fallen, found), (stood, None)], tmp_path / "comparison.html")
    shown = window(tmp_path / "comparison.html")
    check_still(shown)
    cells = shown.page.locator("tr:has-text('verdict') td").all_text_contents()
    assert ["low friction" in cells[1], "stayed upright" in cells[2]] == [True, True]


def test_the_summary_of_a_bench(tmp_path, window):
    settings, rows = load_settings(BENCH), load_rows(BENCH)
    write_reports(settings, rows, tmp_path)
    shown = window(tmp_path / PAGE)
    check_still(shown)
    goals, *_, timings = shown.page.locator("table").all()
    assert goals.locator("tbody tr").count() == len({row["terrain"] for row in rows}) + 1, "and one of all"
    assert goals.locator("tbody tr").last.locator("td").nth(3).text_content() == (
        f"{sum(row['success'] for row in rows)}/{len(rows)}"
    )
    assert timings.locator("tbody tr").count() == len(stage_timings(rows))
    failed = shown.page.locator("h2:has-text('Failures') ~ table").first
    assert failed.locator("tbody tr").count() == sum(not row["success"] for row in rows)


@pytest.mark.parametrize(
    ("kind", "layers", "verdict"),
    [
        ("run", {"course/start", "course/goal"}, "timeout"),
        ("walk", {"command", "pushes"}, "upright"),
    ],
)
def test_a_recording(trials, window, kind, layers, verdict):
    shown = window(trials / kind / "recording.html")
    page = shown.page
    page.set_viewport_size({"width": 480, "height": 270})  # drawn in software, a larger one takes long
    page.wait_for_selector("#qp-now", state="attached")
    assert layers <= set(page.eval_on_selector_all(".qp-entry", "all => all.map(e => e.dataset.layer)"))
    layer = min(layers)
    visible = "layer => viewer.scene_tree.find(['quadpips', ...layer.split('/')]).object.visible"
    for wanted in (False, True):
        page.locator(f"[data-layer='{layer}'] input").dispatch_event("click")
        assert page.evaluate(visible, layer) == wanted

    def wait_for_clock(condition: str):
        page.wait_for_function(f"(t => {condition})(parseFloat(document.getElementById('qp-clock').textContent))")

    page.evaluate("location.hash = '#t=0.3'")
    wait_for_clock("t === 0.3")
    assert page.locator("#qp-verdict").is_hidden() and page.locator("#qp-play").text_content() == "play"
    page.click("#qp-play")
    wait_for_clock("t > 0.3")
    bar = page.locator("#qp-line").bounding_box()
    assert bar["width"] >= 200, "a line of time to click on, in a narrow window too"
    page.locator("#qp-line").click(position={"x": 0.75 * bar["width"], "y": 5})
    page.wait_for_function("document.getElementById('qp-play').textContent === 'play'")
    pixel = DURATION / bar["width"]
    wait_for_clock(f"Math.abs(t - {0.75 * DURATION}) < {2 * pixel + 0.01}")
    page.evaluate(f"location.hash = '#t={DURATION}'")
    page.wait_for_selector("#qp-verdict", state="visible")
    assert verdict in page.locator("#qp-verdict").text_content()
    assert page.locator("#qp-title").text_content() == f"go2 on {'stepping_stones' if kind == 'run' else 'flat'}"
    assert (shown.asked, shown.found) == (shown.alone, [])
