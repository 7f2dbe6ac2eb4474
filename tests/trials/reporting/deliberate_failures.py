"""Ten failures made on purpose, and what their post-mortems say: ``python -m tests.trials.reporting.deliberate_failures``.

Each is one command of ``quadpips``; the table that is printed is the one in docs/reports.md. ``--only NAME`` (may be
repeated) makes some of them; results go to ``--out`` (default: out/deliberate_failures), where those that are there already
are not made again. Takes some minutes. Status 1 if the true cause comes first in fewer than nine of ten.
"""

import argparse
import json
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from quadpips_drake.terrain.files.terrain_file import write_terrain_file
from quadpips_drake.terrain.terrain import Box, Terrain, pose
from quadpips_drake.values.steppability import Steppability

PASSED = 0.9
"""In so many of them the true cause has to come first [1]."""
WALLED = "walled_goal.yaml"


@dataclass(frozen=True)
class Failure:
    """One failure made on purpose."""

    name: str
    arguments: str
    """Of ``quadpips``; {folder} is where the terrain files are."""
    causes: tuple[str, ...]
    """What the post-mortem may call it."""


FAILURES = (
    Failure(
        "friction 0.1",
        "walk --gait pace --velocity 0.5,0.2,0.4 --set stages.station.model_error.friction=0.1 --duration 6",
        ("low friction",),
    ),
    Failure("push of 60 N s", "walk --push 0,600,0,3,0.1 --duration 6", ("push",)),
    Failure(
        "solver failing",
        "walk --robot go2 --gait flying_trot --velocity 0.8,0,0 --set stages.tracking.faults.outage_start=[3] "
        "--set stages.tracking.faults.outage_duration=3 --duration 6",
        ("mpc solver failed",),
    ),
    Failure("pit in the way", "run --terrain gap --difficulty 0.9 --start=-0.9,0,0 --duration 12", ("gap in the way",)),
    Failure("camera blind", "run --set stages.perception.depth_noise.dropout=1 --duration 8", ("camera blind",)),
    Failure(
        "payload of 60 %",
        "walk --terrain bumps --difficulty 0.05 --velocity 0.6,0,0 --set stages.station.model_error.payload=31 --duration 9",
        ("payload",),
    ),
    Failure(
        "MPC delay of 80 ms",
        "walk --terrain bumps --difficulty 0.05 --velocity 0.6,0,0 --set stages.tracking.mpc.latency=0.08 --duration 9",
        ("MPC delay",),
    ),
    Failure(
        "blocked goal",
        f"run --terrain {{folder}}/{WALLED} --set stages.region_source=oracle --duration 12",
        ("goal blocked",),
    ),
    Failure("spawned wall", "run --terrain flat --spawn box:0.2,14,0.6@1.6,0@1.5 --duration 6", ("spawned obstacle",)),
    Failure(
        "Go2 on stairs of 10 cm", "walk --robot go2 --terrain stairs_10 --velocity 0.4,0,0 --duration 10", ("step too high",)
    ),
)


def walled_goal() -> Terrain:
    """Level ground with four walls around the goal."""
    ground = Box(size=[16.0, 16.0, 0.2], X_WE=pose([0.0, 0.0, -0.1]))
    sides = [([0.1, 2.1, 0.6], [2.0, 0.0, 0.3]), ([0.1, 2.1, 0.6], [4.0, 0.0, 0.3])]
    sides += [([2.1, 0.1, 0.6], [3.0, 1.0, 0.3]), ([2.1, 0.1, 0.6], [3.0, -1.0, 0.3])]
    walls = [Box(size=size, X_WE=pose(center), label=Steppability.NON_PASSABLE) for size, center in sides]
    return Terrain(name="walled_goal", start=[0.0, 0.0, 0.0], goal=[3.0, 0.0], friction=1.0, elements=(ground, *walls))


def make(failure: Failure, folder: Path) -> dict:
    """Runs a failure unless it is there already; returns its result.json."""
    out = folder / failure.name.replace(" ", "_")
    if not (out / "result.json").exists():
        arguments = shlex.split(failure.arguments.format(folder=folder))
        command = [sys.executable, "-m", "quadpips_drake.cli.main", *arguments, "--no-recording", "--out", str(out)]
        print(f"{failure.name}: quadpips {shlex.join(arguments)}", file=sys.stderr)
        subprocess.run(command, check=False)
    return json.loads((out / "result.json").read_text())


def row(failure: Failure, result: dict) -> tuple[str, bool]:
    """A line of the table, and whether the true cause came first."""
    cause = result["cause"]
    said = f"**{cause['cause']}**: {cause['text']}" if cause else "nothing"
    right = cause.get("cause") in failure.causes
    ended = f"{result['reason'].replace('_', ' ')} after {result['sim_time']:.1f} s"
    command = failure.arguments.format(folder="DIR").replace("|", "\\|")
    return f"| {failure.name} | `{command}` | {ended} | {said} | {'yes' if right else 'no'} |", right


def main(arguments: list[str] | None = None) -> int:
    """Makes the failures, prints the table and returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tests.trials.reporting.deliberate_failures", description=__doc__)
    names = [failure.name for failure in FAILURES]
    parser.add_argument("--only", action="append", choices=names, help="one of them; may be repeated")
    parser.add_argument("--out", type=Path, default=Path("out/deliberate_failures"), help="where results go")
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    write_terrain_file(walled_goal(), options.out / WALLED)
    chosen = [failure for failure in FAILURES if not options.only or failure.name in options.only]
    rows = [row(failure, make(failure, options.out)) for failure in chosen]
    print("| failure | `quadpips ...` | ended | the post-mortem says first | true cause |\n|---|---|---|---|---|")
    print("\n".join(line for line, _ in rows))
    right = sum(is_right for _, is_right in rows)
    print(f"\nThe true cause comes first in {right} of {len(rows)}.")
    return 0 if right >= PASSED * len(rows) else 1


if __name__ == "__main__":
    sys.exit(main())
