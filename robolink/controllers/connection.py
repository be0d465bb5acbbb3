"""From a URL to a controller."""

from robolink.controllers.registry import ConnectionTerms, find_opener
from robolink.journal import signature_here
from robolink.model import Controller, OutcomeLog, Secret, Signature
from robolink.timing import Clock
from robolink.transport import TraceSink, parse_url
from robolink.version import VERSION


def connect(
    url: str | Controller,
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
            ``plc+modbus-tcp://192.168.0.2?map=machine.toml``. A controller that is open
            already is returned as it is, whatever else is given.
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
    if not isinstance(url, str):
        return url
    link = parse_url(url)
    terms = ConnectionTerms(
        signature or signature_here(VERSION),
        password=Secret(password) if isinstance(password, str) else password,
        timeout_s=timeout_s,
        remote_timeout_s=remote_timeout_s,
        clock=clock,
        trace=trace,
        outcomes=outcomes,
        glance=glance,
    )
    return find_opener(link)(link, terms)
