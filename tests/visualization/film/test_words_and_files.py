"""Words over pictures, and files of video."""

import numpy as np
import pytest
from PIL import Image

from quadpips_drake.values.steppability import Steppability
from quadpips_drake.visualization.colors import REGION_COLORS
from quadpips_drake.visualization.film import encoding
from quadpips_drake.visualization.film.encoding import save_film
from quadpips_drake.visualization.film.words import FilmWords, depth_picture
from quadpips_drake.visualization.overlay.story import Story


def noise(count: int, size: int = 64) -> list[np.ndarray]:
    return list(np.random.default_rng(0).integers(0, 255, (count, size, size, 3), dtype=np.uint8))


def test_words_change_with_the_story_and_leave_the_rest_alone():
    story = Story("a title", verdict="fell", end=2.0)
    story.note(0.0, phase="planning", feet=0)
    story.note(1.0, phase="walking", feet=15)
    words, sky = FilmWords(640, 360, ("footholds",)), np.full((360, 640, 3), 90, np.uint8)
    pictures = [words.write(sky, story, time) for time in (0.5, 0.5, 1.5, 2.0)]
    assert (pictures[0] == pictures[1]).all()
    assert (pictures[0] != pictures[2]).any() and (pictures[2] != pictures[3]).any()
    assert (sky == 90).all(), "the picture itself is not written on"
    middle = pictures[3][150:250, 300:]
    assert (middle == 90).all()
    assert (pictures[0][250:, :300] != 90).any(), "the legend"
    low = FilmWords(320, 180, ("footholds",)).write(sky[:180, :320], story, 0.5)
    assert (low[120:] == 90).all(), "no room for a legend"


def test_depth_is_grey_in_the_colours_of_labels():
    depth = np.full((4, 8), 1.0, np.float32)
    depth[:, 6:] = np.nan
    labels = np.repeat([[1, 1, 3, 3, 0, 0, 1, 1]], 4, axis=0).astype(np.uint8)
    picture = depth_picture(depth, labels, 3.0).astype(int)
    assert picture.shape == (2, 4, 3)
    for column, label in ((0, Steppability.STEPPABLE), (1, Steppability.NON_PASSABLE)):
        assert picture[0, column].argmax() == np.argmax(REGION_COLORS[label])
    assert np.ptp(picture[0, 2]) == 0, "grey where nobody has judged"
    assert picture[0, 3].max() < 40, "dark where there is nothing"


def test_a_gif_becomes_coarser_until_it_is_small_enough(tmp_path, monkeypatch):
    sizes = []
    for limit in (10_000_000, 50_000):
        monkeypatch.setattr(encoding, "MAX_GIF", limit)
        sizes.append(save_film(tmp_path / "a.gif", iter(noise(12)), 10.0))
        with Image.open(tmp_path / "a.gif") as gif:
            lasts = sum(gif.seek(k) or gif.info["duration"] for k in range(gif.n_frames))
        assert lasts == pytest.approx(1200, abs=150), "it plays as fast as before"
    assert sizes[1] < 50_000 < sizes[0]


def test_nothing_is_left_of_a_film_that_breaks_off(tmp_path):
    def breaks_off():
        yield noise(1)[0]
        raise KeyboardInterrupt

    for name in ("a.mp4", "a.gif"):
        with pytest.raises(KeyboardInterrupt):
            save_film(tmp_path / name, breaks_off(), 10.0)
    assert not list(tmp_path.iterdir())
