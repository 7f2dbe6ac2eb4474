"""Which event came first: rules that turn the last moments of a trial into a list of what went wrong, in order.

Every rule compares what was asked with what happened, and dates its event to the moment at which it began to matter: a touch
that comes early to the touch, a missing touch-down to when it was due, what exceeds a bound to when it does. Events are no
proof of a cause; the first one is where to look.
"""

from dataclasses import dataclass, replace

import numpy as np

from quadpips_drake.math.angles import wrap_angle
from quadpips_drake.robots.robot_model import LINK_NAMES
from quadpips_drake.trials.explaining.last_moments import LastMoments
from quadpips_drake.values.legs import Leg


@dataclass(frozen=True)
class Bounds:
    """From when on a difference between asked and happened is an event: all of the rules' numbers."""

    early: float = 0.06
    """A foot that touches the ground so long before its planned touch-down [s] ..."""
    left: float = 0.03
    """... after it has been free of it for so long in this swing [s], has come down early or hit something."""
    stuck: float = 0.10
    """A foot that touches the ground all the time until so long after its planned lift-off [s] has not left it."""
    astray: float = 0.05
    """A swinging foot that is so far from where it is to be [m] is astray."""
    late: float = 0.08
    """A foot without ground so long after its planned touch-down [s] is late."""
    lost: float = 0.08
    """A foot that is to stand and loses the ground for so long [s] has lost it."""
    settled: float = 0.05
    """So long after it has touched a foot may still move [s]; from there on ..."""
    slip: float = 0.03
    """... one that stands and moves so far along the ground [m] slips."""
    tilt: float = 0.10
    """Roll or pitch that is so far from what was asked [rad]."""
    sink: float = 0.05
    """A base so far above or below the height that was asked [m]."""
    aside: float = 0.10
    """A base so far from the place that was asked, horizontally [m]."""
    stop: float = 0.003
    """A joint so near to the end of its range [rad] is at its stop."""
    saturation: float = 0.98
    """A torque of so much of its limit [1] ..."""
    saturated: float = 0.05
    """... for so long [s] is saturated."""
    near: float = 0.015
    """Heights that differ by less than this are called the same [m]."""


BOUNDS = Bounds()


@dataclass(frozen=True)
class Event:
    """Something that should not have happened."""

    time: float
    """[s]"""
    kind: str
    """A key of KINDS."""
    text: str


KINDS = {
    "early contact": "a foot touches while it swings, more than {early:g} s before its touch-down",
    "stuck": "a foot has not left the ground {stuck:g} s after its lift-off",
    "late contact": "a foot has no ground {late:g} s after its touch-down was due (dated to when it was due)",
    "lost contact": "a foot that stands loses the ground for {lost:g} s or more (dated to when it lost it)",
    "itself": "two links of the robot touch each other",
    "link": "a link touches something that is not the robot, other than with its foot",
    "astray": "a swinging foot is more than {astray:g} m from its way",
    "slip": "a foot that stands has moved by more than {slip:g} m along the ground",
    "tilt": "roll or pitch are more than {tilt:g} rad from the reference",
    "height": "the base is more than {sink:g} m above or below the reference",
    "aside": "the base is more than {aside:g} m from the reference, horizontally",
    "joint stop": "a joint is within {stop:g} rad of the end of its range",
    "torque": "a joint is at {saturation:.0%} of its torque limit for {saturated:g} s or more",
    "told": "the safety monitor takes the reference away, for reasons of its own",
}
"""What each kind of event means, with the names of Bounds; ``told`` is a consequence and never the first event."""


def rules_in_words(bounds: Bounds = BOUNDS) -> dict[str, str]:
    """The meaning of each kind of event, with its numbers."""
    return {kind: text.format(**vars(bounds)) for kind, text in KINDS.items()}


def events_of(moments: LastMoments, bounds: Bounds = BOUNDS) -> list[Event]:
    """Returns all events in order of time; of those at one time, feet come before the body."""
    events = [event for leg in Leg for event in _contact_events(moments, leg, bounds)]
    events += [event for leg in Leg for event in _slips(moments, leg, bounds)]
    events += _link_events(moments)
    events += _joint_events(moments, bounds) + _base_events(moments, bounds)
    events += [Event(time, "told", text) for time, text in moments.told]
    events = [replace(event, time=float(event.time)) for event in events]
    return sorted(events, key=lambda event: event.time)  # a stable sort


def story_of(events: list[Event], end: str, end_time: float, *, most: int = 4) -> str:
    """Returns one sentence: what came first, what followed, how it ended.

    Args:
        events: of ``events_of``.
        end: how the trial ended.
        end_time: when [s].
        most: events that are named after the first, one of each kind.
    """
    own = [event for event in events if event.kind != "told"]
    if not own:
        return f"By the rules below nothing went wrong before t = {end_time:.2f} s: {end}."
    named, kinds = [own[0]], {own[0].kind}
    for event in own[1:]:
        if event.kind not in kinds and len(named) <= most:
            named.append(event)
            kinds.add(event.kind)
    return "; then ".join(f"t = {event.time:.2f} s: {event.text}" for event in named) + f"; t = {end_time:.2f} s: {end}."


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """First index of each run of True, and the index after its last."""
    changes = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(int)))
    return list(zip(changes[::2].tolist(), changes[1::2].tolist(), strict=True))


