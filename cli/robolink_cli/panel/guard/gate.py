"""The gate: an ASGI application around the panel, which every request and every frame passes."""

import asyncio
import json
import re
from collections.abc import Awaitable, Callable, Mapping, MutableMapping
from dataclasses import dataclass
from enum import Enum, auto
from functools import partial
from hmac import compare_digest
from http import HTTPStatus
from typing import Any, Final
from urllib.parse import parse_qs

from robolink.messages import tr
from robolink.model import PersonRole
from robolink_cli.panel.guard.access import COMMANDS_A_SECOND, Access, Visit
from robolink_cli.panel.guard.line_gate import LineGate, Orders, is_of_lines
from robolink_cli.panel.guard.line_tokens import LineTokens
from robolink_cli.panel.guard.live import Live, Lives
from robolink_cli.panel.guard.pairing import tablet_id
from robolink_cli.panel.guard.requests import MOST_BYTES, Denial, PageRequest, parsed

Message = MutableMapping[str, Any]
Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

BODY_S: Final = 5.0
"""Longest time in which a body has to come, in seconds."""

TAKEN_S: Final = 10.0
"""Longest time in which a part of an answer has to be taken, in seconds."""

_MOST_TYPED: Final = 200

CONTENT_SECURITY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
    "frame-ancestors 'none'; base-uri 'none'; form-action 'self'"
)
REPORT_SECURITY: Final = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'none'; "
    "base-uri 'none'; form-action 'none'"
)
"""Of a report, one page to keep and print: it has its styles in it, and no script may run."""

_REPORT: Final = re.compile(r"/cell/[^/]+/report/[^/]+")
_HEADERS: Final = {
    b"content-security-policy": CONTENT_SECURITY.encode(),
    b"x-content-type-options": b"nosniff",
    b"x-frame-options": b"DENY",
    b"cache-control": b"no-store",
    b"referrer-policy": b"no-referrer",
    b"cross-origin-opener-policy": b"same-origin",
    b"cross-origin-resource-policy": b"same-origin",
    b"permissions-policy": b"camera=(), microphone=(), geolocation=(), usb=(), serial=()",
}
_NEVER: Final = (b"access-control-", b"server")


class Right(Enum):
    """What a request needs besides a page of ours."""

    STOP = auto()
    """A paired tablet; on loopback nothing."""
    PIN = auto()
    """The right PIN, which it brings."""
    TOKEN = auto()
    """A paired tablet and the token of its page."""
    PERSON = auto()
    """Also a person of the cell who is logged in."""
    ENGINEER = auto()
    """Also an engineer of some cell, with a PIN of the last 15 minutes."""
    COMMAND = auto()
    """Also the seat of the cell, and a PIN of the last 15 minutes."""


POSTS: Final = {
    "/stop": Right.STOP,
    "/stop-all": Right.STOP,
    "/pair": Right.PIN,
    "/login": Right.PIN,
    "/logout": Right.TOKEN,
    "/tablet": Right.TOKEN,
    "/seat": Right.PERSON,
    "/seat/leave": Right.TOKEN,
    "/start": Right.COMMAND,
    "/plan/halt": Right.ENGINEER,
    "/plan/resume": Right.ENGINEER,
}
"""All that can be posted; what is not here there is not."""

LIVE: Final = "/live"
PAIRING: Final = "/pair"
_BEFORE_PAIRING: Final = ("/pair", "/static/")
"""What a tablet sees before it is paired."""


def guarded(app: App, access: Access, orders: Orders | None = None) -> App:
    """Return the panel with its gate.

    Args:
        app: The panel.
        access: Who may do what.
        orders: Takes what line computers order; ``None`` where nobody does.
    """
    return _Gate(app, access, orders)


