"""Who can watch a trial, and what its recording says."""

import pytest
from pydrake.geometry import MeshcatParams

from quadpips_drake.errors import UserInputError
from quadpips_drake.visualization import recording
from quadpips_drake.visualization.overlay.story import Story
from quadpips_drake.visualization.recording import make_quiet_meshcat, save_recording, start_recording


def test_only_this_machine_can_watch_unless_another_address_is_asked_for(monkeypatch):
    asked = []

    def listen(params: MeshcatParams):
        asked.append(params.host)

    monkeypatch.setattr(recording, "Meshcat", listen)
    make_quiet_meshcat()
    make_quiet_meshcat(host="*")
    assert asked == ["localhost", "*"]
    with pytest.raises(UserInputError, match="needs an address"):
        make_quiet_meshcat(host="")
    assert len(asked) == 2, "an empty host would mean all addresses"


def test_an_address_of_another_machine_is_refused():
    with pytest.raises(UserInputError, match=r"cannot listen on '203\.0\.113\.1'"):
        make_quiet_meshcat(host="203.0.113.1")


def test_a_title_is_text_and_nothing_else(tmp_path):
    meshcat = make_quiet_meshcat()
    start_recording(meshcat)
    save_recording(meshcat, tmp_path / "recording.html", Story(title="</title><script>alert('x')</script>"))
    html = (tmp_path / "recording.html").read_text(encoding="utf-8")
    assert "<title>&lt;/title&gt;&lt;script&gt;alert(&#x27;x&#x27;)&lt;/script&gt;</title>" in html
    assert "<script>alert('x')" not in html
