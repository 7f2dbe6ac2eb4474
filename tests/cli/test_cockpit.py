"""``quadpips cockpit``: what is refused and how; how it ends."""

import os
import signal
import socket
import subprocess
import sys
import urllib.request

import pytest
from typer.testing import CliRunner

from quadpips_drake.cli.main import app
from quadpips_drake.cockpit.server import open_port


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["--robot", "spot"], "unknown robot 'spot'"),
        (["--terrain", "moon"], "unknown terrain 'moon'"),
        (["--terrain", "gap", "--difficulty", "99"], "gap"),
        (["--planner", "magic"], "unknown planner 'magic'"),
        (["--port", "taken"], "--port"),
        (["--port", "99999"], "--port"),
        (["--host", ""], "needs an address"),
        (["--set", "stages.nothing=1"], "nothing"),
    ],
)
def test_bad_input_ends_with_one_line_and_status_2(arguments, part):
    result = CliRunner().invoke(app, ["cockpit", *arguments], prog_name="quadpips")
    assert result.exit_code == 2, result.output
    (line,) = result.stderr.splitlines()
    assert line.startswith("error: ") and part in line


def test_a_busy_port_is_one_line_and_status_2():
    sockets = open_port("localhost", 0)
    port = sockets[0].getsockname()[1]
    result = CliRunner().invoke(app, ["cockpit", "--walk", "--port", str(port)], prog_name="quadpips")
    for taken in sockets:
        taken.close()
    assert result.exit_code == 2
    assert result.stderr == f"error: the cockpit cannot listen on localhost, port {port} (address already in use); " + (
        "choose another one with --port\n"
    )


def test_ctrl_c_ends_it_without_a_traceback_and_frees_the_port():
    command = [sys.executable, "-m", "quadpips_drake.cli.main", "cockpit", "--walk", "--robot", "go2", "--port", "0"]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    try:
        address = process.stdout.readline().split()[1]
        with urllib.request.urlopen(address) as page:
            assert b"cockpit" in page.read()
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=120)
    finally:
        process.kill()
    assert process.returncode == 130, errors
    assert "Traceback" not in errors and "interrupted; the cockpit is closed" in errors
    port = int(address.rstrip("/").rpartition(":")[2])
    with socket.socket() as free:
        free.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        free.bind(("127.0.0.1", port))
