"""A tablet's WebSocket: each frame is asked who sends it, and the line ends with its reason."""

import asyncio
import json
from collections.abc import Awaitable, Callable, Iterator, MutableMapping
from contextlib import contextmanager, suppress
from typing import Any, Final

from robolink.messages import tr
from robolink_cli.panel.guard.access import (
    COMMANDS_A_SECOND,
    FRAMES_A_SECOND,
    Access,
    Visit,
)
from robolink_cli.panel.guard.requests import MOST_BYTES, parsed

Message = MutableMapping[str, Any]

CHANGED: Final = 4001
"""Code of a close: this tablet was paired, logged in or out. It connects again at once."""

REMOVED: Final = 4003
"""Code of a close: this tablet is not paired any more."""

_TAKEN_S: Final = 5.0
_COMMANDS: Final = frozenset({"press", "hold"})
_BEAT: Final = "beat"
ANYTIME: Final = frozenset({"leave", "language", "size", "turn", "reject", "no", "finish"})
"""Actions that neither move nor write: they need the seat, and no young PIN."""


class Live:
    """One WebSocket.

    Args:
        access: Who may do what.
        scope: Of ASGI.
        visit: What the handshake carried.
        cell: Which cell it is about; empty for all.
        receive, send: Of ASGI.
    """

    def __init__(
        self,
        access: Access,
        scope: MutableMapping[str, Any],
        visit: Visit,
        cell: str,
        receive: Callable[[], Awaitable[Message]],
        send: Callable[[Message], Awaitable[None]],
    ) -> None:
        self._access, self._scope, self.visit, self.cell = access, scope, visit, cell
        self._receive, self._send = receive, send
        self._one_at_a_time = asyncio.Lock()
        self._closed = False

    async def heard(self) -> Message:
        """Return the next message that may pass."""
        while True:
            message = await self._receive()
            if message["type"] != "websocket.receive":
                return message
            text = message.get("text")
            frame = parsed(text) if text is not None and len(text) <= MOST_BYTES else None
            if frame is None:
                await self.close(1008)
                continue
            kind = frame.get("t")
            if not self._access.is_paired(self.visit.tablet):
                await self.close(REMOVED)
                continue
            if kind == "stop":
                return message
            if self._access.too_often(self.visit, "frames", FRAMES_A_SECOND):
                continue
            if kind == "pong" or kind == "release":  # ending is always allowed
                return message
            why = self._why_not(frame)
            if not why:
                return message
            if kind != _BEAT:
                said = {"t": "refused", "press": str(frame.get("press", ""))[:100], "why": why}
                with suppress(OSError):
                    await self.tell({"type": "websocket.send", "text": json.dumps(said)})

    def _why_not(self, frame: dict[str, Any]) -> str:
        access, kind = self._access, frame.get("t")
        if not isinstance(kind, str) or (kind not in _COMMANDS and kind != _BEAT):
            return tr("There is no such command.")
        if kind in _COMMANDS and access.too_often(self.visit, "commands", COMMANDS_A_SECOND):
            return tr("Too many commands. Nothing was done.")
        tablet = access.tablet_of(self._scope)
        action = frame.get("action")
        # A PIN that grows old under a finger ends no movement: it is asked for at the next press.
        young = kind in _COMMANDS and not (isinstance(action, str) and action in ANYTIME)
        if why := access.why_not(tablet, self.cell, young=young):
            return why
        if not access.seats.has(self.cell, tablet.id):
            holder = access.seats.taken_by(self.cell, tablet.id)
            return holder.sentence if holder else tr("Take the seat of this cell first.")
        return ""

    async def tell(self, message: Message) -> None:
        """Send a message, in time; a far end that takes nothing is cut off.

        Raises:
            OSError: It is closed.
        """
        if message["type"] == "websocket.accept" and self.visit.fresh:
            cookie = self._access.cookie("tablet", self.visit.secret).encode()
            headers = [*message.get("headers", ()), (b"set-cookie", cookie)]
            message = {**message, "headers": headers}
        async with self._one_at_a_time:
            if self._closed:
                raise OSError("closed")
            if message["type"] == "websocket.send" and not self._access.is_paired(
                self.visit.tablet
            ):
                message = {"type": "websocket.close", "code": REMOVED}
            self._closed = message["type"] == "websocket.close"
            try:
                async with asyncio.timeout(_TAKEN_S):
                    await self._send(message)
            except TimeoutError:
                self._closed = True
                self._access.connections.cut(self.visit.peer)
                raise OSError("takes nothing") from None

    async def close(self, code: int) -> None:
        """End it from here."""
        with suppress(OSError, RuntimeError):
            await self.tell({"type": "websocket.close", "code": code})


class Lives:
    """All WebSockets, by their tablets."""

    def __init__(self) -> None:
        self._open: dict[str, list[Live]] = {}

    @contextmanager
    def open(self, live: Live) -> Iterator[None]:
        """Keep one for the block."""
        same = self._open.setdefault(live.visit.tablet, [])
        same.append(live)
        try:
            yield
        finally:
            same.remove(live)
            if not same:
                del self._open[live.visit.tablet]

    async def end(self, tablet: str) -> None:
        """End those of a tablet, so that they come again with its present cookies."""
        for live in tuple(self._open.get(tablet, ())):
            await live.close(CHANGED)