def _contact_events(moments: LastMoments, leg: Leg, bounds: Bounds) -> list[Event]:
    """What the contacts of one foot did that was not asked for."""
    swinging = ~moments.asked_contacts[:, leg]
    events = []
    for a, b in _runs(swinging):
        events += [event for event in (_in_swing(moments, leg, a, b, bounds), _astray(moments, leg, a, b, bounds)) if event]
    for a, b in _runs(~swinging):
        events += _in_stance(moments, leg, a, b, bounds)
    return events


def _in_swing(moments: LastMoments, leg: Leg, a: int, b: int, bounds: Bounds) -> Event | None:
    """The touch of a foot in the samples [a, b), in which it is to swing, if there is one before its time."""
    time, down = moments.time, moments.contacts[a:b, leg]
    swings = moments.swing_times[a:b, leg]
    liftoff = swings[0, 0] if np.isfinite(swings[0, 0]) else time[a]
    free = [(first, last) for first, last in _runs(~down) if time[a + last - 1] - time[a + first] >= bounds.left - 1e-9]
    if not free:
        until = time[b - 1] - liftoff
        lasts = down.all() and until >= bounds.stuck - 1e-9
        return Event(liftoff + bounds.stuck, "stuck", f"{leg.name} did not leave the ground") if lasts else None
    k = a + free[0][1]
    if k >= b:
        return None
    touchdown = moments.swing_times[k, leg, 1]
    if not np.isfinite(touchdown):
        touchdown = time[min(b, len(time) - 1)]
    early = touchdown - time[k]
    if early < bounds.early - 1e-9:
        return None
    where = _off_its_way(moments, leg, k, bounds)
    return Event(
        time[k],
        "early contact",
        f"{leg.name} touched {early:.2f} s early, {where}: {_what_was_hit(moments, leg, k, bounds)}",
    )


def _astray(moments: LastMoments, leg: Leg, a: int, b: int, bounds: Bounds) -> Event | None:
    """When a foot left its way in the samples [a, b), in which it is to swing."""
    error = np.linalg.norm(moments.feet[a:b, leg] - moments.asked_feet[a:b, leg], axis=1)
    beyond = np.flatnonzero(error > bounds.astray)
    if len(beyond) == 0:
        return None
    text = f"{leg.name} was astray, {100 * bounds.astray:.0f} cm and later {100 * np.nanmax(error):.0f} cm from its way"
    return Event(moments.time[a + beyond[0]], "astray", text)


def _off_its_way(moments: LastMoments, leg: Leg, k: int, bounds: Bounds) -> str:
    """Where a swinging foot is, beside where it was to be."""
    if np.isnan(moments.asked_feet[k, leg]).any():
        return "in mid-swing"
    error = moments.feet[k, leg] - moments.asked_feet[k, leg]
    if abs(error[2]) >= bounds.near:
        return f"{100 * abs(error[2]):.0f} cm {'above' if error[2] > 0 else 'below'} its way"
    aside = np.hypot(*error[:2])
    return f"{100 * aside:.0f} cm beside its way" if aside >= bounds.near else "on its way"


def _what_was_hit(moments: LastMoments, leg: Leg, k: int, bounds: Bounds) -> str:
    """What a foot met before its time: by the direction of the force and the height of the ground there."""
    force = moments.forces[k : k + 3, leg].mean(axis=0)
    if np.hypot(*force[:2]) > abs(force[2]):
        return "it hit something from the side"
    higher = moments.ground[k, leg] - (moments.footholds[k, leg, 2] - moments.foot_radius)
    if np.isnan(higher):
        return "it hit something"
    if abs(higher) < bounds.near:
        return "it came down on ground as high as its foothold"
    return f"it came down on ground {100 * abs(higher):.0f} cm {'above' if higher > 0 else 'below'} its foothold"


def _in_stance(moments: LastMoments, leg: Leg, a: int, b: int, bounds: Bounds) -> list[Event]:
    """Where a foot lacks the ground in the samples [a, b), in which it is to stand."""
    time, events = moments.time, []
    for first, last in _runs(~moments.contacts[a:b, leg]):
        first, last = a + first, a + last
        lasted = time[min(last, len(time) - 1)] - time[first]
        due = first == a > 0
        if lasted < (bounds.late if due else bounds.lost) - 1e-9:
            continue
        end = f"for {lasted:.2f} s" if last < b else "any more"
        if due:
            came = f"came down {lasted:.2f} s late" if last < b else f"found no ground within {lasted:.2f} s"
            events.append(Event(time[first], "late contact", f"{leg.name} {came}{_foothold_error(moments, leg, a, bounds)}"))
        else:
            events.append(Event(time[first], "lost contact", f"{leg.name}, which was to stand, had no ground {end}"))
    return events


