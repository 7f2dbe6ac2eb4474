"""The page of all commands is up to date."""

from tests.cli.command_line_page import PAGE, make_page


def test_the_page_is_what_the_commands_say():
    assert PAGE.read_text(encoding="utf-8") == make_page(), "run: .venv/bin/python -m tests.cli.command_line_page"
