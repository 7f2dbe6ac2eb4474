"""Parts of the pages of HTML that a trial leaves: self-contained, so that they open offline."""

import base64
import io
from collections.abc import Iterable
from html import escape

from matplotlib.figure import Figure

_STYLE = """
body { font: 15px/1.4 system-ui, sans-serif; margin: 24px; color: #222; background: #fff; }
table { border-collapse: collapse; margin: 8px 0 24px; display: block; overflow-x: auto; }
th, td { padding: 2px 14px 2px 0; text-align: right; border-bottom: 1px solid #ddd; vertical-align: top; }
.text { text-align: left; }
.bar { display: inline-block; height: 10px; background: #4a7fb5; }
.tables { display: flex; flex-wrap: wrap; gap: 0 64px; }
.first { background: #fbe9e7; }
.story { font-size: 17px; border-left: 4px solid #d32f2f; padding: 4px 14px; max-width: 70em; }
.good { border-left-color: #388e3c; }
img { max-width: 100%; }
iframe { width: 100%; height: 900px; border: 1px solid #ccc; }
"""


def page(title: str, body: str) -> str:
    """A whole page; ``body`` is HTML, ``title`` text."""
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title><style>{_STYLE}</style></head>
<body>
{body}
</body></html>
"""


def table(head: tuple[str, ...], rows: Iterable[tuple], text: tuple[int, ...] = (0,), first: int | None = None) -> str:
    """A table of ``rows`` (HTML or numbers); columns ``text`` begin at the left, the row ``first`` stands out."""

    def line(cells, tag: str, style: str = "") -> str:
        marked = (f"<{tag}{' class=text' if k in text else ''}>{cell}</{tag}>" for k, cell in enumerate(cells))
        return f"<tr{style}>{''.join(marked)}</tr>"

    lines = (line(row, "td", " class=first" if number == first else "") for number, row in enumerate(rows))
    return f"<table>{line(head, 'th')}{''.join(lines)}</table>"


def picture(figure: Figure, alternative: str, dpi: int = 90) -> str:
    """A figure as an image in the page; ``alternative``: what it shows, in words."""
    data = io.BytesIO()
    # A layout engine leaves no margins to be cut off, and cutting them means to draw everything twice.
    margins = None if figure.get_layout_engine() is not None else "tight"
    figure.savefig(data, dpi=dpi, format="png", bbox_inches=margins, metadata={"Software": None})
    encoded = base64.b64encode(data.getvalue()).decode()
    return f'<img alt="{escape(alternative)}" src="data:image/png;base64,{encoded}">'
