"""How the memory of the cockpit grows during a long walk: python -m tests.cockpit.memory --minutes 8

A Go2 walks in circles as fast as it can be simulated, is pushed, and layers are switched; another process is the page and
the 3-D view at once: it reads all that either is sent. Every few seconds time stands still and the heap is measured: what is
in use (glibc's mallinfo2), and what the process holds, which comes and goes by tens of MB with what the allocator keeps.
"""

import argparse
import ctypes
import gc
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np

from quadpips_drake.cockpit.choices import BY_VELOCITY, Choice
from quadpips_drake.cockpit.server import open_port, run
from quadpips_drake.cockpit.session import Session

EVERY = 5.0
"""Between two measurements, simulated [s]."""
WARM = 15.0
"""Growth is counted from then on [s]."""
PATIENCE = 600.0
_READER = """
import asyncio
import sys
from tornado.websocket import websocket_connect

async def drain(address):
    link = await websocket_connect(address)
    while await link.read_message() is not None:
        pass

async def main():
    await asyncio.gather(*map(drain, sys.argv[1:]))

asyncio.run(main())
"""
_FIELDS = ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks", "fordblks", "keepcost")


class _Heap(ctypes.Structure):
    _fields_ = tuple((name, ctypes.c_size_t) for name in _FIELDS)


def megabytes() -> tuple[float, float]:
    """What is in use of this process's heap, and what the process holds of its own [MB]."""
    gc.collect()
    mallinfo2 = ctypes.CDLL("libc.so.6").mallinfo2
    mallinfo2.restype = _Heap
    heap = mallinfo2()
    held = Path("/proc/self/status").read_text(encoding="ascii").split("RssAnon:")[1].split()[0]
    return 1e-6 * (heap.uordblks + heap.hblkhd), 1e-3 * int(held)


def walk(session: Session, minutes: float) -> np.ndarray:
    """Lets the robot walk for so many minutes by the clock; returns rows of simulated time [s] and ``megabytes``."""
    session.wait_for(lambda s: s.time > 1.0, PATIENCE)
    session.command("trot", (0.3, 0.0, 0.3))
    rows, began = [], time.monotonic()
    while time.monotonic() - began < 60.0 * minutes:
        due = EVERY * (len(rows) + 1)
        session.wait_for(lambda s, due=due: s.state == "over" or s.time >= due, PATIENCE)
        session.pause()
        stands = session.wait_for(lambda s: s.state in ("paused", "over"), PATIENCE)
        rows.append((stands.time, *megabytes()))
        print("{:7.1f} s simulated: {:8.3f} MB in use, {:6.1f} MB held".format(*rows[-1]), flush=True)
        if stands.state == "over":
            print(f"over: {stands.note}")
            break
        session.push(0.0, 40.0, 0.0, 0.1)
        session.show_layer("pushes", len(rows) % 2 == 0)
        session.pause(False)
    return np.array(rows)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--minutes", type=float, default=8.0, help="by the clock")
    minutes = options.parse_args().minutes
    sockets = open_port("localhost", 0)
    choice = Choice(robot="go2", terrain="flat", planner=BY_VELOCITY)
    session = Session(choice, meshcat_host="localhost", speed=None, paused=True)
    options = {"host": "localhost", "ready": lambda: None}
    threading.Thread(target=run, args=(session, sockets), kwargs=options, daemon=True).start()
    links = [f"ws://localhost:{sockets[0].getsockname()[1]}/link", f"ws://localhost:{session.meshcat_port}/"]
    reader = subprocess.Popen([sys.executable, "-c", _READER, *links])
    try:
        rows = walk(session, minutes)
    finally:
        reader.kill()
        session.close()
    time_s, in_use, _ = rows[rows[:, 0] >= WARM].T
    if len(time_s) > 2:
        print(f"{1800.0 * np.polyfit(time_s, in_use, 1)[0]:.1f} MB more in use after 30 simulated minutes, by the slope")


if __name__ == "__main__":
    main()
