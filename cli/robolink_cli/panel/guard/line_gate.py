"""The gate for line computers: ``/jobs`` takes no page, tablet or person, but a token.

A browser has no business here. It says who it is by ``Origin`` or ``Sec-Fetch-Site``, and no page
can send a token past it without asking first, which nobody answers.
"""

from collections.abc import Awaitable, Callable, Mapping
from typing import Any, Final, Protocol
from urllib.parse import unquote

from robolink.messages import tr
from robolink_cli.panel.guard.access import Access, is_loopback
from robolink_cli.panel.guard.line_tokens import LineToken, LineTokens
from robolink_cli.panel.guard.requests import Denial, PageRequest, parsed

JOBS: Final = "/jobs"
JOBS_A_SECOND: Final = 20.0
"""Requests with one token."""

STRANGE_A_SECOND: Final = 5.0
"""Requests of one address without a token that counts."""

_MOST_ORDER: Final = 64
_BEARER: Final = ("www-authenticate", 'Bearer realm="robolink"')

Body = Callable[[], Awaitable[tuple[bytes, Denial | None]]]
Reply = Callable[[int, Mapping[str, object], tuple[tuple[str, str], ...]], Awaitable[None]]


class Answered(Protocol):
    """An answer to a line computer."""

    @property
    def status(self) -> int:
        """Of HTTP."""

    @property
    def document(self) -> Mapping[str, object]:
        """The body."""

    @property
    def headers(self) -> tuple[tuple[str, str], ...]:
        """Further headers."""


class Orders(Protocol):
    """Takes what line computers order."""

    async def post(self, token: LineToken, said: Mapping[str, object]) -> Answered:
        """Take a job."""

    async def look(self, token: LineToken, order: str) -> Answered:
        """Tell how a job stands."""


def is_of_lines(request: PageRequest) -> bool:
    """Return whether a request is for line computers."""
    return not request.live and (request.path == JOBS or request.path.startswith(f"{JOBS}/"))


class LineGate:
    """Lets line computers with a token order jobs.

    Args:
        access: The panel's names, rates and record.
        orders: Takes what they order; ``None`` where nobody does.
        tokens: The tokens of this computer.
    """

    def __init__(self, access: Access, orders: Orders | None, tokens: LineTokens) -> None:
        self._access, self._orders, self._tokens = access, orders, tokens

    async def answer(self, request: PageRequest, body: Body, reply: Reply) -> None:
        """Answer a request.

        Args:
            request: Its head.
            body: Reads its body: a short one, in time.
            reply: Sends the answer: status, document, headers.
        """
        found = self._known(request)
        if isinstance(found, Denial):
            await self._refused(found, request, reply)
            return
        assert self._orders is not None  # noqa: S101 - of a known one
        if request.method == "GET":
            answered = await self._orders.look(found, _order_of(request))
            await reply(answered.status, answered.document, answered.headers)
            return
        data, refusal = await body()
        said = parsed(data) if refusal is None else None
        if refusal is None and said is None:
            refusal = Denial(400, tr("The body is no JSON object."), "form")
        if refusal is not None or said is None:
            assert refusal is not None  # noqa: S101 - just above
            await self._refused(refusal, request, reply, found)
            return
        answered = await self._orders.post(found, said)
        if answered.status == 403:
            self._on_record("scope", request, found)
        await reply(answered.status, answered.document, answered.headers)

    def _known(self, request: PageRequest) -> LineToken | Denial:
        """Return whose request it is, or why it is refused, by its head alone."""
        access, scope = self._access, request.scope
        address, port = scope.get("client") or ("", 0)
        if refusal := request.misaddressed(access.hosts, access.port):
            return refusal
        if request.all(b"origin") or request.all(b"sec-fetch-site"):
            return Denial(403, tr("Only a line computer may do that, and no page."), "origin")
        if request.scheme != "https" and not is_loopback(address):
            return Denial(403, tr("A token goes over TLS only."), "tls")
        token = self._token(request)
        if isinstance(token, Denial):
            if access.too_often_of(f"lines {address}", STRANGE_A_SECOND):
                return Denial(429, tr("Too many requests without a token."), "rate", 1.0)
            return token
        if access.too_often_of(f"line {token.name}", JOBS_A_SECOND):
            return Denial(429, tr("Too many commands. Nothing was done."), "rate", 1.0)
        if self._orders is None:
            return Denial(404, tr("There is no such page."), "path")
        if not access.connections.let_line_in((address, port)):
            why = tr("Too many connections of line computers are open.")
            return Denial(503, why, "connections", 1.0)
        return self._of_form(request) or token

    def _token(self, request: PageRequest) -> LineToken | Denial:
        kind, _, secret = (request.one(b"authorization") or "").partition(" ")
        token = self._tokens.of(secret.strip()) if kind.lower() == "bearer" else None
        if token is None:
            return Denial(401, tr("This takes a token: Authorization: Bearer TOKEN"), "token")
        if token.ended():
            return Denial(401, tr("This token has ended."), "token")
        return token

    def _of_form(self, request: PageRequest) -> Denial | None:
        """Refuse what no job can come of, whatever its body."""
        if request.scope["query_string"]:
            return Denial(400, tr("There are no parameters here."), "form")
        if request.method == "GET" and request.path != JOBS:
            return None
        if request.path != JOBS:
            return Denial(405, tr("There is no such page."), "method")
        if request.method != "POST":
            return Denial(405, tr("A job is posted."), "method")
        kind = (request.one(b"content-type") or "").partition(";")[0].strip().lower()
        if kind != "application/json":
            return Denial(415, tr("A job is JSON: Content-Type: application/json"), "form")
        return None

    async def _refused(
        self, refusal: Denial, request: PageRequest, reply: Reply, token: LineToken | None = None
    ) -> None:
        self._on_record(refusal.kind, request, token)
        headers: list[tuple[str, str]] = []
        if refusal.status == 401:
            headers.append(_BEARER)
        if refusal.status == 405:
            headers.append(("allow", "POST" if request.path == JOBS else "GET"))
        if refusal.wait_s:
            headers.append(("retry-after", str(int(refusal.wait_s) + 1)))
        await reply(refusal.status, {"why": refusal.why}, tuple(headers))

    def _on_record(self, why: str, request: PageRequest, token: LineToken | None) -> None:
        address, _ = request.scope.get("client") or ("", 0)
        facts: dict[str, Any] = {"address": address, "path": request.path[:100]}
        if token is not None:
            facts["line"] = token.name
        self._access.audit.note("refused", "", why=why, **facts)


def _order_of(request: PageRequest) -> str:
    """Return the order that the address names. An order may hold what a path else may not."""
    raw: bytes = request.scope.get("raw_path") or request.path.encode()
    order = unquote(raw.decode("latin-1").partition("?")[0][len(JOBS) + 1 :])
    return order[: _MOST_ORDER + 1]
