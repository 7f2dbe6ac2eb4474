"""What goes on beside the simulation of a live trial, at each of its samples and in its thread."""

import time
from collections.abc import Callable

from quadpips_drake.cockpit.camera import Camera
from quadpips_drake.cockpit.controls import Controls
from quadpips_drake.cockpit.happenings import Happenings
from quadpips_drake.cockpit.live_trial import LiveTrial
from quadpips_drake.cockpit.map_view import MapView
from quadpips_drake.cockpit.pace import Pace
from quadpips_drake.cockpit.snapshot import Snapshot, seen, timings_of
from quadpips_drake.errors import UserInputError
from quadpips_drake.trials.simulated_trial import SimulatedTrial

PERIOD = 0.1
"""Between two snapshots, by the clock [s]."""
SLOW_PERIOD = 0.5
"""Between two pictures of the camera, and two looks at the timings, by the clock [s]."""
_LOOK_PERIOD = 0.1
"""Between two looks at what has happened, simulated [s]."""


class LiveRun:
    """Called with the trial at each sample: does what was asked for, keeps the pace, tells what there is to see."""

    def __init__(self, live: LiveTrial, number: int, controls: Controls, pace: Pace, happenings: Happenings, tell: Callable):
        """
        Args:
            live: the trial.
            number: of the trial.
            controls: what is asked for.
            pace: how fast it may go.
            happenings: takes down what happens.
            tell: called with a Snapshot and new pictures, {name: PNG}.
        """
        self._live, self._number, self._controls, self._pace = live, number, controls, pace
        self._happenings, self._tell = happenings, tell
        self._map, self._camera = MapView(), Camera(live)
        self._told = self._told_slowly = self._looked = -float("inf")
        self._timings, self._versions = {}, {}
        self.watched = True
        """Whether anybody looks at what costs time: the camera's pictures."""

    def __call__(self, trial: SimulatedTrial) -> None:
        time_now = trial.context.get_time()
        if time_now >= self._looked + _LOOK_PERIOD - 1e-9:
            self._looked = time_now
            self._happenings.look(self._live)
        if trial.verdict is not None:
            return
        self._obey()
        self._live.draw_push()
        deadline = time.monotonic() + self._pace.delay(time_now)
        if self._controls.stands_still or time.monotonic() >= self._told + PERIOD:
            self.tell()
        while not self._controls.wait(deadline):
            self._obey()
            self.tell()

    def _obey(self) -> None:
        """Does what was asked for."""
        for order in self._controls.take_orders():
            try:
                text = order(self._live)
            except UserInputError as error:
                self._happenings.note(self._live.trial.context.get_time(), "trouble", str(error))
            else:
                if text:
                    self._happenings.note(self._live.trial.context.get_time(), "you", text)
        if self._controls.stands_still:
            self._pace.rest()

    def tell(self, **more) -> None:
        """Tells what there is to see now; ``more``: other values of a Snapshot's fields."""
        self._told = now = time.monotonic()
        pictures = {}
        if now >= self._told_slowly + SLOW_PERIOD or self._controls.stands_still:
            self._told_slowly = now
            self._timings = timings_of(self._live)
            pictures |= self._camera.look() if self.watched else {}
        points = [self._live.state.p_WB] + ([] if self._live.goal is None else [self._live.goal])
        if self._map.show(self._live.world(), points):
            pictures["map"] = self._map.png
        # A version is never used twice, so that a browser never shows the picture of another trial.
        self._versions |= dict.fromkeys(pictures, f"{self._number}.{now:.3f}")
        fields = {
            "state": "paused" if self._controls.stands_still else "running",
            "choice": self._live.choice,
            "number": self._number,
            "factor": round(self._pace.factor(), 3),
            "speed": self._pace.speed,
            "pictures": dict(self._versions),
            "timings": self._timings,
            "happenings": self._happenings.newest(),
        }
        self._tell(Snapshot(**{**fields, **seen(self._live, self._map), **more}), pictures)
