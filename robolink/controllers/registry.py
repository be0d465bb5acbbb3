"""From the kind that a URL names to whatever opens controllers of that kind.

Kinds that this package brings stand in a table and are imported when they are named; all others
are found in the entry-point group ``robolink.controllers``, by the full scheme of the URL
(``gantry+tcp``) or by its kind alone (``gantry``). No entry point is looked for where the table
knows the kind: a stop and a look are timed (docs/decisions/0017).
"""

from dataclasses import dataclass
from importlib import import_module
from typing import Final, Protocol, cast

from robolink.errors import ConfigError
from robolink.journal import GlancingLog, open_log
from robolink.messages import tr
from robolink.model import Controller, OutcomeLog, Secret, Signature
from robolink.plug_ins import PlugInError, find_plug_in
from robolink.timing import Clock
from robolink.transport import LinkUrl, TraceSink

CONTROLLERS_GROUP: Final = "robolink.controllers"

_KINDS: Final = {
    "epson": ("robolink.controllers.epson.opening", "open_epson_url"),
    "softmotion": ("robolink.controllers.softmotion.opening", "open_softmotion_url"),
    "plc": ("robolink.controllers.plc_map.opening", "open_plc_map_url"),
}


class OpenLink(Protocol):
    """What has to be known of a link to keep a record of what it leads to."""

    @property
    def identity(self) -> str:
        """How its far end is reached."""

    @property
    def durable(self) -> bool:
        """Whether its far end outlives this process."""

    def close(self) -> None:
        """Close it."""


@dataclass(frozen=True, slots=True)
class ConnectionTerms:
    """On what terms a controller is connected to; see :func:`robolink.connect`.

    Attributes:
        signature: Who works here, and with what.
        password: For a login, where there is one.
        timeout_s: Longest wait for one answer.
        remote_timeout_s: The remote time-out set on an EPSON controller.
        clock: Replaces the machine's clock.
        trace: Told of all traffic, where that can be told.
        outcomes: The record to keep; ``None`` for the journal of this user.
        glance: Whether this is for a look only.
    """

    signature: Signature
    password: Secret | None = None
    timeout_s: float = 3.0
    remote_timeout_s: float = 60.0
    clock: Clock | None = None
    trace: TraceSink | None = None
    outcomes: OutcomeLog | None = None
    glance: bool = False

    def record_of(self, link: OpenLink) -> OutcomeLog:
        """Return the record of what a link leads to; the link is closed when that fails."""
        try:
            return self.record_at(link.identity, durable=link.durable)
        except BaseException:
            link.close()
            raise

    def record_at(self, address: str, *, durable: bool = True) -> OutcomeLog:
        """Return the record of what is reached at an address.

        Args:
            address: How it is reached.
            durable: Whether it outlives this process, so that its record must too.
        """
        if self.outcomes is not None:
            return self.outcomes
        if self.glance and durable:
            return GlancingLog(address, signature=self.signature)
        return open_log(address, durable=durable, signature=self.signature)


class ControllerOpener(Protocol):
    """What an entry point of the group provides."""

    def __call__(self, url: LinkUrl, terms: ConnectionTerms, /) -> Controller:
        """Connect to the controller that ``url`` names.

        Raises:
            ConfigError: The URL or the terms make no sense for this kind.
            ConnectError: Nobody is reached.
        """


def find_opener(url: LinkUrl) -> ControllerOpener:
    """Return what opens controllers of the kind that a URL names.

    Raises:
        ConfigError: Nothing knows the kind, or what does cannot be loaded.
    """
    if url.kind in _KINDS:
        module, name = _KINDS[url.kind]
        return cast(ControllerOpener, getattr(import_module(module), name))
    for name in (url.scheme, url.kind):
        try:
            found = find_plug_in(CONTROLLERS_GROUP, name)
        except PlugInError as error:
            raise ConfigError(
                tr("What connects to {kind!r} cannot be loaded: {cause}.", kind=name, cause=error),
                remedy=tr("Install the package that brings it again."),
            ) from error.origin
        if found is not None:
            return cast(ControllerOpener, found)
    raise ConfigError(
        tr("robolink does not know controllers of the kind {kind!r}.", kind=url.kind),
        remedy=tr("Write for example epson+tcp://192.168.0.1:5000."),
    )
