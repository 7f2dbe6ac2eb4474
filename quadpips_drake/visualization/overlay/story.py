"""Story: what there is to say about a trial over time; recordings and films write it over the picture."""

import json
from bisect import bisect_right
from dataclasses import dataclass, field
from pathlib import Path

from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_json, write_text


@dataclass
class Story:
    """Grows by ``note``; every track holds its values from the time on at which they begin to hold."""

    title: str = ""
    subtitle: str = ""
    verdict: str = ""
    """How it ended, in words; empty while it goes on."""
    end: float = 0.0
    """When the verdict fell [s]."""
    tracks: dict[str, list] = field(default_factory=dict)
    """{name: [[time [s], value], ...]} in order of time; values are texts or numbers."""

    def note(self, time: float, **values) -> None:
        """Takes down what holds from ``time`` [s] on; what is as before takes no room."""
        for name, value in values.items():
            track = self.tracks.setdefault(name, [])
            if not track or track[-1][1] != value:
                track.append([round(float(time), 3), value])

    def happen(self, time: float, event: str) -> None:
        """Takes down what happened at ``time`` [s], also when it happens again."""
        self.tracks.setdefault("event", []).append([round(float(time), 3), event])

    def at(self, name: str, time: float, otherwise=""):
        """The value of a track at ``time`` [s]; ``otherwise`` where there is none yet."""
        track = self.tracks.get(name, [])
        k = bisect_right(track, time + 1e-9, key=lambda entry: entry[0])
        return track[k - 1][1] if k else otherwise

    def since(self, name: str, time: float) -> float:
        """Since when the present value of a track has held [s]; -inf where there is none yet."""
        track = self.tracks.get(name, [])
        k = bisect_right(track, time + 1e-9, key=lambda entry: entry[0])
        return track[k - 1][0] if k else float("-inf")

    def plain(self) -> dict:
        """As JSON has it."""
        return dict(vars(self))

    def save(self, path: str | Path) -> None:
        """Writes it as JSON."""
        write_text(path, json.dumps(self.plain(), ensure_ascii=False, separators=(",", ":")) + "\n")

    @staticmethod
    def load(path: str | Path) -> "Story":
        """Reads what ``save`` wrote; raises UserInputError where that cannot be."""
        try:
            story = Story(**read_json(path))
            tracks = {str(name): [[float(time), value] for time, value in track] for name, track in story.tracks.items()}
        except (ValueError, TypeError, AttributeError) as error:
            raise UserInputError(f"{path}: this is no story of a trial ({error}); run the trial again") from None
        story.tracks = tracks
        return story
