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
    held: float = 0.5
    """So long after a reference was lost its last values still count [s]."""
    stop: float = 0.003
    """A joint so near to the end of its range [rad] is at its stop."""
    saturation: float = 0.98
    """A torque of so much of its limit [1] ..."""
    saturated: float = 0.05
    """... for so long [s] is saturated."""
    soon: float = 0.3
    """What happens again within this time [s] still is the same event."""
    pause: float = 0.75
    """A time without events [s] ends the chain that leads to the end, seen from there."""
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
    until: float = -np.inf
    """When it was over [s]; before ``time``: at once."""


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
    events += _link_events(moments, bounds)
    events += _joint_events(moments, bounds) + _base_events(moments, bounds)
    events += [Event(time, "told", text) for time, text in moments.told]
    events = [replace(event, time=float(event.time), until=float(event.until)) for event in events]
    return sorted(events, key=lambda event: event.time)  # a stable sort


def chain_of(events: list[Event], end_time: float, bounds: Bounds = BOUNDS) -> list[Event]:
    """Returns the events, but ``told``, that led to the end of the trial [s]: those before it without a pause in between."""
    chain: list[Event] = []
    begin = end_time
    for event in sorted(events, key=lambda event: max(event.time, event.until), reverse=True):
        if event.kind == "told":
            continue
        if max(event.time, event.until) < begin - bounds.pause:
            break
        chain.append(event)
        begin = min(begin, event.time)
    return [event for event in events if event in chain]


def story_of(chain: list[Event], end: str, end_time: float, *, most: int = 4) -> str:
    """Returns one sentence: what came first, what followed, how it ended.

    Args:
        chain: of ``chain_of``.
        end: how the trial ended.
        end_time: when [s].
        most: events that are named after the first, one of each kind.
    """
    if not chain:
        return f"By the rules below nothing led to the end: t = {end_time:.2f} s: {end}."
    named, kinds = [chain[0]], {chain[0].kind}
    for event in chain[1:]:
        if event.kind not in kinds and len(named) <= most:
            named.append(event)
            kinds.add(event.kind)
    return "; then ".join(f"t = {event.time:.2f} s: {event.text}" for event in named) + f"; t = {end_time:.2f} s: {end}."


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """First index of each run of True, and the index after its last."""
    changes = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(int)))
    return list(zip(changes[::2].tolist(), changes[1::2].tolist(), strict=True))


def _spans(flags: np.ndarray, time: np.ndarray, bounds: Bounds) -> list[tuple[int, int]]:
    """The same, with runs made one that follow each other soon."""
    spans: list[tuple[int, int]] = []
    for a, b in _runs(flags):
        if spans and time[a] - time[spans[-1][1] - 1] < bounds.soon:
            a = spans.pop()[0]
        spans.append((a, b))
    return spans


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
        return Event(liftoff + bounds.stuck, "stuck", f"{leg.name} did not leave the ground", time[b - 1]) if lasts else None
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
    return Event(moments.time[a + beyond[0]], "astray", text, moments.time[a + beyond[-1]])


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
            text = f"{leg.name} {came}{_foothold_error(moments, leg, a, bounds)}"
            events.append(Event(time[first], "late contact", text, time[last - 1]))
        else:
            text = f"{leg.name}, which was to stand, had no ground {end}"
            events.append(Event(time[first], "lost contact", text, time[last - 1]))
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
            until = time[settled + int(np.argmax(moved))]
            text = f"{leg.name} slipped, by {100 * moved.max():.0f} cm until t = {until:.2f} s"
            events.append(Event(time[settled + beyond[0]], "slip", text, until))
    return events


def _base_events(moments: LastMoments, bounds: Bounds) -> list[Event]:
    """When the base left what was asked."""
    error = moments.base - _held(moments, bounds)
    error[:, 3:] = wrap_angle(error[:, 3:])
    checks = [
        ("tilt", error[:, 3], bounds.tilt, "roll is {:+.2f} rad off"),
        ("tilt", error[:, 4], bounds.tilt, "pitch is {:+.2f} rad off"),
        ("height", error[:, 2], bounds.sink, "the base is {:+.2f} m off its height"),
        ("aside", np.hypot(error[:, 0], error[:, 1]), bounds.aside, "the base is {:.2f} m off its way"),
    ]
    return [
        Event(moments.time[a], kind, text.format(values[a]), moments.time[b - 1])
        for kind, values, bound, text in checks
        for a, b in _spans(np.abs(values) > bound, moments.time, bounds)
    ]


def _held(moments: LastMoments, bounds: Bounds) -> np.ndarray:
    """``asked_base``; where there is none its last row, and after a while where the base was then: it is to stand there."""
    time, asked, known = moments.time, moments.asked_base.copy(), ~np.isnan(moments.asked_base).any(axis=1)
    for a, b in _runs(~known):
        anew = a if a == 0 else a + int(np.searchsorted(time[a:b] - time[a], bounds.held))
        asked[a:anew] = asked[a - 1]
        if anew < b:
            asked[anew:b] = moments.base[anew]
    return asked


def _link_events(moments: LastMoments, bounds: Bounds) -> list[Event]:
    """When links touched something, and each other."""
    time = moments.time
    events = [
        Event(time[a], "link", f"{_called(link)} touched something", time[b - 1])
        for link, flags in zip(LINK_NAMES, moments.touches.T, strict=True)
        for a, b in _spans(flags, time, bounds)
    ]
    for one, other in dict.fromkeys(entry[1:] for entry in moments.itself):
        met = np.isin(time, [when for when, *pair in moments.itself if tuple(pair) == (one, other)])
        text = f"{_called(other)} touched {_called(one)}: the robot hit itself"
        events += [Event(time[a], "itself", text, time[b - 1]) for a, b in _spans(met, time, bounds)]
    return events


def _called(link: str) -> str:
    """The name of a link for people."""
    return "the torso" if link == "base" else link


def _joint_events(moments: LastMoments, bounds: Bounds) -> list[Event]:
    """When joints came to their stops and to their torque limits."""
    events, time = [], moments.time
    lower, upper = moments.joint_limits
    for joint, (name, limit) in enumerate(zip(moments.joint_names, moments.torque_limits, strict=True)):
        flags = np.abs(moments.torques[:, joint]) >= bounds.saturation * limit
        for a, b in _runs(flags):
            flags[a:b] = time[b - 1] - time[a] >= bounds.saturated - 1e-9
        text = f"joint {name} came to its torque limit of {limit:.0f} N m"
        events += [Event(time[a], "torque", text, time[b - 1]) for a, b in _spans(flags, time, bounds)]
        position = moments.joints[:, joint]
        flags = np.minimum(position - lower[joint], upper[joint] - position) < bounds.stop
        for a, b in _spans(flags, time, bounds):
            events.append(
                Event(time[a], "joint stop", f"joint {name} came to its stop at {position[a]:.2f} rad", time[b - 1])
            )
    return events
