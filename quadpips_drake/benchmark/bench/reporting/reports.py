"""What a bench leaves for its readers: results.parquet, pictures, summary.md, and the same as one page of HTML."""

import base64
import re
from html import escape
from pathlib import Path

from markdown_it import MarkdownIt

from quadpips_drake.benchmark.bench.reporting.pictures import DPI, pictures_of
from quadpips_drake.benchmark.bench.reporting.results import RESULTS, write_results
from quadpips_drake.benchmark.bench.reporting.summary import summary
from quadpips_drake.benchmark.bench.settings import BenchSettings
from quadpips_drake.files import replacing, write_text

SUMMARY, PAGE = "summary.md", "summary.html"
"""The page, in the folder of a bench."""
_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 75em; margin: 2em auto; padding: 0 1em; color: #222; }
table { border-collapse: collapse; margin: 1em 0; font-variant-numeric: tabular-nums; display: block; overflow-x: auto; }
th, td { border: 1px solid #ccc; padding: 0.25em 0.6em; text-align: left; vertical-align: top; }
th { background: #f2f2f2; } img { max-width: 100%; }
"""


def write_reports(settings: BenchSettings, rows: list[dict], folder: Path) -> None:
    """Writes all of them into ``folder``; ``rows``: of the trials that are over, at least one."""
    write_results(rows, folder / RESULTS)
    titles = {}
    for name, title, figure in pictures_of(rows):
        with replacing(folder / name) as unfinished:
            figure.savefig(unfinished, dpi=DPI, format="png")
        titles[name] = title
    text = summary(settings, rows, titles)
    write_text(folder / SUMMARY, text)
    write_text(folder / PAGE, page_of(text, folder))


def page_of(text: str, folder: Path) -> str:
    """Markdown as one page of HTML with the pictures in it; ``folder``: where these lie. HTML in the text stays text."""
    body = MarkdownIt("commonmark", {"html": False}).enable("table").render(text)
    title = escape(text.splitlines()[0].lstrip("# "))
    head = f'<meta charset="utf-8"><title>{title}</title><style>{_STYLE}</style>'
    return f"<!DOCTYPE html>\n<html><head>{head}</head>\n<body>\n{re.sub(_IMAGE, _embedded(folder), body)}</body></html>\n"


_IMAGE = r'(?<=<img src=")[^":]+\.png(?=")'


def _embedded(folder: Path):
    """What to put in the place of a picture's name: the picture."""
    return lambda match: "data:image/png;base64," + base64.b64encode((folder / match[0]).read_bytes()).decode()