class _Gate:
    def __init__(self, app: App, access: Access, orders: Orders | None) -> None:
        self._app, self._access = app, access
        self._lives = Lives()
        self._lines = LineGate(access, orders, LineTokens())

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        request = PageRequest(scope)
        if is_of_lines(request):
            body = partial(_body, request, receive)
            await self._lines.answer(request, body, partial(_line_answer, send))
            return
        visit = self._access.visit(request)
        with self._access.speaking(visit.tablet):
            if request.live:
                await self._live(request, visit, receive, send)
            else:
                await self._http(
                    request, visit, receive, _Answer(self._access, request, visit, send)
                )

    async def _http(
        self, request: PageRequest, visit: Visit, receive: Receive, answer: "_Answer"
    ) -> None:
        access = self._access
        refusal = request.misdirected(access.hosts, access.port)
        if refusal is None and request.method in ("GET", "HEAD"):
            refusal = request.foreign_look()
            if refusal is None and not access.is_paired(visit.tablet):
                if not request.path.startswith(_BEFORE_PAIRING):
                    await answer.onward(PAIRING)
                    return
            elif refusal is None:
                refusal = self._place(visit)
            if refusal is None:
                await self._app(request.scope, receive, answer)
                return
        elif refusal is None and request.method != "POST":
            refusal = Denial(405, tr("There is no such page."), "method")
        if refusal is not None:
            await self._refused(refusal, request, visit, answer)
            return
        await self._post(request, visit, receive, answer)

    async def _post(
        self, request: PageRequest, visit: Visit, receive: Receive, answer: "_Answer"
    ) -> None:
        need = POSTS.get(request.path)
        body, refusal = b"", self._head_of_post(request, visit, need)
        if refusal is None:
            body, refusal = await _body(request, receive)
        document = parsed(body) if refusal is None else None
        if refusal is None and document is None:
            refusal = Denial(400, tr("The panel does not understand this message."), "form")
        if refusal is None and document is not None and need in (Right.PERSON, Right.COMMAND):
            refusal = self._command(request, document.get("cell"), need)
        if refusal is not None or document is None:
            assert refusal is not None  # noqa: S101 - just above
            await self._refused(refusal, request, visit, answer)
        elif request.path in ("/pair", "/login"):
            await self._with_pin(request, visit, document, answer)
        elif request.path == "/logout":
            await self._log_out(visit, answer)
        else:
            await self._app(request.scope, _replayed(body, receive), answer)

    def _head_of_post(
        self, request: PageRequest, visit: Visit, need: Right | None
    ) -> Denial | None:
        """Refuse by what stands before the body."""
        access = self._access
        if need is None:
            return Denial(404, tr("There is no such page."), "path")
        # The browsers that do not say Sec-Fetch-Site must be able to stop all the same.
        if refusal := request.foreign(strict=need is not Right.STOP):
            return refusal
        kind = (request.one(b"content-type") or "").partition(";")[0].strip().lower()
        if kind != "application/json" or request.scope["query_string"]:
            return Denial(415, tr("The panel does not understand this message."), "form")
        paired = access.is_paired(visit.tablet)
        if paired and (refusal := self._place(visit)):
            return refusal
        if need is Right.STOP:
            return None if paired else _unpaired()
        if access.too_often(visit, "commands", COMMANDS_A_SECOND):
            return Denial(429, tr("Too many commands. Nothing was done."), "rate", 1.0)
        if need is Right.PIN:
            return None if paired or request.path == PAIRING else _unpaired()
        if not paired:
            return _unpaired()
        token = access.token_of(request.scope)
        if not _same(request.one(b"x-robolink-token"), token):
            return Denial(403, tr("This page is out of date. Load it again."), "token")
        if need is Right.ENGINEER:
            why = access.why_no_engineer(access.tablet_of(request.scope))
            return Denial(403, why, "person") if why else None
        return None

    def _command(self, request: PageRequest, cell: object, need: Right) -> Denial | None:
        access = self._access
        if not isinstance(cell, str):
            return Denial(400, tr("The panel does not understand this message."), "form")
        tablet = access.tablet_of(request.scope)
        if why := access.why_not(tablet, cell, young=need is Right.COMMAND):
            return Denial(403, why, "person")
        if need is Right.COMMAND and not access.seats.has(cell, tablet.id):
            return Denial(409, tr("Take the seat of this cell first."), "seat")
        return None

    # ---- Logging in

    async def _with_pin(
        self, request: PageRequest, visit: Visit, document: dict[str, Any], answer: "_Answer"
    ) -> None:
        """Pair a tablet, or log a person in."""
        access, pairs = self._access, request.path == PAIRING
        who, pin = document.get("name"), document.get("pin")
        if not (isinstance(who, str) and isinstance(pin, str)) or len(who + pin) > _MOST_TYPED:
            refusal: Denial | None = Denial(
                400, tr("The panel does not understand this message."), "form"
            )
        else:
            refusal = await access.prove(who, pin, visit)
        if refusal is not None:
            await self._refused(refusal, request, visit, answer, who=who)
            return
        assert isinstance(who, str)  # noqa: S101 - refused above
        role = access.highest_role(who)
        if pairs and role is not PersonRole.ENGINEER:
            why = tr("Pairing a tablet takes an engineer.")
            await self._refused(Denial(403, why, "role"), request, visit, answer, who=who)
            return
        tablet, facts = visit.tablet, {"who": who, "address": visit.address}
        cookies = []
        if pairs:
            try:
                secret = access.tablets.pair(who, visit.address)
            except OSError:
                why = tr("The panel's computer cannot store that this tablet is paired.")
                await self._refused(Denial(503, why, "disk"), request, visit, answer, who=who)
                return
            tablet = tablet_id(secret)
            cookies.append(access.cookie("tablet", secret))
            access.audit.note("paired", "", tablet=tablet[:12], **facts)
        else:
            cookies.append(access.cookie("login", access.logins.begin(tablet, who, str(role))))
            access.audit.note("login", "", tablet=tablet[:12], role=str(role), **facts)
        await answer.document(200, {"ok": True}, *cookies)
        await self._lives.end(visit.tablet)

    async def _log_out(self, visit: Visit, answer: "_Answer") -> None:
        access = self._access
        if access.logins.end(visit.tablet):
            cells = access.seats.leave_all(visit.tablet)
            access.audit.note("logout", "", tablet=visit.tablet[:12], seats=list(cells))
        await answer.document(200, {"ok": True}, access.cookie("login", ""))
        await self._lives.end(visit.tablet)

    # ---- Live

    async def _live(self, request: PageRequest, visit: Visit, receive: Receive, send: Send) -> None:
        access = self._access
        refusal = request.misdirected(access.hosts, access.port) or request.foreign(strict=False)
        if refusal is None and request.path != LIVE:
            refusal = Denial(404, tr("There is no such page."), "path")
        if refusal is None and not access.is_paired(visit.tablet):
            refusal = _unpaired()
        refusal = refusal or self._place(visit)
        if refusal is not None:
            self._on_record(refusal, request, visit)
            await receive()
            await send({"type": "websocket.close", "code": 1008})
            return
        asked = parse_qs(request.scope["query_string"].decode("latin-1"))
        cell = asked.get("cell", [""])[-1]
        live = Live(access, request.scope, visit, cell, receive, send)
        with self._lives.open(live):
            await self._app(request.scope, live.heard, live.tell)

    # ---- Refusing

    def _place(self, visit: Visit) -> Denial | None:
        if self._access.connections.let_in(visit.peer, visit.tablet):
            return None
        why = tr("Too many pages of this panel are open. Close one.")
        return Denial(503, why, "connections", 1.0)

    async def _refused(
        self,
        refusal: Denial,
        request: PageRequest,
        visit: Visit,
        answer: "_Answer",
        who: object = None,
    ) -> None:
        self._on_record(refusal, request, visit, who)
        await answer.refusal(refusal)

    def _on_record(
        self, refusal: Denial, request: PageRequest, visit: Visit, who: object = None
    ) -> None:
        facts: dict[str, object] = {"address": visit.address, "path": request.path[:100]}
        if isinstance(who, str):
            facts["typed_name"] = who[:100]  # of whom nobody knows whether it is true
        self._access.audit.note("refused", "", why=refusal.kind, **facts)


