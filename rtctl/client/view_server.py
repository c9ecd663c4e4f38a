"""The page's server: static files, one stream of server-sent events per browser, recordings, a few buttons.

It listens on this machine's own address. A foreign page in the same browser can neither read, nor press, nor
take up the streams there are: Host, Origin and Sec-Fetch-Site are checked, and all but the files needs a
header that no foreign page (nor any image or frame of it) may send. STOP is for anyone; every other button
needs the operator key, which only the terminal shows."""

from __future__ import annotations

import json
import secrets
import sys
import threading
import time
from collections.abc import Callable, Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, urlsplit

from hw.motion import of_axes
from rtctl.client import RigClient, view_record
from rtctl.client.view_feed import Feed, Follower, Signal, columns
from rtctl.client.view_guests import Guests, Request
from rtctl.client.view_pages import FILES, PAGES, STATIC
from rtctl.client.view_panel import ACTIONS, shown_table, signals_of, status
from rtctl.client.view_world import World, offered
from rtctl.errors import RefusedError, RtctlError
from rtctl.wire.event_words import line_of

MOST_STREAMS = 8  # each has a thread, which wakes twenty times a second (MESSAGE_S)
MOST_RECORDINGS = 4
MOST_SIGNALS = 16
MOST_BODY = 4096
MOST_DIGITS = 9
# twenty pictures a second; the state changes at half of that, as one reads it
MESSAGE_S = 0.05
STATUS_S = 0.1
HEADERS = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data:; style-src 'self' "
    "'unsafe-inline'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


