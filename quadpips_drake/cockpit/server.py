"""The page in the browser: served by Tornado, with a WebSocket for what is asked for and what there is to see."""

import asyncio
import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

from tornado.httpserver import HTTPServer
from tornado.ioloop import PeriodicCallback
from tornado.netutil import bind_sockets
from tornado.web import Application, HTTPError, RequestHandler, StaticFileHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from quadpips_drake.cockpit.choices import possibilities
from quadpips_drake.cockpit.messages import obey
from quadpips_drake.cockpit.session import Session
from quadpips_drake.cockpit.stock import KINDS
from quadpips_drake.errors import UserInputError
from quadpips_drake.visualization.overlay.legend import LEGEND, plain_legend

LOCAL = "localhost"
_PAGE = Path(__file__).parent / "page"
_PERIOD = 0.05
"""Between two looks for a newer snapshot [s]."""
_LINGER = 5.0
"""How long after the end of a run without any page the cockpit ends, too [s]."""
_LARGEST_MESSAGE = 10_000
"""Of a page [bytes]; whoever sends a larger one is cut off."""
ENDED = 4000
"""The code with which a page's link is closed when the cockpit ends; after any other one the page links again."""
_LOCAL_HOSTS = (LOCAL, "127.0.0.1", "::1")
_LOCAL_NAMES = r"(localhost|127\.0\.0\.1|\[::1\])"


def open_port(host: str, port: int) -> list:
    """Sockets that listen on ``host``; port 0: any free one.

    Raises:
        UserInputError: it is taken, or this is no address of this machine.
    """
    if not host:  # sockets would listen everywhere
        raise UserInputError("the cockpit needs an address to listen on, for example localhost; for all of them give '*'")
    try:
        return bind_sockets(port, None if host == "*" else host)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise UserInputError(
            f"the cockpit cannot listen on {host}, port {port} ({reason}); choose another one with --port"
        ) from None


def address(host: str, port: int) -> str:
    """Where the page is, for a browser on this machine."""
    return f"http://{LOCAL if host == '*' else host}:{port}/"


class Server:
    """Serves the page of one session, to as many browsers as come."""

    def __init__(self, session: Session, *, host: str = LOCAL):
        """Args: what the page shows; the address that it listens on."""
        self.session, self.links = session, set()
        self._ended = asyncio.Event()
        self._was_opened, self._idle = False, 0.0
        routes = [
            (r"/link", _Link, {"server": self}),
            (r"/pictures/(map|camera|labels)\.png", _Picture, {"session": session}),
            (r"/()", StaticFileHandler, {"path": _PAGE, "default_filename": "cockpit.html"}),
            (r"/([a-z]+\.(?:css|js))", StaticFileHandler, {"path": _PAGE}),
        ]
        self._application = Application(websocket_max_message_size=_LARGEST_MESSAGE)
        # Under another name no page is served: a foreign page whose name leads to this machine gets nothing.
        self._application.add_handlers(_LOCAL_NAMES if host in _LOCAL_HOSTS else r".*", routes)

    async def serve(self, sockets: list) -> None:
        """Serves until somebody ends it, or the run is over and no page is open."""
        server = HTTPServer(self._application)
        server.add_sockets(sockets)
        ticking = PeriodicCallback(self._tick, 1000.0 * _PERIOD)
        ticking.start()
        try:
            await self._ended.wait()
        finally:
            ticking.stop()
            server.stop()
            for link in list(self.links):
                link.close(ENDED, "the cockpit has ended")
            await asyncio.sleep(_PERIOD)  # so that they are told

    def end(self) -> None:
        """Ends ``serve``."""
        self._ended.set()

    def hello(self) -> dict:
        """What a page is told first."""
        choices, layers = possibilities(self.session.snapshot.choice), plain_legend([entry.layer for entry in LEGEND])
        return {"choices": choices, "layers": layers, "kinds": list(KINDS), "meshcat": self.session.meshcat_port}

    def come(self, link: "_Link") -> None:
        """A page was opened; the first one lets the robot go."""
        self.links.add(link)
        self.session.watch(True)
        if not self._was_opened:
            self._was_opened = True
            self.session.pause(False)

    def go(self, link: "_Link") -> None:
        """A page was closed."""
        self.links.discard(link)
        self.session.watch(bool(self.links))

    def _tick(self) -> None:
        snapshot = self.session.snapshot
        text = None
        for link in self.links:
            if link.wants(snapshot):
                text = text or json.dumps({"snapshot": asdict(snapshot)})
                link.tell(snapshot, text)
        is_idle = snapshot.state == "over" and not self.links
        self._idle = self._idle + _PERIOD if is_idle else 0.0
        if self._idle > _LINGER:
            self.end()


class _Link(WebSocketHandler):
    """One page. (The origin of a page is checked by Tornado: only one of this server may link.)"""

    def initialize(self, server: Server) -> None:
        self._server, self._shown, self._sending = server, None, None

    def open(self) -> None:
        self.set_nodelay(True)
        self._sending = asyncio.ensure_future(self._send(json.dumps({"hello": self._server.hello()})))
        self._server.come(self)

    def on_close(self) -> None:
        self._server.go(self)

    async def on_message(self, text: str | bytes) -> None:
        try:
            message = json.loads(text)
            if message == {"do": "end"}:
                self._server.end()
            else:
                obey(self._server.session, message)
        except UserInputError as error:
            await self._send(json.dumps({"error": str(error)}))
        except (ValueError, RecursionError):
            await self._send(json.dumps({"error": "the page has sent what is no JSON"}))

    def wants(self, snapshot) -> bool:
        """Whether it has not been told ``snapshot`` and is ready for it: nothing piles up before a slow browser."""
        return snapshot is not self._shown and (self._sending is None or self._sending.done())

    def tell(self, snapshot, text: str) -> None:
        self._shown = snapshot
        self._sending = asyncio.ensure_future(self._send(text))

    async def _send(self, text: str) -> None:
        with suppress(WebSocketClosedError):
            await self.write_message(text)


class _Picture(RequestHandler):
    """A picture of the session."""

    def initialize(self, session: Session) -> None:
        self._session = session

    def get(self, name: str) -> None:
        data = self._session.picture(name)
        if data is None:
            raise HTTPError(404)
        self.set_header("Content-Type", "image/png")
        self.set_header("Cache-Control", "no-store")
        self.finish(data)


def run(session: Session, sockets: list, *, host: str, ready: Callable[[], None]) -> None:
    """Serves the page until it is ended; then the session is closed as well, whatever ended it."""

    async def main() -> None:
        server = Server(session, host=host)
        ready()
        await server.serve(sockets)

    try:
        asyncio.run(main())
    finally:
        for socket in sockets:
            socket.close()
        session.close()
