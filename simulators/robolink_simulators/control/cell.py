"""One simulated controller, with everything that acts on it outside the wire."""

import hmac
import secrets
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from robolink_simulators.cell.clock import ManualClock, ScaledClock
from robolink_simulators.device.hosted import KeptMoment
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import LinkKind
from robolink_simulators.plc import PlcSimulator
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

_TOKEN_BYTES: Final = 16


def drawn_token() -> str:
    """Return an unguessable token: 128 bits, in characters that are legal in a URL."""
    return secrets.token_urlsafe(_TOKEN_BYTES)


def is_token(shown: object, token: str) -> bool:
    """Whether ``shown`` is the token; a near miss takes as long as any other."""
    return isinstance(shown, str) and hmac.compare_digest(
        shown.encode("utf-8", "surrogatepass"), token.encode()
    )


AnySimulator = EpsonSimulator | SoftMotionSimulator | PlcSimulator
"""A simulated controller of any kind."""

_NOT_SERVED: Final = {
    "epson": (LinkKind.EPSON_SIM,),
    "softmotion": (LinkKind.MAILBOX_SIM,),
    "plc": (LinkKind.PLC_TCP,),
}
"""Link kinds of a cell whose host has given no URL."""


@dataclass(slots=True)
class ControlledCell:
    """A simulator that is served, or lives in this process.

    Attributes:
        simulator: The controller and its world.
        clock: Its time; ``None`` where nobody but its host knows it.
        urls: Where clients of the controller connect to, by link.
        moments: The snapshots that were taken, by name.
    """

    simulator: AnySimulator
    clock: ScaledClock | ManualClock | None = None
    urls: Mapping[str, str] = field(default_factory=dict)
    moments: dict[str, KeptMoment] = field(default_factory=dict)

    @property
    def links(self) -> tuple[LinkKind, ...]:
        """The kinds of links that it is served on, at least one."""
        urls = tuple(self.urls.values()) or (self.simulator.url,)
        served = tuple(LinkKind(url.partition("://")[0]) for url in urls if "://" in url)
        return served or _NOT_SERVED[self.simulator.kind]
