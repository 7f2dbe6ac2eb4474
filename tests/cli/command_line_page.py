"""Writes docs/command_line.md, all commands and their options, from the commands: python -m tests.cli.command_line_page"""

import re
from collections.abc import Iterator

import typer
from typer.core import TyperCommand, TyperGroup

from quadpips_drake.cli.main import app
from tests.source_tree import ROOT

PAGE = ROOT / "docs" / "command_line.md"
_HEAD = """# The command line

Every command, written from the commands themselves by `python -m tests.cli.command_line_page`; a test compares. The same is
printed by `quadpips COMMAND --help`. What `run` and `walk` write and how they end is told in [running.md](running.md), what
`bench` writes in [benchmark.md](benchmark.md); keys for `--set` in [configuration_reference.md](configuration_reference.md).
"""


def make_page() -> str:
    """Returns the text of the page."""
    root = typer.main.get_command(app)
    sections = ["\n".join(_section(command, context)) for command, context in commands(root)]
    return "\n".join([_HEAD, *sections])


def commands(command: TyperCommand | TyperGroup, parent=None) -> Iterator[tuple]:
    """Yields the command and all below it, each with a context in which it could be called."""
    context = typer.Context(command, parent=parent, info_name=command.name)
    yield command, context
    for name in command.list_commands(context) if isinstance(command, TyperGroup) else ():
        yield from commands(command.get_command(context, name), context)


def _section(command, context) -> list[str]:
    """The lines about one command."""
    level = 2 if context.parent is None or context.parent.parent is None else 3
    usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
    lines = [f"{'#' * level} {context.command_path}", "", _inline(command.help), "", "```", usage, "```", ""]
    parameters = [_row(parameter, context) for parameter in command.get_params(context)]
    rows = [row for row in parameters if row]
    lines += ["| | |", "|---|---|", *rows, ""] if rows else []
    return lines + _epilog(command.epilog) if command.epilog else lines


def _row(parameter, context) -> str:
    record = parameter.get_help_record(context)
    return f"| `{_cell(record[0])}` | {_inline(record[1])} |" if record else ""


def _epilog(text: str) -> list[str]:
    """Examples, which are indented, become one block of code; the rest stays text."""
    lines = []
    for paragraph in re.split(r"\n\s*\n", text.strip("\n")):
        if not paragraph.startswith("  "):
            lines += [_inline(paragraph), ""]
        elif lines and lines[-2:] == ["```", ""]:
            lines[-2:] = [paragraph.strip(), "```", ""]
        else:
            lines += ["```", paragraph.strip(), "```", ""]
    return lines


def _inline(text: str | None) -> str:
    """Plain text on one line of Markdown."""
    return _cell(re.sub(r"([*<])", r"\\\1", " ".join((text or "").split())))


def _cell(text: str) -> str:
    return text.replace("|", r"\|")


if __name__ == "__main__":
    PAGE.write_text(make_page(), encoding="utf-8")
    print(f"wrote {PAGE}")
