"""The page and what it asks for: tiles and events as server-sent events, a motor's detail, traces, metrics."""

from __future__ import annotations

import asyncio
import hmac
import json
import socket
import threading
from collections.abc import AsyncIterator
from importlib import resources
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import (
    FileResponse,
    JSONResponse,
    PlainTextResponse,
    RedirectResponse,
    Response,
    StreamingResponse,
)
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ..board import Board
from ..capture import Block
from ..motor import LiveEvent, Motor
from ..tracing import Tracer
from . import prometheus

CSP = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
COOKIE = "dqwatch_token"
MOST_LISTENERS = 64
POLL_S = 0.25
BEAT_S = 10.0
LOOPBACK = ("127.0.0.1", "localhost", "[::1]", "::1")


class Guard:
    """Who may ask: with a token whoever has it; without one whoever calls this machine by its own name."""

    def __init__(self, app: ASGIApp, token: str) -> None:
        self._app = app
        self._token = token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        request = Request(scope)
        refused = self._refused(request)
        if refused is not None:
            await refused(scope, receive, send)
            return

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] += [
                    (b"content-security-policy", CSP.encode()),
                    (b"x-content-type-options", b"nosniff"),
                    (b"referrer-policy", b"no-referrer"),
                    (b"cache-control", b"no-store"),
                ]
            await send(message)

        await self._app(scope, receive, with_headers)

    def _refused(self, request: Request) -> Response | None:
        host = request.headers.get("host", "")
        name = host.rsplit(":", 1)[0] if not host.endswith("]") else host
        if not self._token:
            # Another site's name that leads here would be its page's way in.
            return None if name in LOOPBACK else PlainTextResponse("not by this name\n", 403)
        given = request.query_params.get("token")
        if given is not None and self._is(given):
            answer = RedirectResponse("/", 303)
            answer.set_cookie(COOKIE, given, httponly=True, samesite="strict", path="/")
            return answer
        bearer = request.headers.get("authorization", "").removeprefix("Bearer ")
        if self._is(bearer) or self._is(request.cookies.get(COOKIE, "")):
            return None
        return PlainTextResponse("a token is needed: open /?token=TOKEN once\n", 401)

    def _is(self, given: str) -> bool:
        return hmac.compare_digest(given.encode("utf-8", "replace"), self._token.encode())


def application(board: Board, token: str, tracer: Tracer | None) -> Starlette:
    """The routes."""
    page = resources.files("dqwatch.live") / "page"
    kinds = {"index.html": "text/html", "page.js": "text/javascript", "page.css": "text/css"}
    listeners: list[object] = []

    def asset(name: str) -> Any:
        async def give(_: Request) -> Response:
            return Response((page / name).read_bytes(), media_type=kinds[name])

        return give

    async def stream(request: Request) -> Response:
        if len(listeners) >= MOST_LISTENERS:
            return PlainTextResponse("too many listen\n", 503)
        last = request.headers.get("last-event-id", "")
        since = int(last) if last.isascii() and last.isdigit() and len(last) < 16 else -1
        return StreamingResponse(_told(board, since, listeners), media_type="text/event-stream")

    async def motor(request: Request) -> Response:
        found = board.detail(request.path_params["slug"])
        return PlainTextResponse("no such motor\n", 404) if found is None else JSONResponse(_finite(found))

    async def whole(_: Request) -> Response:
        return JSONResponse(_finite(board.whole()))

    async def trace(request: Request) -> Response:
        # A foreign page cannot send this header without being asked first.
        if request.headers.get("x-dqwatch") != "1":
            return PlainTextResponse("expected the page's own button\n", 403)
        event = board.find_event(request.path_params["event"])
        if event is None or tracer is None or not event.get("capture"):
            return PlainTextResponse("nothing to trace yet\n", 404)
        return JSONResponse({"state": tracer.start(event["id"], event["capture"])})

    async def traced(request: Request) -> Response:
        event = board.find_event(request.path_params["event"])
        if event is None or tracer is None:
            return PlainTextResponse("no such event\n", 404)
        return JSONResponse(tracer.result(event["id"]))

    async def log(request: Request) -> Response:
        event = board.find_event(request.path_params["event"])
        if event is None or tracer is None or not event.get("capture"):
            return PlainTextResponse("no such log\n", 404)
        return FileResponse(tracer.folder / event["capture"], media_type="text/csv", filename=event["capture"])

    async def nothing(_: Request) -> Response:
        return Response(status_code=204)

    async def metrics(_: Request) -> Response:
        return Response(prometheus.metrics(board), media_type="text/plain; version=0.0.4")

    return Starlette(
        routes=[
            Route("/", asset("index.html")),
            Route("/page.js", asset("page.js")),
            Route("/page.css", asset("page.css")),
            Route("/favicon.ico", nothing),
            Route("/api/stream", stream),
            Route("/api/all", whole),
            Route("/api/motor/{slug}", motor),
            Route("/api/event/{event}/trace", trace, methods=["POST"]),
            Route("/api/event/{event}/trace", traced, methods=["GET"]),
            Route("/api/event/{event}/log", log),
            Route("/metrics", metrics),
        ],
        middleware=[Middleware(Guard, token=token)],
    )


