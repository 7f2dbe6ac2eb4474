"""Puts a story over a page that Meshcat has written: legend, clock, status, time line, cameras. Nothing is fetched."""

import json
from importlib.resources import files

from quadpips_drake.values.legs import Leg
from quadpips_drake.visualization.colors import LEG_COLORS
from quadpips_drake.visualization.overlay.legend import as_hex, plain_legend
from quadpips_drake.visualization.overlay.story import Story

_MARK = "STORY_AS_JSON"


def with_overlay(html: str, story: Story, layers, robot_path: str = "") -> str:
    """Returns the page with the overlay.

    Args:
        html: a page of Meshcat with everything in it.
        story: what to say, over the time of the page's animation.
        layers: names of the layers that there is something in.
        robot_path: where Meshcat has the robot's base, which cameras follow; empty: they stay.
    """
    data = story.plain() | {
        "legs": [[leg.name, as_hex(LEG_COLORS[leg])] for leg in Leg],
        "legend": plain_legend(layers),
        "robot_path": robot_path,
    }
    overlay = files(__package__).joinpath("overlay.html").read_text(encoding="utf-8")
    # "<" in a text must not end the script that holds it.
    text = json.dumps(data, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c")
    page, end, rest = html.rpartition("</body>")
    return f"{page}{overlay.replace(_MARK, text, 1)}{end}{rest}"
