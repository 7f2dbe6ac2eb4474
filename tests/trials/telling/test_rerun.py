"""What ``--rerun`` writes."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from quadpips_drake.cli import doctor
from quadpips_drake.errors import UserInputError
from quadpips_drake.trials.loading import load_config, load_walk_config
from quadpips_drake.trials.telling.narrator import Narrator
from quadpips_drake.trials.telling.rerun_watcher import IMAGE_PERIOD, POSE_PERIOD, RerunWatcher
from quadpips_drake.trials.trial import Trial
from quadpips_drake.trials.walk_trial import WalkTrial
from quadpips_drake.visualization.replaying.rerun_stream import check_rerun_name

DURATION = 0.5


def chunks_by_entity(path: Path) -> dict[str, int]:
    """How many chunks of data each entity has in a file, as Rerun itself counts them."""
    command = [str(Path(sys.executable).parent / "rerun"), "rrd", "stats", str(path)]
    printed = subprocess.run(command, check=True, capture_output=True, text=True, timeout=120).stdout
    return {entity: int(count) for entity, count in re.findall(r"^(/\S+): (\d+)$", printed, re.MULTILINE)}


@pytest.mark.parametrize("kind", [Trial, WalkTrial])
def test_everything_is_on_one_time_line(kind, tmp_path):
    pytest.importorskip("rerun", reason="needs the extra [rerun]")
    config = (load_config if kind is Trial else load_walk_config)("go2", terrain="flat", duration=DURATION, latency="zero")
    trial = kind(config)
    narrator, watcher = Narrator(), RerunWatcher(tmp_path / "trial.rrd", trial)

    def look(trial):
        narrator.look(trial)
        watcher.look(trial)

    trial.run(look=look)
    watcher.finish(narrator.finish(trial))
    assert watcher.problem == ""
    found = chunks_by_entity(tmp_path / "trial.rrd")
    always = {"/world/terrain", "/world/robot/LF_SHANK", "/plots/torques", "/plots/height", "/events"}
    seen = {"/world/camera/depth", "/world/camera/labels", "/superpixels", "/world/superpixels", "/world/regions"}
    assert always <= found.keys()
    assert (seen <= found.keys()) == (kind is Trial), "who walks by command sees nothing"
    assert found["/world/robot"] <= DURATION / POSE_PERIOD + 2
    if kind is Trial:
        assert found["/world/camera/depth"] <= DURATION / IMAGE_PERIOD + 2


def test_a_missing_package_is_said_in_one_line_and_noted_by_the_doctor(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(UserInputError, match=r"needs the package rerun-sdk.*\[rerun\]"):
        check_rerun_name(tmp_path / "a.rrd")
    (check,) = (check for check in doctor.checks() if check.name == "Rerun")
    verdict, remark = doctor.outcome(check)
    assert verdict == doctor.NOTE and "only --rerun needs it" in remark


@pytest.mark.parametrize(("name", "message"), [("a.txt", r"must end in \.rrd"), ("none/a.rrd", "there is no directory")])
def test_a_file_that_cannot_be_is_refused(name, message, tmp_path):
    with pytest.raises(UserInputError, match=message):
        check_rerun_name(tmp_path / name)
    if name.startswith("none"):
        with pytest.raises(UserInputError, match="no directory"):
            check_rerun_name(tmp_path / "none" / "deeper" / "a.rrd", tmp_path / "none")
