"""The gallery of environments in the documentation is up to date, with a small picture of each."""

from quadpips_drake.terrain.library import terrain_names
from tests.environments_page import MAX_BYTES, PAGE, PICTURES, make_page


def test_the_page_is_what_the_environments_say():
    assert PAGE.read_text(encoding="utf-8") == make_page(), "run: .venv/bin/python -m tests.environments_page --text"


def test_there_is_a_small_picture_of_each():
    pictures = {path.stem: path.stat().st_size for path in PICTURES.glob("*.png")}
    assert set(pictures) == set(terrain_names()), "run: .venv/bin/python -m tests.environments_page"
    assert max(pictures.values()) < MAX_BYTES