class ViewServer(ThreadingHTTPServer):
    """Serves one rig's page.

    Parameters
    ----------
    client
        Connected to the rig; used for requests by one thread at a time.
    host, port
        Address to listen on; port 0 takes a free one.
    key
        The operator key; made anew when not given."""

    daemon_threads = True
    allow_reuse_address = True  # a page started again finds its port in TIME_WAIT
    request_queue_size = 128  # at the usual 5 a crowd makes who presses STOP come again a second later

    def __init__(self, client: RigClient, host: str, port: int, key: str = "") -> None:
        self.client = client
        self.key = key or secrets.token_urlsafe(12)
        # bounded: to give back a place twice is a mistake, and raises
        self.streams = threading.BoundedSemaphore(MOST_STREAMS)
        self.recordings = threading.BoundedSemaphore(MOST_RECORDINGS)
        self.closing = threading.Event()
        self.guests = Guests()
        # before the socket listens: a page that finds no daemon is not opened
        self.hello = client.hello()
        super().__init__((host, port), _Handler)
        self.feed = Feed(client)
        self.world = World(client, self.hello)
        port = self.server_address[1]
        self.names = {f"{name}:{port}" for name in (host, "127.0.0.1", "localhost", "[::1]")}

    @property
    def url(self) -> str:
        """Address of the page, without the operator key."""
        host, port = self.server_address[:2]
        return f"http://{host if isinstance(host, str) else host.decode()}:{port}/"

    def get_request(self) -> tuple[Any, Any]:
        """The next connection."""
        try:
            return super().get_request()
        except OSError:  # no descriptor is left: it waits, and would be asked for as fast as a core can
            time.sleep(MESSAGE_S)
            raise

    def process_request(self, request: Request, client_address: object) -> None:
        """A thread for one connection."""
        self.guests.come(request)
        super().process_request(request, client_address)

    def shutdown_request(self, request: Request) -> None:
        """The end of a connection."""
        self.guests.go(request)
        super().shutdown_request(request)

    def handle_error(self, request: Request, client_address: object) -> None:
        """A browser that goes in the middle is not worth a word, and no stranger fills a terminal with
        them."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)

    def close(self) -> None:
        """End every stream, release everything. The rig runs on."""
        self.closing.set()  # first: streams look at it and end
        self.shutdown()
        self.world.close()
        self.feed.close()
        self.server_close()


class _Handler(BaseHTTPRequestHandler):
    server: ViewServer
    protocol_version = "HTTP/1.1"
    timeout = 30  # s: who begins a request and does not end it keeps a thread no longer

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing per request."""

    def do_GET(self) -> None:
        """Pages, static files, the stream, a recording."""
        url = urlsplit(self.path)
        # before anything is looked up: a foreign page learns not even what exists
        if not self._is_ours(url.path):
            return
        if url.path in FILES:
            name, kind = FILES[url.path]
            self._answer(HTTPStatus.OK, (STATIC / name).read_bytes(), kind)
        elif not self._is_from_page():
            return
        elif url.path == "/hello":
            told = shown_table(self.server.hello)
            self._json({**told, **offered(told), "signals": signals_of(told)})
        elif url.path == "/stream":
            self._follow(url.query, self.server.streams, "text/event-stream", self._send_stream)
        elif url.path == "/ticks.csv":
            self._follow(url.query, self.server.recordings, "text/csv; charset=utf-8", self._send_ticks)
        else:
            self._json({"error": "there is no such page"}, HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        """Buttons."""
        body = self._body()  # read in any case: what is left unread would be taken for the next request
        path = urlsplit(self.path).path
        if body is None or not self._is_ours(path) or not self._is_from_page():
            return
        name = path.removeprefix("/do/")
        if name not in ACTIONS:  # asked before the key: a page that is old learns why
            self._json({"error": "there is no such button"}, HTTPStatus.NOT_FOUND)
        elif name != "stop" and not self._has_key():
            why = "this needs the operator key: open the address the terminal shows"
            self._json({"error": why}, HTTPStatus.FORBIDDEN)
        else:
            with self.server.guests.served(self.connection):
                self._press(name, body)

    def _body(self) -> bytes | None:
        """The request's body; None when it is refused for its length."""
        length = self.headers.get("Content-Length", "0")
        # its own length first: Python refuses to read a number of more than 4300 digits
        if length.isdecimal() and len(length) <= MOST_DIGITS and int(length) <= MOST_BODY:
            return self.rfile.read(int(length))
        self.close_connection = True
        self._json({"error": "the request is too long"}, HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
        return None

    def _has_key(self) -> bool:
        given = self.headers.get("X-Operator-Key", "")
        # its time tells nothing of how much was right; bytes: of text it takes ASCII alone
        return secrets.compare_digest(given.encode(), self.server.key.encode())

    def _press(self, name: str, body: bytes) -> None:
        try:
            # a stop is never refused, whatever was sent with it
            values = {} if name == "stop" else _values(body)
            result = ACTIONS[name](self.server.client, self.server.world, values)
        except (ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
            self._json({"error": f"not understood: {error}"}, HTTPStatus.BAD_REQUEST)
        except RefusedError as error:
            self._json({"error": error.reason, "code": error.code}, HTTPStatus.CONFLICT)
        except RtctlError as error:
            self._json({"error": str(error)}, HTTPStatus.CONFLICT)
        else:
            self._json({"ok": True, "result": result})

    def _is_ours(self, path: str) -> bool:
        """Refuse requests made for another name, or by another page: one of another port of this machine is
        another."""
        origin = self.headers.get("Origin")
        by = self.headers.get("Sec-Fetch-Site", "none")
        opened = path in PAGES and self.headers.get("Sec-Fetch-Dest") == "document"  # a link to the page
        if (
            self.headers.get("Host") in self.server.names
            and (origin is None or origin.removeprefix("http://") in self.server.names)
            and (by in ("same-origin", "none") or opened)
        ):
            return True
        self._json({"error": "asked for by another name or page"}, HTTPStatus.FORBIDDEN)
        return False

    def _is_from_page(self) -> bool:
        """Refuse what does not come from a script of the page: browsers send this header for nobody else."""
        if self.headers.get("X-Rtctl") == "view":
            return True
        self._json({"error": "the header X-Rtctl is missing"}, HTTPStatus.FORBIDDEN)
        return False

    def _json(self, body: Mapping[str, Any], code: HTTPStatus = HTTPStatus.OK) -> None:
        self._answer(code, json.dumps(body).encode(), "application/json")

    def _head(self, code: HTTPStatus, kind: str) -> None:
        self.send_response(code)
        for name, value in HEADERS.items():
            self.send_header(name, value)
        self.send_header("Content-Type", kind)

    def _answer(self, code: HTTPStatus, body: bytes, kind: str) -> None:
        self._head(code, kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def _follow(
        self,
        query: str,
        places: threading.BoundedSemaphore,
        kind: str,
        send: Callable[[Follower, list[Signal]], None],
    ) -> None:
        """Send what comes from now on, until the browser or the server ends."""
        try:
            asked = parse_qs(query).get("signals", [""])[0]
            signals = [Signal.parse(text) for text in asked.split(",") if text]  # a stranger's text
            if len(signals) > MOST_SIGNALS:
                raise ValueError(f"at most {MOST_SIGNALS} signals")
        except ValueError as error:
            self._json({"error": str(error)}, HTTPStatus.BAD_REQUEST)
            return
        if not places.acquire(blocking=False):
            why = "as many pages look (or record) already as may: close one"
            self._json({"error": why}, HTTPStatus.SERVICE_UNAVAILABLE)
            return
        follower = self.server.feed.follow()  # from here on nothing is missed
        self.close_connection = True
        try:
            self._head(HTTPStatus.OK, kind)
            self.send_header("Connection", "close")
            self.end_headers()
            with self.server.guests.served(self.connection):
                send(follower, signals)
        except (ConnectionError, TimeoutError):
            pass  # the browser is gone
        finally:
            self.server.feed.leave(follower)
            places.release()  # whatever ended it

    def _send_stream(self, follower: Follower, signals: list[Signal]) -> None:
        """Server-sent events: `ticks` thinned for a screen, `event`, `status`."""
        told, motion = -1.0, of_axes(self.server.hello["axes"])
        while not self.server.closing.wait(MESSAGE_S):
            rows, events = follower.take()
            if rows is not None:
                self._event("ticks", columns(rows, signals))
            for event in events:
                self._event("event", shown_table({**event, "sentence": line_of(event)}))
            if time.monotonic() - told >= STATUS_S:
                told = time.monotonic()
                self._event("status", shown_table(status(self.server.feed, self.server.world, motion)))
            self.wfile.flush()

    def _send_ticks(self, follower: Follower, signals: list[Signal]) -> None:
        """CSV: every tick."""
        self.wfile.write(view_record.head(signals, shown_table(self.server.hello)).encode())
        while not self.server.closing.wait(MESSAGE_S):
            rows, _events = follower.take()
            if rows is not None:
                self.wfile.write(view_record.body(rows, signals).encode())
            self.wfile.flush()

    def _event(self, name: str, data: Mapping[str, Any]) -> None:
        self.wfile.write(f"event: {name}\ndata: {json.dumps(data)}\n\n".encode())


def _values(body: bytes) -> dict[str, Any]:
    # else NaN and Infinity would be numbers
    values = json.loads(body or b"{}", parse_constant=_refuse)
    if not isinstance(values, dict):
        raise TypeError("a button sends an object")
    return values


def _refuse(text: str) -> float:
    raise ValueError(f"{text} is not a number")
