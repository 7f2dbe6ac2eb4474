"""How the memory of the cockpit grows during a long walk: python -m tests.cockpit.memory --minutes 8

Starts `quadpips cockpit --walk` as a user would, and is its page and its 3-D view at once, without a browser: it reads all
that either is sent, lets the robot walk in circles as fast as it can be simulated, pushes it and switches layers.
"""

import argparse
import asyncio
import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from tornado.websocket import websocket_connect

WARM = 60.0
"""Growth is counted from this simulated time on [s]: before, caches fill."""
EVERY = 10.0
"""Between two looks at the memory, and two pushes, simulated [s]."""


def megabytes(process: subprocess.Popen) -> float:
    """What ``process`` holds in memory now [MB]."""
    fields = Path(f"/proc/{process.pid}/status").read_text(encoding="ascii").split("VmRSS:")[1].split()
    return int(fields[0]) / 1000.0


async def drain(address: str) -> None:
    """Reads what the 3-D view is sent."""
    link = await websocket_connect(address)
    while await link.read_message() is not None:
        pass


async def watch(process: subprocess.Popen, port: int, minutes: float) -> list[tuple[float, float]]:
    """Walks for so many minutes by the clock; returns simulated times [s] and memory [MB]."""
    link = await websocket_connect(f"ws://localhost:{port}/link")
    hello = json.loads(await link.read_message())["hello"]
    view = asyncio.ensure_future(drain(f"ws://localhost:{hello['meshcat']}/"))

    def send(do: str, **what) -> None:
        link.write_message(json.dumps({"do": do, **what}))

    rows, began, walks = [], time.monotonic(), False
    send("speed", speed=None)
    while time.monotonic() - began < 60.0 * minutes:
        snapshot = json.loads(await link.read_message()).get("snapshot")
        if snapshot is None or snapshot["state"] not in ("running", "over"):
            continue
        if snapshot["state"] == "over":
            print(f"over: {snapshot['note']}")
            break
        if not walks and snapshot["time"] > 1.0:
            walks = True
            send("command", gait="trot", forward=0.3, left=0.0, turn=0.3)
        if snapshot["time"] >= EVERY * len(rows):
            rows.append((snapshot["time"], megabytes(process)))
            print(f"{rows[-1][0]:7.1f} s simulated, {time.monotonic() - began:6.1f} s by the clock, {rows[-1][1]:7.1f} MB")
            send("push", forward=0.0, left=40.0, up=0.0, duration=0.1)
            send("layer", layer="pushes", shown=len(rows) % 2 == 0)
    view.cancel()
    send("end")
    return rows


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--minutes", type=float, default=8.0, help="by the clock")
    options.add_argument("--robot", default="go2")
    chosen = options.parse_args()
    command = [sys.executable, "-m", "quadpips_drake.cli.main", "cockpit", "--walk", "--robot", chosen.robot, "--port", "0"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    port = int(process.stdout.readline().split()[1].rstrip("/").rpartition(":")[2])
    try:
        rows = asyncio.run(watch(process, port, chosen.minutes))
        process.wait(60)
    finally:
        process.kill()
    times, memory = np.array([row for row in rows if row[0] >= WARM]).reshape(-1, 2).T
    if len(times) > 2:
        slope = np.polyfit(times / 60.0, memory, 1)[0]
        print(f"{memory[-1] - memory[0]:.1f} MB more after {(times[-1] - times[0]) / 60.0:.1f} simulated minutes")
        print(f"{30.0 * slope:.1f} MB in 30 minutes, by the slope")


if __name__ == "__main__":
    main()
