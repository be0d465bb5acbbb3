"""From a URL to a controller."""

from robolink import __version__
from robolink.controllers.epson import EpsonController, open_epson
from robolink.errors import ConfigError, LoginUnansweredError
from robolink.journal import memory_journal, open_journal, signature_here
from robolink.messages import tr
from robolink.model import OutcomeLog, Secret, Signature
from robolink.timing import Clock
from robolink.transport import TraceSink, TracingTransport, open_transport, parse_url


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
) -> EpsonController:
    """Connect to a controller and log in.

    Args:
        url: For example ``epson+tcp://192.168.0.1:5000`` or ``epson+sim://cell-a?seed=1``.
        password: The controller's remote password, if one is set.
        timeout_s: Longest wait for one answer.
        remote_timeout_s: The remote time-out set on the controller. It cannot be read over
            the wire; 0 forbids motion.
        clock: Replaces the machine's clock; a simulator brings its own.
        trace: Called with (time in ns, "sent" or "received", bytes) for all traffic but the
            login frame.
        outcomes: Where outcomes are recorded; by default the journal of this user, or memory
            for a simulator that dies with this process.
        signature: Who works here, and with what; by default the user of this computer.

    Raises:
        ConfigError: The URL or an option is wrong.
        ConnectError: Nobody is reached, or nobody answers the login.
        LoginRefusedError: Wrong or missing password.
        LeaseHeldError: Nobody answers the login, and somebody else has the controller.
    """
    link = parse_url(url)
    if link.kind != "epson":
        raise ConfigError(
            tr("robolink does not know controllers of the kind {kind!r}.", kind=link.kind),
            remedy=tr("Write for example epson+tcp://192.168.0.1:5000."),
        )
    transport = open_transport(link, timeout_s=timeout_s, clock=clock)
    try:
        if outcomes is None:
            identity = transport.identity
            journal = open_journal() if transport.durable else memory_journal(identity)
            outcomes = journal.log(identity, signature=signature or signature_here(__version__))
        if trace is not None:
            transport = TracingTransport(transport, trace)
    except BaseException:
        transport.close()
        raise
    try:
        return open_epson(
            transport,
            outcomes=outcomes,
            password=Secret(password) if isinstance(password, str) else password,
            timeout_s=timeout_s,
            remote_timeout_s=remote_timeout_s,
        )
    except LoginUnansweredError:
        # One client at a time is served (epson.md 1.1). The lease may say who that is.
        outcomes.look()
        raise
