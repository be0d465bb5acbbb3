"""Who is logged in, and for how long silence is tolerated (docs/reference/epson.md 1.1)."""

from typing import Protocol

from robolink.timing import NS_PER_S
from robolink_simulators.device.wire_time import WireTime


class Client(Protocol):
    """A connection that may log in."""

    def cut(self) -> None:
        """End the connection from the controller's side."""


class ClientSlot:
    """The one place for a logged-in client, watched by the remote time-out.

    When a client vanishes without a logout while something runs, its silence goes on being
    counted: that a finite time-out also ends what runs is inferred (docs/reference/epson.md 1.7).

    Args:
        remote_timeout_s: Longest silence; 0 for any.
        wire_time: By which it is counted.
    """

    __slots__ = (
        "_heard_ns",
        "_timeout_ns",
        "_wire_time",
        "client",
    )

    def __init__(self, remote_timeout_s: float, wire_time: WireTime) -> None:
        self._timeout_ns = round(remote_timeout_s * NS_PER_S)
        self._wire_time = wire_time
        self._heard_ns: int | None = None
        self.client: Client | None = None

    def admit(self, client: Client, now_ns: int) -> None:
        """Log a client in."""
        self.client = client
        self.heard(now_ns)

    def hears(self, link: Client, *, cuts: bool) -> bool:
        """Tell whether a connection is listened to; whoever comes second may be cut off."""
        if self.client in (None, link):
            return True
        if cuts:
            link.cut()
        return False

    def heard(self, now_ns: int) -> None:
        """The client sent a request."""
        self._heard_ns = self._wire_time.at(now_ns)

    def free(self) -> None:
        """The client logged out."""
        self.client = self._heard_ns = None

    def lost(self, *, unfinished: bool) -> None:
        """The client is gone; keep counting its silence while something is unfinished."""
        self.client = None
        self.settle(unfinished=unfinished)

    def settle(self, *, unfinished: bool) -> None:
        """Forget the silence of a client that is gone once nothing of its is unfinished."""
        if self.client is None and not unfinished:
            self._heard_ns = None

    def deadline(self, *, unfinished: bool) -> int | None:
        """Return when the silence will have lasted too long, if it is counted."""
        counted = self.client is not None or unfinished
        if self._heard_ns is None or not self._timeout_ns or not counted:
            return None
        return self._wire_time.simulated_at(self._heard_ns + self._timeout_ns)

    def overdue(self, now_ns: int, *, unfinished: bool) -> tuple[bool, Client | None]:
        """Return whether the silence has lasted too long, and whose it was; its place is free."""
        self.settle(unfinished=unfinished)
        deadline = self.deadline(unfinished=unfinished)
        if deadline is None or now_ns < deadline:
            return False, None
        client = self.client
        self.free()
        return True, client