def _foothold_error(moments: LastMoments, leg: Leg, a: int, bounds: Bounds) -> str:
    """How far the foothold of the swing before sample ``a`` is from the true ground."""
    foothold, ground = moments.footholds[a - 1, leg], moments.foothold_ground[a - 1, leg]
    if np.isnan(foothold).any():
        return ""
    if np.isnan(ground):
        return "; there is nothing under its foothold"
    higher = foothold[2] - moments.foot_radius - ground
    if abs(higher) < bounds.near:
        return ""
    return f"; its foothold was {100 * abs(higher):.0f} cm {'above' if higher > 0 else 'below'} the true ground"


def _slips(moments: LastMoments, leg: Leg, bounds: Bounds) -> list[Event]:
    """Where a standing foot moved along the ground."""
    time, events = moments.time, []
    for a, b in _runs(moments.asked_contacts[:, leg] & moments.contacts[:, leg]):
        settled = a if a == 0 else a + int(np.searchsorted(time[a:b] - time[a], bounds.settled - 1e-9))
        if settled >= b:
            continue
        moved = np.hypot(*(moments.feet[settled:b, leg, :2] - moments.feet[settled, leg, :2]).T)
        beyond = np.flatnonzero(moved > bounds.slip)
        if len(beyond):
            when = time[settled + beyond[0]]
            events.append(
                Event(when, "slip", f"{leg.name} slipped, by {100 * moved.max():.0f} cm until t = {time[b - 1]:.2f} s")
            )
    return events


def _base_events(moments: LastMoments, bounds: Bounds) -> list[Event]:
    """When the base left what was asked, each kind once."""
    asked = _held(moments.asked_base, moments.base)
    error = moments.base - asked
    error[:, 3:] = wrap_angle(error[:, 3:])
    checks = [
        ("tilt", error[:, 3], bounds.tilt, "roll is {:+.2f} rad off"),
        ("tilt", error[:, 4], bounds.tilt, "pitch is {:+.2f} rad off"),
        ("height", error[:, 2], bounds.sink, "the base is {:+.2f} m off its height"),
        ("aside", np.hypot(error[:, 0], error[:, 1]), bounds.aside, "the base is {:.2f} m off its way"),
    ]
    events = []
    for kind, values, bound, text in checks:
        beyond = np.flatnonzero(np.abs(values) > bound)
        if len(beyond):
            since = " already" if beyond[0] == 0 else ""
            events.append(Event(moments.time[beyond[0]], kind, text.format(values[beyond[0]]) + since))
    return events


def _held(asked: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """``asked`` with the last known row where there is none; before the first, and without any, the first measured one."""
    known = ~np.isnan(asked).any(axis=1)
    last = np.maximum.accumulate(np.where(known, np.arange(len(asked)), -1))
    return np.where((last >= 0)[:, None], asked[last], measured[0])


def _link_events(moments: LastMoments) -> list[Event]:
    """When links touched something, and each other; each once."""
    since = [np.flatnonzero(flags) for flags in moments.touches.T]
    events = [
        Event(moments.time[rows[0]], "link", f"{_called(link)} touched something")
        for link, rows in zip(LINK_NAMES, since, strict=True)
        if len(rows)
    ]
    met = set()
    for time, one, other in moments.itself:
        if (one, other) not in met:
            events.append(Event(time, "itself", f"{_called(other)} touched {_called(one)}: the robot hit itself"))
            met.add((one, other))
    return events


def _called(link: str) -> str:
    """The name of a link for people."""
    return "the torso" if link == "base" else link


def _joint_events(moments: LastMoments, bounds: Bounds) -> list[Event]:
    """When joints came to their stops and to their torque limits, each once."""
    events = []
    lower, upper = moments.joint_limits
    for joint, (name, limit) in enumerate(zip(moments.joint_names, moments.torque_limits, strict=True)):
        for a, b in _runs(np.abs(moments.torques[:, joint]) >= bounds.saturation * limit):
            if moments.time[b - 1] - moments.time[a] >= bounds.saturated - 1e-9:
                events.append(Event(moments.time[a], "torque", f"joint {name} came to its torque limit of {limit:.0f} N m"))
                break
        position = moments.joints[:, joint]
        at_stop = np.flatnonzero(np.minimum(position - lower[joint], upper[joint] - position) < bounds.stop)
        if len(at_stop):
            text = f"joint {name} came to its stop at {position[at_stop[0]]:.2f} rad"
            events.append(Event(moments.time[at_stop[0]], "joint stop", text))
    return events
