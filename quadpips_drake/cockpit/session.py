"""The session behind the page: a simulation in a thread of its own, told what to do from any other, told about in snapshots.

Nothing in here knows of a browser. What is asked for is done between two steps of the simulation, in the order in which it
was asked for; the simulated robot never sees half of it.
"""

import atexit
import gc
import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import replace

from quadpips_drake.cockpit.choices import Choice
from quadpips_drake.cockpit.controls import Controls
from quadpips_drake.cockpit.happenings import Happenings
from quadpips_drake.cockpit.live_run import LiveRun
from quadpips_drake.cockpit.live_trial import LiveTrial
from quadpips_drake.cockpit.pace import Pace
from quadpips_drake.cockpit.snapshot import Snapshot
from quadpips_drake.errors import UserInputError
from quadpips_drake.trials.simulated_trial import BREAKDOWNS, in_one_line
from quadpips_drake.visualization.recording import make_quiet_meshcat

PATIENCE = 60.0
"""How long ``close`` waits for the step that is being computed [s]."""


class Session:
    """Runs one trial after the other, each as chosen.

    What cannot be done as asked for is told among the happenings of the snapshots.
    """

    def __init__(self, choice: Choice, *, meshcat_host: str | None = None, speed: float | None = 1.0, paused: bool = False):
        """Begins at once, in the background.

        Args:
            choice: the first trial.
            meshcat_host: address on which a Meshcat is to listen; None: nothing is drawn.
            speed: simulated time goes by at most so many times as fast as a clock; None: as fast as possible.
            paused: whether the robot waits at first.

        Raises:
            UserInputError: Meshcat cannot listen there.
        """
        self._meshcat, self._controls = None, Controls(choice, paused)
        self._pace, self._happenings = Pace(speed), Happenings()
        self._snapshot = Snapshot("building", choice=choice, speed=speed)
        self._pictures: dict[str, bytes] = {}
        self._run: LiveRun | None = None
        self._watched = True
        # A Meshcat must be taken down by the thread that has made it: what is left over here must not wait for the thread's
        # collector, and the other way round.
        gc.collect()
        drawing = Future()
        self._thread = threading.Thread(target=self._work, args=(meshcat_host, drawing), name="cockpit", daemon=True)
        self._thread.start()
        atexit.register(self.close)  # an interpreter that ends must not pull away what the thread works with
        self.meshcat_port: int | None = drawing.result()
        """Where Meshcat listens; None: there is none."""

    @property
    def snapshot(self) -> Snapshot:
        """The newest one."""
        return self._snapshot

    def picture(self, name: str) -> bytes | None:
        """A PNG: "map", "camera" or "labels"; None while there is none."""
        return self._pictures.get(name)

    def wait_for(self, condition: Callable[[Snapshot], bool], timeout: float) -> Snapshot:
        """Waits for a snapshot of which ``condition`` is true, at most ``timeout`` [s]; returns the newest one."""
        with self._controls.changed:
            self._controls.changed.wait_for(lambda: condition(self._snapshot), timeout)
        return self._snapshot

    def begin(self, choice: Choice) -> None:
        """Begins another trial in the place of the present one."""
        self._controls.begin(choice)

    def pause(self, paused: bool = True) -> None:
        """Lets time stand still, or go on."""
        self._controls.pause(paused)

    def step(self, number: int = 1) -> None:
        """Lets time go on by so many samples (SAMPLE_RATE), and then stand still."""
        self._controls.step(number)

    def set_speed(self, speed: float | None) -> None:
        """See the constructor."""
        self._controls.order(lambda live: self._pace.set(speed))

    def watch(self, watched: bool) -> None:
        """Whether anybody looks at the pictures of the camera, which cost time."""
        self._watched = watched
        if self._run is not None:
            self._run.watched = watched

    def move_goal(self, x: float, y: float) -> None:
        """Puts the goal to x, y in W [m]."""
        self._controls.order(lambda live: live.move_goal(x, y))

    def push(self, forward: float, left: float, up: float, duration: float) -> None:
        """Pushes the robot with this force [N], in its heading frame, for ``duration`` [s]."""
        self._controls.order(lambda live: live.push(forward, left, up, duration))

    def spawn(self, kind: str, x: float, y: float) -> None:
        """Puts something into the world, at x, y [m]; for the kinds see ``stock``."""
        self._controls.order(lambda live: live.spawn(kind, x, y))

    def command(self, gait: str, velocity: tuple[float, float, float]) -> None:
        """Lets the robot walk like this: forward, left [m/s], turn [rad/s]."""
        self._controls.order(lambda live: live.command(gait, velocity))

    def show_layer(self, layer: str, shown: bool) -> None:
        """Shows or hides one of ``live_trial.LAYERS``."""
        self._controls.order(lambda live: live.show_layer(layer, shown))

    def close(self) -> None:
        """Ends the trial after the present step, and the thread."""
        self._controls.end()
        self._thread.join(PATIENCE)
        atexit.unregister(self.close)

    def _work(self, meshcat_host: str | None, drawing: Future) -> None:
        """What the thread does; ``drawing`` is told the port of Meshcat, which obeys only the thread that has made it."""
        try:
            self._meshcat = None if meshcat_host is None else make_quiet_meshcat(host=meshcat_host)
        except UserInputError as error:
            drawing.set_exception(error)
            return
        drawing.set_result(None if self._meshcat is None else self._meshcat.port())
        while (choice := self._controls.next_choice()) is not None:
            number, before = self._snapshot.number + 1, self._snapshot.happenings
            self._pace.rest()
            self._happenings.forget()
            self._tell(Snapshot("building", choice=choice, number=number, speed=self._pace.speed, happenings=before), {})
            try:
                live = LiveTrial(choice, meshcat=self._meshcat)
            except BREAKDOWNS as error:
                self._tell(replace(self._snapshot, state="over", note=in_one_line(error)), {})
                continue
            self._let_go(live, number)
            # Here and now: a renderer can only be taken down by the thread that has used it.
            del live
            gc.collect()
        self._meshcat = None
        gc.collect()

    def _let_go(self, live: LiveTrial, number: int) -> None:
        """Runs the trial to its end, and tells how that came."""
        self._run = LiveRun(live, number, self._controls, self._pace, self._happenings, self._tell)
        self._run.watched = self._watched
        with suppress(KeyboardInterrupt):  # not wanted any more, or the program is interrupted
            live.trial.run(look=self._run)
        verdict = live.trial.verdict
        note = f"{verdict.reason.replace('_', ' ')}: {verdict.detail}".removesuffix(": ")
        if verdict.reason != "interrupted":
            self._happenings.note(live.trial.context.get_time(), "trouble", note)
        try:
            self._run.tell(state="over", note=note)
        except BREAKDOWNS:  # what broke off may not be looked at any more
            self._tell(replace(self._snapshot, state="over", note=note, happenings=self._happenings.newest()), {})
        self._run = None

    def _tell(self, snapshot: Snapshot, pictures: dict[str, bytes]) -> None:
        with self._controls.changed:
            self._pictures |= pictures
            self._snapshot = snapshot
            self._controls.changed.notify_all()
