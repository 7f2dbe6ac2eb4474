"""The profile of a trial: how its computing time divides, with how each part was obtained; as data and as a page."""

from dataclasses import asdict, dataclass
from html import escape
from pathlib import Path

from quadpips_drake.files import write_json, write_text
from quadpips_drake.html_page import page, table
from quadpips_drake.trials.profiling.physics_replay import physics_load
from quadpips_drake.trials.profiling.simulation_profiler import DRAKE, SimulationProfiler

FILES = ("profile.html", "profile.json")
SAMPLED, REPLAYED, LEFT = "sampled", "replayed", "the rest of Drake's own time"
HOW = {
    SAMPLED: "pyinstrument looked at the Python stack every 2 ms. A system has the time of its functions and of those "
    "that they call, without other systems whose values it waited for; rendering is what reading the camera's image took",
    REPLAYED: "after the trial, a station of its own went on from moments of the log, with nobody reading its sensors",
    LEFT: "what was sampled inside Drake, without the physics: events, the cache, contact results, conversions to Python",
}
"""How the seconds of a part were obtained."""
_MOST_CALLED = 20
_FONTS = "https://fonts.googleapis.com/css?family=Source+Code+Pro:400,600|Source+Sans+Pro:400,600&display=swap"
"""What pyinstrument's page would fetch from the network; without it a font of the system is used."""


@dataclass(frozen=True)
class Part:
    """One part of the computing time of a simulation."""

    name: str
    load: float
    """Wall-clock seconds per simulated second."""
    share: float
    """Of all computing time of the simulation [0..1]."""
    how: str
    """A key of HOW."""


@dataclass(frozen=True)
class TrialProfile:
    """Where the time of a trial went."""

    title: str
    parts: tuple[Part, ...]
    """Largest first; their shares sum up to 1."""
    calls: dict[str, float]
    """Function calls per simulated second; see CallCounts."""
    most_called: tuple[tuple[str, float], ...]
    stages: dict[str, dict]
    """result.json's ``timings_ms``: of the whole trial, by the stages' own stopwatch."""
    graph: str
    """pyinstrument's page, which needs no network."""

    def save_json(self, path: Path) -> None:
        """Writes everything but the graph."""
        write_json(path, {key: value for key, value in asdict(self).items() if key != "graph"} | {"how": HOW})

    def save_html(self, path: Path) -> None:
        """Writes the page: tables, and pyinstrument's call tree and time line below them."""
        write_text(path, _page(self))


def profile_of(trial, profiler: SimulationProfiler) -> TrialProfile:
    """Returns what ``profiler`` has found in a SimulatedTrial that has run."""
    seconds = profiler.seconds_by_owner()
    sim_time, total = max(profiler.sampled_sim_time, 1e-9), max(sum(seconds.values()), 1e-9)
    inside_drake = seconds.pop(DRAKE, 0.0)
    found = {name: (time, SAMPLED) for name, time in seconds.items()}
    physics = physics_load(trial.diagram.station, trial.log.arrays()) * sim_time if len(trial.log) else 0.0
    physics = min(physics, inside_drake)
    found |= {"physics": (physics, REPLAYED), "Drake's framework": (inside_drake - physics, LEFT)}
    parts = [Part(name, time / sim_time, time / total, how) for name, (time, how) in found.items()]
    return TrialProfile(
        title=trial.title(),
        parts=tuple(sorted(parts, key=lambda part: -part.share)),
        calls=profiler.counts.per_second(),
        most_called=tuple(profiler.counts.most_called(_MOST_CALLED)),
        stages=trial.timings.summary_ms(),
        graph=profiler.session_html().replace(_FONTS, "data:text/css,"),
    )


def _page(profile: TrialProfile) -> str:
    notes = "".join(f"<li><b>{escape(how)}</b>: {escape(text)}.</li>" for how, text in HOW.items())
    body = f"""<h1>{escape(profile.title)}: where the time of the simulation went</h1>
<p>Wall-clock time of the simulation alone, without building, compiling and writing. Some percent are the profiler's own.</p>
{table(("part", "s per simulated s", "share", "", "how"), map(_part_row, profile.parts), text=(0, 3, 4))}
<ul>{notes}</ul>
<div class="tables">
<div><h2>Stages, by their own stopwatch</h2>
{table(("stage", "computations", "median ms", "95 % ms", "total s"), map(_stage_row, profile.stages.items()))}</div>
<div><h2>Function calls per simulated second</h2>
<p>Counted by cProfile, in 0.1 s of each simulated second.</p>
{table(("", "calls / s"), map(_call_row, profile.calls.items()))}
{table(("most called", "calls / s"), map(_call_row, profile.most_called))}</div>
</div>
<h2>Call tree and time line</h2>
<p>What all stages do in their common base class (stage.py) is one branch, named after one of them.</p>
<iframe srcdoc="{escape(profile.graph)}"></iframe>"""
    return page(f"Profile: {profile.title}", body)


def _part_row(part: Part) -> tuple:
    bar = f'<span class="bar" style="width: {400 * part.share:.0f}px"></span>'
    return escape(part.name), f"{part.load:.3f}", f"{100 * part.share:.1f} %", bar, escape(part.how)


def _stage_row(entry: tuple[str, dict]) -> tuple:
    name, t = entry
    return escape(name), t["n"], f"{t['p50']:.2f}", f"{t['p95']:.2f}", f"{t['total'] / 1e3:.2f}"


def _call_row(entry: tuple[str, float]) -> tuple:
    return escape(entry[0].replace("_", " ") if entry[0].isidentifier() else entry[0]), f"{entry[1]:,.0f}"
