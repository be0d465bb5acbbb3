"""From a URL to a controller."""

from contextlib import suppress
from typing import TYPE_CHECKING

from robolink import __version__
from robolink.errors import ConfigError, JournalError, LoginUnansweredError
from robolink.journal import GlancingLog, open_log, signature_here
from robolink.messages import tr
from robolink.model import Controller, OutcomeLog, Secret, Signature
from robolink.timing import Clock
from robolink.transport import (
    LinkUrl,
    MailboxLink,
    TraceSink,
    TracingTransport,
    Transport,
    open_mailbox_link,
    open_quick_link,
    open_transport,
    parse_url,
)
from robolink.ways import Way, way

if TYPE_CHECKING:
    from robolink.controllers.plc_map import PlcMapController
    from robolink.controllers.softmotion import SoftMotionController

# Drivers are imported where they are used: nobody waits for those of other controllers.


def connect(
    url: str,
    *,
    password: str | Secret | None = None,
    timeout_s: float = 3.0,
    remote_timeout_s: float = 60.0,
    clock: Clock | None = None,
    trace: TraceSink | None = None,
    outcomes: OutcomeLog | None = None,
    signature: Signature | None = None,
    glance: bool = False,
) -> Controller:
    """Connect to a controller; log in where there is a login.

    Args:
        url: For example ``epson+tcp://192.168.0.1:5000``, ``epson+sim://cell-a?seed=1`` or
            ``softmotion+modbus-tcp://192.168.0.2:502`` or
            ``plc+modbus-tcp://192.168.0.2?map=machine.toml``.
        password: An EPSON controller's remote password, if one is set; a PLC has none.
        timeout_s: Longest wait for one answer.
        remote_timeout_s: The remote time-out set on an EPSON controller. It cannot be read
            over the wire; 0 forbids motion. A PLC's watchdog is part of its mailbox program.
        clock: Replaces the machine's clock; a simulator brings its own.
        trace: Called with (time in ns, "sent" or "received", bytes) for all traffic but the
            login frame; of an EPSON controller only.
        outcomes: Where outcomes are recorded; by default the journal of this user, or memory
            for a simulator that dies with this process. A journal that cannot be used keeps
            nobody from looking and stopping: ``outcomes.trouble`` says what is wrong with it,
            and what would change something raises it.
        signature: Who works here, and with what; by default the user of this computer.
        glance: Whether this is for a look, so that a journal in which nothing is unfinished is
            not opened before something has to be recorded. Who the controller says it is is
            not asked then.

    Raises:
        ConfigError: The URL or an option is wrong.
        ConnectError: Nobody is reached, nobody answers the login, or the PLC's mailbox program
            does not run.
        RemoteProtocolError: What answers is no mailbox of this version, or the probe of a
            map differs.
        LoginRefusedError: Wrong or missing password.
        LeaseHeldError: Nobody answers the login, and somebody else has the controller.
    """
    link = parse_url(url)
    record = _Record(signature or signature_here(__version__), glance=glance)
    if link.kind == "softmotion":
        return _connect_softmotion(
            link, timeout_s, clock=clock, trace=trace, outcomes=outcomes, record=record
        )
    if link.kind == "plc":
        return _connect_plc(
            link, timeout_s, clock=clock, trace=trace, outcomes=outcomes, record=record
        )
    if link.kind != "epson":
        raise ConfigError(
            tr("robolink does not know controllers of the kind {kind!r}.", kind=link.kind),
            remedy=tr("Write for example epson+tcp://192.168.0.1:5000."),
        )
    from robolink.controllers.epson import open_epson

    transport = open_transport(link, timeout_s=timeout_s, clock=clock)
    kept = outcomes or record.of(transport)
    try:
        return open_epson(
            transport if trace is None else TracingTransport(transport, trace),
            outcomes=kept,
            password=Secret(password) if isinstance(password, str) else password,
            timeout_s=timeout_s,
            remote_timeout_s=remote_timeout_s,
        )
    except LoginUnansweredError:
        # One client at a time is served (docs/reference/epson.md 1.1). The lease may say who that
        # is, if the journal can be read.
        with suppress(JournalError):
            kept.look()
        raise


def _connect_softmotion(
    url: LinkUrl,
    timeout_s: float,
    *,
    clock: Clock | None,
    trace: TraceSink | None,
    outcomes: OutcomeLog | None,
    record: "_Record",
) -> "SoftMotionController":
    if trace is not None:
        raise ConfigError(
            tr("The dialogue with a PLC mailbox cannot be recorded."),
            remedy=tr(
                "Leave {record} out; a network capture shows the registers.",
                record=way(Way.RECORD),
            ),
        )
    from robolink.controllers.softmotion import open_softmotion

    opener = open_quick_link if record.glance else open_mailbox_link
    link = opener(url, timeout_s=timeout_s, clock=clock)
    kept = outcomes or record.of(link)
    return open_softmotion(link, outcomes=kept, timeout_s=timeout_s)


def _connect_plc(
    url: LinkUrl,
    timeout_s: float,
    *,
    clock: Clock | None,
    trace: TraceSink | None,
    outcomes: OutcomeLog | None,
    record: "_Record",
) -> "PlcMapController":
    if trace is not None:
        raise ConfigError(
            tr("The dialogue with a PLC's registers cannot be recorded."),
            remedy=tr(
                "Leave {record} out; a network capture shows the registers.",
                record=way(Way.RECORD),
            ),
        )

    from robolink.controllers.plc_map import open_plc_map

    def log(identity: str) -> OutcomeLog:
        return outcomes or record.at(identity, durable=True)

    return open_plc_map(url, outcomes=log, timeout_s=timeout_s, clock=clock)


class _Record:
    """Opens the record of a controller.

    Attributes:
        glance: Whether it is for a look only.

    Args:
        signature: Who works here.
        glance: See above.
    """

    def __init__(self, signature: Signature, *, glance: bool) -> None:
        self._signature = signature
        self.glance = glance

    def of(self, link: Transport | MailboxLink) -> OutcomeLog:
        """Return the record of what a link leads to; the link is closed when that fails."""
        try:
            return self.at(link.identity, durable=link.durable)
        except BaseException:
            link.close()
            raise

    def at(self, address: str, *, durable: bool) -> OutcomeLog:
        """Return the record of what is reached at an address."""
        if self.glance and durable:
            return GlancingLog(address, signature=self._signature)
        return open_log(address, durable=durable, signature=self._signature)
