"""What is written over a recording: the story over time, the legend, and what a browser makes of both."""

import json
import re
import shutil
import subprocess

import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.visualization import recording
from quadpips_drake.visualization.meshcat_layers import MeshcatLayers
from quadpips_drake.visualization.overlay.legend import LEGEND, plain_legend
from quadpips_drake.visualization.overlay.page import with_overlay
from quadpips_drake.visualization.overlay.story import Story
from quadpips_drake.visualization.shapes import ColorMesh
from tests.visualization.test_plan_visualizer import BROWSER_FLAGS


def example() -> Story:
    story = Story("robot on terrain", "seed 0", "fell after 2.0 s: <b>it slipped</b>", 2.0)
    for time, phase in ((0.0, "planning"), (0.5, "planning"), (1.0, "walking")):
        story.note(time, phase=phase, gait="standing_trot", feet=15 if time < 1 else 9)
    for _ in range(2):
        story.happen(1.5, "swing blocked")
    return story


def test_a_story_knows_what_held_when(tmp_path):
    story = example()
    assert story.tracks["phase"] == [[0.0, "planning"], [1.0, "walking"]], "what stays takes no room"
    assert [story.at("phase", t) for t in (-1.0, 0.0, 0.99, 1.0, 9.0)] == ["", "planning", "planning", "walking", "walking"]
    assert story.since("phase", 1.7) == 1.0
    assert story.at("no such track", 1.0, 7) == 7
    assert len(story.tracks["event"]) == 2, "an event can happen twice"
    story.save(tmp_path / "story.json")
    assert Story.load(tmp_path / "story.json") == story


@pytest.mark.parametrize("text", ["", "[]", '{"tracks": 3}', '{"unknown": 1}', '{"tracks": {"phase": [1]}}'])
def test_what_is_no_story_is_refused(text, tmp_path):
    (tmp_path / "story.json").write_text(text)
    with pytest.raises(UserInputError, match="no story of a trial"):
        Story.load(tmp_path / "story.json")


def test_the_legend_names_what_is_there_and_nothing_else():
    assert plain_legend(()) == []
    (entry,) = plain_legend(("labels", "something else"))
    assert entry["layer"] == "labels"
    assert [meaning for _, meaning in entry["colors"]] == ["a foot can stand", "a foot clears it", "keep away", "not judged"]
    assert all(re.fullmatch("#[0-9a-f]{6}", color) for color, _ in entry["colors"])
    assert len({entry.layer for entry in LEGEND}) == len(LEGEND)


def test_nothing_in_a_story_gets_out_of_its_script():
    story = example()
    story.happen(1.0, "</script><script>alert(1)</script>")
    page = with_overlay("<html><body>scene</body></html>", story, ["labels"])
    assert page.count("</script>") == 2, "its own data and its own script"
    data = json.loads(re.search(r'id="qp-story">(.*?)</script>', page, re.DOTALL)[1])
    assert data["tracks"] == story.tracks
    assert not re.search(r"""(src|href)=|https?:|url\(|@import""", page), "nothing is fetched"
    assert page.endswith("</body></html>")


@pytest.mark.skipif(shutil.which("chromium") is None, reason="needs Debian's chromium")
def test_a_browser_shows_legend_clock_and_status_of_the_moment(tmp_path):
    meshcat = recording.make_quiet_meshcat()
    mesh = ColorMesh()
    mesh.add_ball([0, 0, 0], 0.1, (1, 0, 0))
    recording.start_recording(meshcat)
    layers = MeshcatLayers(meshcat)
    for number, time in ((1, 0.0), (2, 1.0), (3, 3.0)):
        layers.replace("footholds", number, mesh, time)
    recording.save_recording(meshcat, tmp_path / "recording.html", example())

    def page_at(time: float) -> str:
        command = ["chromium", *BROWSER_FLAGS, f"--user-data-dir={tmp_path}/profile", "--enable-logging=stderr"]
        command += ["--dump-dom", f"file://{tmp_path}/recording.html#t={time}"]
        ended = subprocess.run(command, check=True, capture_output=True, text=True, timeout=90)
        assert "Uncaught" not in ended.stderr, ended.stderr
        return ended.stdout[ended.stdout.index('id="qp-status"') :]

    early, late = page_at(1.6), page_at(2.5)
    assert re.search(r'id="qp-clock">1\.60 s<', early)
    assert re.search(r'id="qp-phase">walking, gait standing trot<', early)
    assert re.search(r'id="qp-event">1\.50 s: swing blocked<', early)
    assert re.search(r'id="qp-verdict"[^>]*display: none', early)
    assert 'data-layer="footholds"' in early and 'data-layer="labels"' not in early
    assert re.search(r'id="qp-verdict"[^>]*display: block;?">fell after 2\.0 s: &lt;b&gt;it slipped', late)
