"""The part of a page about how a trial ended: the story, the list of events, and what was asked and what happened."""

from html import escape

from quadpips_drake.html_page import picture, table
from quadpips_drake.trials.explaining.failure_figure import failure_figure
from quadpips_drake.trials.explaining.first_events import BOUNDS, chain_of, events_of, rules_in_words, story_of
from quadpips_drake.trials.explaining.last_moments import SHOWN, SPAN, LastMoments
from quadpips_drake.trials.result import TrialResult

_FEW = 15
"""A list of no more events than these is open at first."""


def end_section(moments: LastMoments, result: TrialResult) -> str:
    """The section about the last moments of a failure."""
    events = events_of(moments)
    chain = chain_of(events, result.sim_time)
    if not chain and result.reason not in ("fell", "left_terrain"):
        return "<p>Nothing went wrong at the end by the rules for falls.</p>"
    begin = min([result.sim_time - SHOWN, *(event.time - 0.3 for event in chain)])
    events, moments = [event for event in events if event.time >= begin], moments.since(begin)
    end = f"{result.reason.replace('_', ' ')} ({result.detail})" if result.detail else result.reason.replace("_", " ")
    first = events.index(chain[0]) if chain else None
    rows = ((k + 1, f"{event.time:.2f}", escape(event.kind), escape(event.text)) for k, event in enumerate(events))
    rules = "".join(f"<li><b>{escape(kind)}</b>: {escape(text)}</li>" for kind, text in rules_in_words().items())
    figure = failure_figure(moments, events, first)
    return f"""<h2>The last {result.sim_time - begin:.1f} s: what was asked and what happened</h2>
<p class="story">{escape(story_of(chain, end, result.sim_time))}</p>
<details{" open" if len(events) <= _FEW else ""}><summary>All {len(events)} events in this time</summary>
{table(("event", "t [s]", "kind", "what"), rows, text=(2, 3), first=first)}</details>
<p>{picture(figure, "base, feet, contacts and torques over the last seconds")}</p>
<details><summary>The rules by which events are found</summary><ul>{rules}</ul>
<p>The first event (red) is the earliest of the chain that leads to the end: going back from there, events without a pause
of {BOUNDS.pause:g} s between the end of one and the beginning of the next, but for those of the last kind. At least the last
{SHOWN:g} s are shown, at most {SPAN:g} s are looked at. The first event is where to look, no proof of the
cause.</p></details>"""
