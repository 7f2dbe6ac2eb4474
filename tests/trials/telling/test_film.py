"""Films from the files of a trial."""

import imageio_ffmpeg
import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.trials.telling.film import FilmCamera, FilmConfig, make_film
from quadpips_drake.trials.telling.film_drawings import FilmDrawings
from quadpips_drake.trials.telling.replay import Replay, TrialFiles
from quadpips_drake.visualization.colors import COMMAND_COLOR, PUSH_COLOR
from tests.trials.telling.standing_trial import DURATION, write_standing_trial

PUSH = [{"force": [0.0, 200.0, 0.0], "time": 0.2, "duration": 0.05}]


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    return write_standing_trial(tmp_path_factory.mktemp("walk"), is_walk=True, terrain="flat", pushes=PUSH)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return write_standing_trial(tmp_path_factory.mktemp("run"), is_walk=False, terrain="stepping_stones")


def has_color(picture: np.ndarray, color) -> bool:
    """Whether something of that hue is in a picture, brighter or darker."""
    direction = np.asarray(color) / np.linalg.norm(color)
    lengths = np.linalg.norm(picture.astype(float), axis=2)
    return ((picture @ direction > 0.97 * lengths) & (lengths > 60)).sum() > 20


def test_a_film_of_a_walk_shows_command_and_push(walk):
    camera = FilmCamera(TrialFiles(walk), FilmConfig(width=480, height=270, fps=10.0))
    before, pushed = camera.picture(0.1), camera.picture(0.22)
    assert before.shape == (270, 480, 3)
    open_ground = slice(30, 250), slice(130, 470)  # without words
    assert has_color(before[open_ground], COMMAND_COLOR)
    new = np.where((pushed != before).any(axis=2, keepdims=True), pushed, 0)[open_ground]
    assert has_color(new, PUSH_COLOR)


def test_a_film_of_a_run_shows_what_the_robot_sees(run):
    files, pictures = TrialFiles(run), []
    for inset in (True, False):
        camera = FilmCamera(files, FilmConfig(width=480, height=270, fps=10.0, inset=inset))
        pictures.append([camera.picture(time) for time in (0.0, 0.2, 0.4)][-1])  # what is seen first comes late
    with_inset, without = pictures
    corner = slice(20, 100), slice(345, 465)
    changed = np.abs(with_inset.astype(int) - without).max(axis=2) > 30
    assert changed[corner].mean() > 0.5
    assert not changed[150:, :300].all()


def test_a_plan_is_drawn_when_it_is_published_and_once(run):
    class Meshes:
        def __init__(self):
            self.shown = []

        def show(self, context, name, mesh, X_WM=None):
            self.shown.append(name)

    meshes = Meshes()
    drawings = FilmDrawings(Replay(TrialFiles(run)), meshes)
    for time in (0.0, 0.05):
        drawings.draw(None, time)
    assert not meshes.shown
    for time in (0.1, 0.2, 0.3):
        drawings.draw(None, time)
    assert sorted(meshes.shown) == ["base_reference", "footholds", "swings"]


def test_the_file_has_the_size_and_length_that_was_asked_for(walk, tmp_path):
    seen = []
    options = FilmConfig(width=320, height=180, fps=10.0, speed=0.5)
    size = make_film(walk, tmp_path / "a.mp4", options, lambda time, end: seen.append((time, end)))
    assert size == (tmp_path / "a.mp4").stat().st_size > 1000
    about = next(imageio_ffmpeg.read_frames(tmp_path / "a.mp4"))
    assert about["size"] == (320, 180) and about["codec"] == "h264"
    assert about["duration"] == pytest.approx(DURATION / 0.5 + 1.5, abs=0.2), "half as fast, and the last picture stays"
    assert seen[0][0] == 0.0 and seen[-1] == (pytest.approx(DURATION), pytest.approx(DURATION))
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("a.avi", {}, r"must end in \.mp4 or \.gif"),
        ("none/a.mp4", {}, "there is no directory"),
        ("a.mp4", {"begin": 9.0}, "begin at 9 s, but the trial is over at 0.4 s"),
        ("a.mp4", {"width": 20}, "at least 120 x 120"),
    ],
)
def test_what_cannot_be_filmed_is_said_in_one_line(name, options, message, walk, tmp_path):
    with pytest.raises(UserInputError, match=message):
        make_film(walk, tmp_path / name, FilmConfig(**options))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("spoil", ["missing", "config.yaml", "log.npz", "result.json"])
def test_a_directory_without_a_whole_trial_is_refused(spoil, walk, tmp_path):
    if spoil != "missing":
        for path in walk.iterdir():
            (tmp_path / path.name).write_bytes(path.read_bytes())
        (tmp_path / spoil).write_text("{" if spoil != "config.yaml" else "robot: nobody\ngait: trot\n")
    with pytest.raises(UserInputError) as caught:
        make_film(tmp_path, tmp_path / "a.mp4")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "a.mp4").exists()


def test_elements_that_appeared_are_there_from_their_time_on(tmp_path):
    directory = write_standing_trial(
        tmp_path, is_walk=False, terrain="flat", spawn=["box:0.3,0.3,0.3@1.5,0@0.1"], duration=5.0
    )
    files = TrialFiles(directory)
    X_WE = np.eye(4)
    X_WE[:3, 3] = 1.5, 0.0, 0.15
    files.story.note(0.1, appeared=[[0, 0.1, X_WE.ravel().tolist()]])
    replay = Replay(files)
    context = replay.station.CreateDefaultContext()
    body = replay.station.plant.GetBodyByName("appearing_000")
    for time, x in ((0.05, 0.0), (0.2, 1.5)):
        replay.go_to(context, time)
        X_WA = body.EvalPoseInWorld(replay.station.plant.GetMyContextFromRoot(context))
        assert X_WA.translation()[0] == pytest.approx(x)
