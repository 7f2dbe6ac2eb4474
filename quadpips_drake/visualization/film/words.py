"""Words over the pictures of a film: title, clock, status, feet on the ground, legend; and a picture in the picture."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from quadpips_drake.values.legs import Leg
from quadpips_drake.values.steppability import Steppability
from quadpips_drake.visualization.colors import LEG_COLORS, REGION_COLORS
from quadpips_drake.visualization.overlay.legend import LEGEND, as_hex
from quadpips_drake.visualization.overlay.story import Story

_FONTS = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
_PANEL, _INK, _ALARM = (255, 255, 255, 205), (25, 33, 44, 255), (178, 58, 0, 255)
_EVENT_SHOWN = 2.0
"""How long an event stays [s]."""
_LEAST_HEIGHT_FOR_LEGEND = 330
"""Lower pictures have no room for one [pixels]."""


@dataclass(frozen=True)
class FilmWords:
    """Writes over pictures of one size."""

    width: int
    """[pixels]"""
    height: int
    """[pixels]"""
    layers: tuple = ()
    """Names of the layers that the legend explains."""

    @property
    def size(self) -> int:
        """Of the letters [pixels]."""
        return max(10, round(self.height / 34))

    @cached_property
    def _plain(self):
        return ImageFont.truetype(str(_FONTS / "DejaVuSans.ttf"), self.size)

    @cached_property
    def _bold(self):
        return ImageFont.truetype(str(_FONTS / "DejaVuSans-Bold.ttf"), round(1.15 * self.size))

    @cached_property
    def _small(self):
        return ImageFont.truetype(str(_FONTS / "DejaVuSans.ttf"), max(9, round(0.8 * self.size)))

    @cached_property
    def _legend(self) -> Image.Image | None:
        """The legend, drawn once; the labels stand at the picture of what the robot sees."""
        entries = [entry for entry in LEGEND if entry.layer in self.layers and entry.layer != "labels"]
        if not entries or self.height < _LEAST_HEIGHT_FOR_LEGEND:
            return None
        step = round(1.25 * self.size)
        panel = Image.new("RGBA", (self.width, step * len(entries) + self.size), _PANEL)
        draw, y = ImageDraw.Draw(panel), self.size // 2
        right = 0
        for entry in entries:
            x = self.size // 2
            for color, meaning in entry.colors:
                x = self._swatch(draw, x, y, color, meaning)
            draw.text((x, y), entry.words, font=self._small, fill=_INK)
            right = max(right, x + draw.textlength(entry.words, font=self._small) + self.size // 2)
            y += step
        return panel.crop((0, 0, min(round(right), self.width), panel.height))

    def _swatch(self, draw: ImageDraw.ImageDraw, x: float, y: float, color, meaning: str) -> float:
        """Draws a colour and what it means; returns where the next one begins [pixels]."""
        side = 0.8 * self.size
        draw.rectangle((x, y + 2, x + side, y + 2 + side), fill=as_hex(color))
        draw.text((x + 1.2 * side, y), meaning, font=self._small, fill=_INK)
        return x + 1.6 * side + draw.textlength(meaning, font=self._small)

    def write(self, picture: np.ndarray, story: Story, time: float, inset: np.ndarray | None = None) -> np.ndarray:
        """Returns ``picture``, uint8 (height, width, 3), with what the ``story`` says at ``time`` [s] and an ``inset``."""
        image = Image.fromarray(picture).convert("RGBA")
        layer = Image.new("RGBA", image.size)
        if inset is not None:
            self._place(layer, inset)
        self._write_status(layer, story, time)
        if self._legend is not None:
            layer.alpha_composite(self._legend, (self.size, self.height - self._legend.height - self.size))
        image.alpha_composite(layer)
        return np.asarray(image.convert("RGB"))

    def _write_status(self, layer: Image.Image, story: Story, time: float) -> None:
        lines = [(text, self._bold if k == 0 else self._plain, color) for k, (text, color) in enumerate(_lines(story, time))]
        step, draw = round(1.4 * self.size), ImageDraw.Draw(layer)
        width = max([draw.textlength(text, font=font) for text, font, _ in lines] + [10.5 * self.size])
        box = (self.size, self.size, 2 * self.size + width, 1.8 * self.size + step * (len(lines) + 1))
        draw.rounded_rectangle(box, self.size // 3, fill=_PANEL)
        x = y = round(1.5 * self.size)
        for text, font, color in lines:
            draw.text((x, y), text, font=font, fill=color)
            y += step
        feet = int(story.at("feet", time, 0))
        for leg in Leg:
            color, down = as_hex(LEG_COLORS[leg]), feet >> leg & 1
            box = (x, y, x + 2 * self.size, y + 1.2 * self.size)
            draw.rectangle(box, fill=color if down else None, outline=color, width=2)
            middle = (x + self.size, y + 0.6 * self.size)
            draw.text(middle, leg.name, font=self._plain, anchor="mm", fill=(255, 255, 255, 255) if down else _INK)
            x += round(2.3 * self.size)

    def _place(self, layer: Image.Image, inset: np.ndarray) -> None:
        """Puts a picture into the upper right corner."""
        width = round(0.27 * self.width)
        small = Image.fromarray(inset).resize((width, round(width * inset.shape[0] / inset.shape[1])))
        left = self.width - width - self.size
        draw = ImageDraw.Draw(layer)
        draw.rectangle((left - 2, self.size - 2, left + width + 1, self.size + small.height + 1), fill=(255, 255, 255, 255))
        layer.paste(small, (left, self.size))
        draw.text((left + 4, self.size + 2), "what the robot sees", font=self._small, fill=(255, 255, 255, 255))
        if self.height >= _LEAST_HEIGHT_FOR_LEGEND:
            y = self.size + small.height + 1
            draw.rectangle((left - 2, y, left + width + 1, y + 2.9 * self.size), fill=_PANEL)
            entry = next(entry for entry in LEGEND if entry.layer == "labels")
            for k, (color, meaning) in enumerate(entry.colors):
                row, column = divmod(k, 2)
                self._swatch(draw, left + 4 + column * width // 2, y + 3 + row * 1.35 * self.size, color, meaning)


def _lines(story: Story, time: float):
    """What the story says at ``time`` [s]: texts with colours, the title first."""
    yield story.title, _INK
    phase, gait, text = (str(story.at(name, time)).replace("_", " ") for name in ("phase", "gait", "text"))
    yield f"{time:5.2f} s   " + ", ".join(part for part in (phase, gait and f"gait {gait}") if part), _INK
    numbers = [str(story.at(name, time)) for name in ("plan", "goal", "command", "speed", "push")]
    if said := "  ".join(part for part in (*numbers[:2], text if text != phase else "", *numbers[2:]) if part):
        yield said, _INK
    if story.verdict and time >= story.end - 1e-3:
        yield story.verdict, _INK
    elif time - story.since("event", time) < _EVENT_SHOWN:
        yield f"{story.since('event', time):.2f} s: {story.at('event', time)}", _ALARM


def depth_picture(depth: np.ndarray, labels: np.ndarray, max_range: float) -> np.ndarray:
    """A depth image [m], NaN where there is none, as grey values (near is bright) in the colours of the labels.

    Returns: uint8 (height, width, 3), of half the size.
    """
    depth, labels = depth[::2, ::2], labels[::2, ::2]  # it is shown small
    nearness = np.nan_to_num(1.0 - depth / max_range, nan=0.0, posinf=0.0).clip(0.0, 1.0)
    grey = np.where(np.isfinite(depth), 0.25 + 0.75 * nearness, 0.08)
    table = np.array([REGION_COLORS[Steppability(value)] for value in range(len(REGION_COLORS))])
    table[Steppability.UNKNOWN] = 1.0
    tint = table[labels] if labels.shape == depth.shape else np.ones((*depth.shape, 3))
    return np.round(255 * grey[..., None] * (0.25 + 0.75 * tint)).clip(0, 255).astype(np.uint8)