@dataclass(slots=True)
class _Answer:
    """What goes out: with the headers of every answer, in time, and nothing after a cut."""

    access: Access
    request: PageRequest
    visit: Visit
    send: Send

    async def __call__(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": self._headers(message.get("headers", ()))}
        try:
            async with asyncio.timeout(TAKEN_S):
                await self.send(message)
        except TimeoutError:
            self.access.connections.cut(self.visit.peer)
            raise

    async def document(self, status: int, said: dict[str, object], *cookies: str) -> None:
        """Answer with JSON."""
        await self._whole(status, json.dumps(said).encode(), b"application/json", cookies)

    async def refusal(self, refusal: Denial) -> None:
        """Answer with a refusal: JSON for a script, text for a page."""
        wait = (("retry-after", str(int(refusal.wait_s) + 1)),) if refusal.wait_s else ()
        if self.request.method == "POST":
            data, kind = json.dumps({"why": refusal.why}).encode(), b"application/json"
        else:
            data, kind = refusal.why.encode(), b"text/plain; charset=utf-8"
        await self._whole(refusal.status, data, kind, (), wait)

    async def onward(self, path: str) -> None:
        """Send a browser to another page."""
        await self._whole(
            HTTPStatus.SEE_OTHER, b"", b"text/plain; charset=utf-8", (), (("location", path),)
        )

    async def _whole(
        self,
        status: int,
        data: bytes,
        kind: bytes,
        cookies: tuple[str, ...],
        more: tuple[tuple[str, str], ...] = (),
    ) -> None:
        headers = [
            (b"content-type", kind),
            (b"content-length", str(len(data)).encode()),
            *((name.encode(), value.encode()) for name, value in more),
        ]
        start = {"type": "http.response.start", "status": int(status), "headers": headers}
        start["headers"] = [
            *self._headers(headers),
            *((b"set-cookie", cookie.encode()) for cookie in cookies),
        ]
        async with asyncio.timeout(TAKEN_S):
            await self.send(start)
            await self.send({"type": "http.response.body", "body": data})

    def _headers(self, given: Any) -> list[tuple[bytes, bytes]]:  # noqa: ANN401 - of ASGI
        kept = [
            (name, value)
            for name, value in given
            if name.lower() not in _HEADERS and not name.lower().startswith(_NEVER)
        ]
        page = self.request.method == "GET" and not self.request.path.startswith("/static/")
        if self.visit.secret and (self.visit.fresh or (page and self.request.keeps_cookies)):
            cookie = self.access.cookie("tablet", self.visit.secret)
            kept.append((b"set-cookie", cookie.encode()))
        headers = dict(_HEADERS)
        if _REPORT.fullmatch(self.request.path):
            headers[b"content-security-policy"] = REPORT_SECURITY.encode()
        return [*kept, *headers.items()]


async def _line_answer(
    send: Send, status: int, document: Mapping[str, object], more: tuple[tuple[str, str], ...]
) -> None:
    """Answer a line computer, and close: it comes again when it has something to order."""
    data = json.dumps(document).encode()
    headers = {
        **_HEADERS,
        b"content-type": b"application/json",
        b"content-length": str(len(data)).encode(),
        b"connection": b"close",
        **{name.lower().encode(): value.encode() for name, value in more},
    }
    async with asyncio.timeout(TAKEN_S):
        await send({"type": "http.response.start", "status": status, "headers": [*headers.items()]})
        await send({"type": "http.response.body", "body": data})


async def _body(request: PageRequest, receive: Receive) -> tuple[bytes, Denial | None]:
    """Read a whole body; a short one, in time."""
    too_long = Denial(413, tr("The message is too long."), "length")
    said = request.all(b"content-length")
    if said and (len(said) > 1 or not said[0].isdigit() or int(said[0]) > MOST_BYTES):
        return b"", too_long
    body = b""
    try:
        async with asyncio.timeout(BODY_S):
            while True:
                message = await receive()
                if message["type"] != "http.request":
                    return b"", Denial(400, tr("The message is not whole."), "form")
                body += message.get("body", b"")
                if len(body) > MOST_BYTES:
                    return b"", too_long
                if not message.get("more_body", False):
                    return body, None
    except TimeoutError:
        return b"", Denial(408, tr("The whole message took too long."), "slow")


def _replayed(body: bytes, receive: Receive) -> Receive:
    """Return the body once more, in one piece."""
    whole: list[Message] = [{"type": "http.request", "body": body, "more_body": False}]

    async def again() -> Message:
        return whole.pop() if whole else await receive()

    return again


def _unpaired() -> Denial:
    return Denial(403, tr("This tablet is not paired with the panel."), "unpaired")


def _same(given: str | None, token: str) -> bool:
    return given is not None and compare_digest(given.encode(), token.encode())
