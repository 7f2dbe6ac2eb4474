"""The server of the page, without a browser: who gets what, and when it ends."""

import asyncio
import json
from dataclasses import replace
from http import HTTPStatus

import pytest
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect

from quadpips_drake.cockpit import server as server_module
from quadpips_drake.cockpit.server import ENDED, Server, address, open_port
from quadpips_drake.cockpit.snapshot import Snapshot
from quadpips_drake.errors import UserInputError

PATIENCE = 30.0
TOO_LARGE = 1009
"""Close code of the WebSocket protocol for that."""


class StandIn:
    """In the place of a session."""

    def __init__(self):
        self.snapshot, self.calls, self.meshcat_port = Snapshot("paused", number=1), [], 7000

    def picture(self, name):
        return b"\x89PNG" if name == "map" else None

    def __getattr__(self, name):
        return lambda *arguments: self.calls.append((name, *arguments))


def serving(check):
    """Runs ``check(session, server, port)`` while the page is served; returns when the server has ended."""

    async def main():
        session, sockets = StandIn(), open_port("localhost", 0)
        server = Server(session)
        task = asyncio.ensure_future(server.serve(sockets))
        try:
            await asyncio.wait_for(check(session, server, sockets[0].getsockname()[1]), PATIENCE)
            await asyncio.wait_for(task, PATIENCE)
        finally:
            for socket in sockets:
                socket.close()

    asyncio.run(main())


async def linked(port, **headers):
    request = HTTPRequest(f"ws://localhost:{port}/link", headers=headers)
    link = await websocket_connect(request)
    return link, json.loads(await link.read_message())


async def snapshot_of(link, accept):
    """The first snapshot of which ``accept`` is true."""
    while True:
        message = json.loads(await link.read_message())
        if "snapshot" in message and accept(message["snapshot"]):
            return message["snapshot"]


def test_the_page_and_its_parts_are_served_and_nothing_else():
    async def check(session, server, port):
        client = AsyncHTTPClient()
        page = await client.fetch(f"http://localhost:{port}/")
        assert b"quadpips cockpit" in page.body
        assert b"https:" not in page.body and b"http:" not in page.body, "it needs no other server"
        for part in ("cockpit.js", "map.js", "gamepad.js", "cockpit.css", "pictures/map.png"):
            assert (await client.fetch(f"http://localhost:{port}/{part}")).code == HTTPStatus.OK
        for other in ("server.py", "../session.py", "pictures/camera.png", "pictures/secret.png", "%2e%2e/session.py"):
            with pytest.raises(HTTPClientError):
                await client.fetch(f"http://localhost:{port}/{other}")
        with pytest.raises(HTTPClientError):
            await client.fetch(f"http://localhost:{port}/", headers={"Host": "evil.example"})
        server.end()

    serving(check)


def test_pages_of_others_may_not_link():
    async def check(session, server, port):
        with pytest.raises(HTTPClientError):
            await linked(port, Origin="http://evil.example")
        server.end()

    serving(check)


def test_a_second_page_and_closing_one_do_no_harm():
    async def check(session, server, port):
        first, hello = await linked(port)
        assert hello["hello"]["meshcat"] == 7000 and "flat" in hello["hello"]["choices"]["terrain"]
        second, _ = await linked(port)
        assert session.calls == [("watch", True), ("pause", False), ("watch", True)], "only the first page lets it go"
        session.snapshot = replace(session.snapshot, time=1.0)
        for link in (first, second):
            assert (await snapshot_of(link, lambda s: s["time"] == 1.0))["state"] == "paused"
        first.close()
        await second.write_message(json.dumps({"do": "goal", "x": 1.0, "y": 2.0}))
        await second.write_message("{ nonsense")
        await second.write_message(json.dumps({"do": "goal", "x": "far"}))
        await second.write_message("[" * 9000)
        await second.write_message(b"\xff\xfe", binary=True)
        await second.write_message('{"do": "goal", "x": NaN, "y": 0}')
        errors = []
        while len(errors) < 5:
            message = json.loads(await second.read_message())
            errors += [message["error"]] if "error" in message else []
        no_json, no_number = "the page has sent what is no JSON", "'x' must be a number"
        assert errors == [no_json, no_number, no_json, no_json, no_number]
        assert [call for call in session.calls if call[0] == "move_goal"] == [("move_goal", 1.0, 2.0)]
        await second.write_message(json.dumps({"do": "end"}))
        while await second.read_message() is not None:
            pass
        assert second.close_code == ENDED, "the page knows that it need not link again"

    serving(check)


def test_a_page_that_sends_too_much_is_cut_off_and_the_others_are_not():
    async def check(session, server, port):
        first, _ = await linked(port)
        second, _ = await linked(port)
        await second.write_message(json.dumps({"do": "goal", "x": 1.0, "y": 2.0, "why": "x" * 20_000}))
        while await second.read_message() is not None:
            pass
        assert second.close_code == TOO_LARGE
        session.snapshot = replace(session.snapshot, time=1.0)
        assert (await snapshot_of(first, lambda s: s["time"] == 1.0))["state"] == "paused"
        assert not [call for call in session.calls if call[0] == "move_goal"]
        server.end()

    serving(check)


def test_it_ends_by_itself_when_the_run_is_over_and_no_page_is_open(monkeypatch):
    monkeypatch.setattr(server_module, "_LINGER", 0.2)

    async def check(session, server, port):
        link, _ = await linked(port)
        session.snapshot = replace(session.snapshot, state="over", note="fell")
        await snapshot_of(link, lambda s: s["state"] == "over")
        await asyncio.sleep(0.5)
        assert not server._ended.is_set(), "somebody still looks at it"
        link.close()

    serving(check)


def test_a_port_that_is_taken_is_refused():
    sockets = open_port("localhost", 0)
    port = sockets[0].getsockname()[1]
    with pytest.raises(UserInputError, match=f"port {port} .address already in use.; choose another one with --port"):
        open_port("localhost", port)
    for socket in sockets:
        socket.close()
    for socket in open_port("localhost", port):
        socket.close()
    assert address("*", 80) == "http://localhost:80/"
    with pytest.raises(UserInputError, match="needs an address"):
        open_port("", 0)
    with pytest.raises(UserInputError, match=r"cannot listen on 203\.0\.113\.1"):
        open_port("203.0.113.1", 0)
