"""The index of all systems in the documentation is up to date."""

from tests.systems_page import PAGE, make_page


def test_the_page_is_what_the_docstrings_say():
    assert PAGE.read_text(encoding="utf-8") == make_page(), "run: .venv/bin/python -m tests.systems_page"