async def _told(board: Board, since: int, listeners: list[object]) -> AsyncIterator[str]:
    """Tiles and events newer than ``since``; on a first call, or behind a restart, all."""
    me = object()
    listeners.append(me)
    try:
        number = board.since(0)[0]
        since = since if 0 <= since <= number else 0
        yield "retry: 1000\n\n"
        silent_s = BEAT_S
        while True:
            number, tiles, events = board.since(since)
            if tiles or events or silent_s >= BEAT_S:
                data = {"tiles": tiles, "events": events, **{k: board.whole()[k] for k in ("sources", "health")}}
                yield f"id: {number}\ndata: {json.dumps(_finite(data))}\n\n"
                since, silent_s = number, 0.0
            await asyncio.sleep(POLL_S)
            silent_s += POLL_S
    finally:
        listeners.remove(me)


def _finite(x: Any) -> Any:
    """JSON has no infinity."""
    if isinstance(x, float):
        return x if abs(x) < float("inf") else None
    if isinstance(x, dict):
        return {k: _finite(v) for k, v in x.items()}
    return [_finite(v) for v in x] if isinstance(x, list | tuple) else x


class WebSink:
    """The server, in a thread of its own; it reads the board alone."""

    name = "web"

    def __init__(self, board: Board, host: str, port: int, token: str, folder: Path | None) -> None:
        if host not in LOOPBACK and not token:
            raise ValueError(f"{host} is reached by others: expected --token, or 127.0.0.1")
        self._tracer = Tracer(folder) if folder is not None else None
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self._socket = socket.socket(family, socket.SOCK_STREAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._socket.bind((host, port))
        self._socket.listen(128)
        self.port = int(self._socket.getsockname()[1])
        config = uvicorn.Config(
            application(board, token, self._tracer),
            log_level="critical",
            access_log=False,
            server_header=False,
            lifespan="off",
            timeout_graceful_shutdown=1,
            limit_concurrency=256,
        )
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._server.run, args=([self._socket],), daemon=True)
        self._thread.start()

    def event(self, event: LiveEvent) -> None:
        """The board has it."""

    def tile(self, slug: str, tile: dict[str, Any]) -> None:
        """The board has it."""

    def rows(self, motor: Motor, block: Block, first: int) -> None:
        """Rows are not shown."""

    def keep(self, slug: str) -> None:
        """Nothing of it outlives the program."""

    def step(self, now_s: float) -> None:
        """Nothing is due."""

    def trouble(self) -> str:
        """A server that ended."""
        return "" if self._thread.is_alive() or self._server.should_exit else "the page's server has ended"

    def close(self) -> None:
        """The end of every stream."""
        self._server.should_exit = True
        self._server.force_exit = True
        self._thread.join(3.0)
        if self._tracer is not None:
            self._tracer.close()
