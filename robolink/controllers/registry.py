"""From a URL to a controller, by the opener of the kind that it names.

Kinds that this package brings stand in a table and are imported when they are named; all others
are found in the entry-point group ``robolink.controllers``, by the full scheme of the URL
(``gantry+tcp``) or by its kind alone (``gantry``). No entry point is looked for where the table
knows the kind: a stop and a look are timed (docs/decisions/0017).

Reaching a controller that is not there yet, without a storm when many come back at once.

No link is renewed by itself (docs/reference/rules.md 11), so a caller that wants to wait for a
controller, such as a monitor after a power cut, asks for it. A switch that restarts loses every
cell behind it at the same instant; if all of them tried again at fixed times they would try
together for ever (docs/reference/faults.md F77).

How many axes a robot has by its model alone, before anything is connected.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Final, Protocol, TypeVar, cast, overload

from robolink import runtime
from robolink.errors import (
    ConfigError,
    ConnectError,
    LeaseHeldError,
    LoginUnansweredError,
    RobolinkError,
    TransportBrokenError,
    TransportTimeoutError,
)
from robolink.journal import open_log, signature_here
from robolink.messages import tr
from robolink.model import (
    Capabilities,
    ChangeLimits,
    Controller,
    OutcomeLog,
    Secret,
    Signature,
    require_acceleration,
)
from robolink.package_log import PackageLog
from robolink.plug_ins import PlugInError, find_plug_in
from robolink.stop_latch import require_wait, waiting_for
from robolink.timing import Clock, Deadline, SystemClock
from robolink.transport import LinkUrl, TraceSink, parse_url, told_to
from robolink.version import VERSION

_LOG: Final = PackageLog(__package__)

CONTROLLERS_GROUP: Final = "robolink.controllers"

_KINDS: Final = {
    "epson": ("robolink.controllers.epson.controller", "open_epson_url", "EpsonController"),
    "softmotion": (
        "robolink.controllers.softmotion.controller",
        "open_softmotion_url",
        "SoftMotionController",
    ),
    "plc": ("robolink.controllers.plc_map.controller", "open_plc_map_url", "PlcMapController"),
}


class OpenLink(Protocol):
    """What has to be known of a link to keep a record of its far end."""

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
    """The terms of a connection; see :func:`robolink.connect`.

    Attributes:
        signature: Who works here, and with what.
        password: For a login, if there is one.
        timeout_s: Longest wait for one answer.
        remote_timeout_s: The remote time-out set on an EPSON controller.
        acceleration_mm_s2: Highest acceleration of straight movements, as the cell states it. A
            kind that keeps it says so in its capabilities.
        clock: Replaces the machine's clock.
        trace: Receives all traffic. The links of robolink report it themselves; a kind with a link
            of its own makes a :class:`robolink.transport.Traffic` and reports to that.
        outcomes: The record to keep; ``None`` for the journal of this user.
        glance: Whether this is for reading only.
        tell: Receives sentences that say what is waited for.
    """

    signature: Signature
    password: Secret | None = None
    timeout_s: float = 3.0
    remote_timeout_s: float = 60.0
    acceleration_mm_s2: int | None = None
    clock: Clock | None = None
    trace: TraceSink | None = None
    outcomes: OutcomeLog | None = None
    glance: bool = False
    tell: Callable[[str], None] = lambda _sentence: None

    def record_of(self, link: OpenLink) -> OutcomeLog:
        """Return the record for a link; the link is closed if that fails."""
        try:
            return self.record_at(link.identity, durable=link.durable)
        except BaseException:
            link.close()
            raise

    def record_at(self, address: str, *, durable: bool = True) -> OutcomeLog:
        """Return the record for an address.

        Args:
            address: How it is reached.
            durable: Whether it outlives this process, so that its record must too.
        """
        if self.outcomes is not None:
            return self.outcomes
        return open_log(address, durable=durable, signature=self.signature, glance=self.glance)


class ControllerOpener(Protocol):
    """What an entry point of the group provides."""

    def __call__(self, url: LinkUrl, terms: ConnectionTerms, /) -> Controller:
        """Connect to the controller that ``url`` names.

        Raises:
            ConfigError: The URL or the terms make no sense for this kind.
            ConnectError: Nobody is reached.
        """


def find_opener(url: LinkUrl) -> ControllerOpener:
    """Return the opener for the kind of controller that a URL names.

    Raises:
        ConfigError: No opener knows the kind, or the one that does cannot be loaded.
    """
    if url.kind in _KINDS:
        module, name, _ = _KINDS[url.kind]
        return cast(ControllerOpener, getattr(import_module(module), name))
    for name in (url.scheme, url.kind):
        try:
            found = find_plug_in(CONTROLLERS_GROUP, name)
        except PlugInError as error:
            raise ConfigError(
                tr(
                    "The part that connects to {kind!r} cannot be loaded: {cause}.",
                    kind=name,
                    cause=error,
                ),
                remedy=tr("Reinstall the package that provides it."),
            ) from error.origin
        if found is not None:
            return _told_as_its_own(name, cast(ControllerOpener, found))
    raise ConfigError(
        tr("robolink does not know controllers of the kind {kind!r}.", kind=url.kind),
        remedy=tr("Write for example epson+tcp://192.168.0.1:5000."),
    )


def capabilities_of_kind(kind: str) -> Capabilities | None:
    """Return the most that a kind of controller supports; nothing is connected.

    Args:
        kind: The first word of its URL.

    Returns:
        ``None`` if only a connected one shows it.

    Example:
        >>> from robolink.controllers import capabilities_of_kind
        >>> capabilities_of_kind("plc").motion, capabilities_of_kind("acme")
        (False, None)
    """
    return cast(Capabilities, _class_of_kind(kind).OF_KIND) if kind in _KINDS else None


def _class_of_kind(kind: str) -> Any:  # noqa: ANN401 - a class with OF_KIND
    module, _, name = _KINDS[kind]
    return getattr(import_module(module), name)


def _told_as_its_own(kind: str, opener: ControllerOpener) -> ControllerOpener:
    """Return a third-party opener whose errors are not reported as robolink's."""

    def opened(url: LinkUrl, terms: ConnectionTerms, /) -> Controller:
        try:
            return opener(url, terms)
        except RobolinkError:
            raise
        except Exception as error:
            raise ConfigError(
                tr(
                    "The part that connects to {kind!r} failed: {cause}.",
                    kind=kind,
                    cause=f"{type(error).__name__}: {error}",
                ),
                remedy=tr("Report it to the makers of that part."),
            ) from error

    return opened


OfKind = TypeVar("OfKind", bound=Controller)
Reached = TypeVar("Reached")


@overload
def connect(
    url: str | Controller,
    *,
    kind: type[OfKind],
    password: str | Secret | None = None,
    timeout_s: float = 3.0,
    remote_timeout_s: float = 60.0,
    acceleration_mm_s2: int | None = None,
    wait_s: float | None = None,
    clock: Clock | None = None,
    trace: TraceSink | None = None,
    outcomes: OutcomeLog | None = None,
    signature: Signature | None = None,
    limits: ChangeLimits | None = None,
    glance: bool = False,
    tell: Callable[[str], None] = lambda _sentence: None,
) -> OfKind: ...


@overload
def connect(
    url: str | Controller,
    *,
    kind: None = None,
    password: str | Secret | None = None,
    timeout_s: float = 3.0,
    remote_timeout_s: float = 60.0,
    acceleration_mm_s2: int | None = None,
    wait_s: float | None = None,
    clock: Clock | None = None,
    trace: TraceSink | None = None,
    outcomes: OutcomeLog | None = None,
    signature: Signature | None = None,
    limits: ChangeLimits | None = None,
    glance: bool = False,
    tell: Callable[[str], None] = lambda _sentence: None,
) -> Controller: ...


def connect(
    url: str | Controller,
    *,
    kind: type[Controller] | None = None,
    password: str | Secret | None = None,
    timeout_s: float = 3.0,
    remote_timeout_s: float = 60.0,
    acceleration_mm_s2: int | None = None,
    wait_s: float | None = None,
    clock: Clock | None = None,
    trace: TraceSink | None = None,
    outcomes: OutcomeLog | None = None,
    signature: Signature | None = None,
    limits: ChangeLimits | None = None,
    glance: bool = False,
    tell: Callable[[str], None] = lambda _sentence: None,
) -> Controller:
    """Connect to a controller, and log in if it has a login.

    Args:
        url: For example ``epson+tcp://192.168.0.1:5000``, ``epson+sim://cell-a?seed=1`` or
            ``softmotion+modbus-tcp://192.168.0.2:502`` or
            ``plc+modbus-tcp://192.168.0.2?map=machine.toml``. A controller that is open
            already is returned as it is, whatever else is given.
        kind: The class of controller behind the URL, :class:`~.EpsonController` for example, if
            you need more than all kinds have: the result then has that type.
        password: An EPSON controller's remote password, if one is set; a PLC has none.
        timeout_s: Longest wait for one answer.
        remote_timeout_s: The remote time-out set on an EPSON controller. It cannot be read
            over the wire; 0 forbids motion. A PLC's watchdog is part of its mailbox program.
        acceleration_mm_s2: Highest acceleration and deceleration of straight movements, by the cell
            file (``cell.settings.acceleration_mm_s2``). It only lowers what the controller has;
            without it robolink sets none. A whole number, so that no controller rounds it up.
        wait_s: How long connecting, and later each call of this controller, waits for another
            working program or thread, in seconds; ``None`` or 0 refuses at once. The
            controller has it as ``patience.wait_s``.
        clock: Replaces the machine's clock; a simulator brings its own.
        trace: Called with (time in ns, "sent" or "received", bytes) for all traffic; a password is
            ``b"<secret>"``. Bytes are those on the line: a CAN frame is its identifier in two
            bytes and its data, a word of a mailbox in this process two bytes. A kind of another
            package that has a link of its own tells its requests as text.
        outcomes: Where outcomes are recorded; by default the journal of this user, or memory
            for a simulator that ends with this process. Without a usable journal you can still
            read and stop: ``outcomes.trouble`` says what is wrong with it, and every change
            raises that error.
        signature: Who works here, and with what; by default the user of this computer.
        limits: How far a write may move a tip, by the cell file (``Cell.limits()``). Without
            them there is no limit.
        glance: Whether this is for reading only: a journal without unfinished jobs is then
            opened only when something has to be recorded, and the controller is not asked
            for its identity.
        tell: Receives sentences that say what is waited for: other users, and at most ten
            seconds until a PLC releases the mailbox of a run that has ended.

    Raises:
        ConfigError: The URL or an option is wrong, or leads to another kind of controller, or to
            one that keeps to no acceleration although one is given (unless it is only read).
        ConnectError: No connection, no answer to the login, or the PLC's mailbox program does
            not run.
        RemoteProtocolError: The far end is not a mailbox of this version, or the probe of a
            map differs.
        LoginRefusedError: Wrong or missing password.
        LeaseHeldError: No answer to the login, because somebody else has the controller.

    Example:
        >>> import robolink
        >>> from robolink.controllers import EpsonController
        >>> with robolink.connect("epson+sim://connect-example?seed=1") as controller:
        ...     print(controller.status().state, controller.tools.selected())
        ready 1
        >>> url = "epson+sim://connect-example"
        >>> with robolink.connect(url, kind=EpsonController) as epson:
        ...     epson.robot_number()  # what only this kind has: no isinstance needed
        1
    """
    if not isinstance(url, str):
        if not hasattr(url, "tools"):
            raise ConfigError(
                tr("{given!r} is neither a URL nor a controller.", given=url),
                remedy=tr("Give a URL such as epson+tcp://192.168.0.1:5000."),
            )
        _require_kind(type(url), kind, str(url.identity))
        return url
    link, wait_s = parse_url(url), require_wait(wait_s or 0.0)
    if acceleration_mm_s2 is not None:
        require_acceleration(acceleration_mm_s2)
    if kind is not None and link.kind in _KINDS:  # before any connection is made
        _require_kind(_class_of_kind(link.kind), kind, url)
    terms = ConnectionTerms(
        signature or signature_here(VERSION),
        password=Secret(password) if isinstance(password, str) else password,
        timeout_s=timeout_s,
        remote_timeout_s=remote_timeout_s,
        acceleration_mm_s2=acceleration_mm_s2,
        clock=clock,
        trace=trace,
        outcomes=outcomes,
        glance=glance,
        tell=tell,
    )
    controller = _waited_for(lambda: opened(link, terms), wait_s, tell)
    try:
        _require_kind(type(controller), kind, url)
        if acceleration_mm_s2 is not None and not glance:
            require_acceleration(acceleration_mm_s2, controller)
        if wait_s:
            controller.patience.wait_s, controller.patience.tell = wait_s, tell
    except BaseException:
        controller.close()
        raise
    if limits is not None:
        controller.change_guard.limits = limits
    return controller


def _require_kind(found: type, kind: type[Controller] | None, called: str) -> None:
    """Refuse a controller, or a URL known to open one, of another kind than asked for.

    Raises:
        ConfigError: It is of another kind.
    """
    if kind is not None and not issubclass(found, kind):
        raise ConfigError(
            tr(
                "{url} is the URL of a controller of the kind {found}, not {kind}.",
                url=called,
                found=found.__name__,
                kind=kind.__name__,
            ),
            remedy=tr("Give {found} as the kind, or another URL.", found=found.__name__),
        )


_AGAIN_S: Final = 0.25
"""Pause between two login attempts while another client is logged in, in s."""


def _waited_for(
    connecting: Callable[[], Reached], wait_s: float, tell: Callable[[str], None]
) -> Reached:
    """Connect, and wait for others who are logged in; the time is the computer's.

    Raises:
        LoginUnansweredError, LeaseHeldError: Somebody is still there.
    """
    deadline, told = Deadline.after(SystemClock(), wait_s), False
    while True:
        try:
            return connecting()
        except (LoginUnansweredError, LeaseHeldError) as taken:
            left_s = deadline.remaining_s()
            if not left_s:
                raise
            if not told:
                tell(waiting_for(taken, left_s))
                told = True
        runtime.sleep(min(left_s, _drawn(2 * _AGAIN_S)))


def opened(url: LinkUrl, terms: ConnectionTerms) -> Controller:
    """Connect to the controller at a URL, and report its traffic.

    A kind whose link reports nothing, such as the library of a maker, reports the requests that its
    stop latch admits.

    Args:
        url: The URL.
        terms: The terms.

    Raises:
        RobolinkError: As the opener of its kind.
    """
    with told_to(terms.trace) as listeners:
        controller = find_opener(url)(url, terms)
        if not listeners.links:
            from robolink.controllers.driver_link import tell_requests

            tell_requests(controller.latch, controller.identity, controller.clock)
    _LOG.decided("connected", controller=controller.identity, request="connect")
    return controller


FIRST_PAUSE_S: Final = 1.0
LONGEST_PAUSE_S: Final = 60.0

_BITS: Final = 32


def connect_when_reachable(
    connect: Callable[[], Reached], *, within_s: float, clock: Clock | None = None
) -> Reached:
    """Connect to a controller as soon as it is reachable.

    The first attempt is made at once. After each that fails there is a pause, counted from its
    end: drawn between half and the whole of :data:`FIRST_PAUSE_S`, which doubles each time up to
    :data:`LONGEST_PAUSE_S`. An error that waiting cannot cure, such as a wrong password or URL,
    ends it at once. ::

        robot = connect_when_reachable(lambda: robolink.connect(url), within_s=600)

    Args:
        connect: One attempt; nothing but connecting should happen in it, since it is repeated.
        within_s: How long to try; an attempt that has begun is awaited.
        clock: Replaces the machine's clock.

    Returns:
        What ``connect`` returned.

    Raises:
        ConfigError: ``within_s`` is negative or not a number.
        ConnectError, TransportBrokenError, TransportTimeoutError: The last attempt failed with it.
        RobolinkError: As ``connect`` raised it, if waiting is no remedy.

    Example:
        >>> import robolink
        >>> from robolink.controllers import connect_when_reachable
        >>> url = "epson+sim://reach-example"
        >>> with connect_when_reachable(lambda: robolink.connect(url), within_s=60) as controller:
        ...     controller.status().state.value
        'ready'
    """
    if not within_s >= 0:
        raise ConfigError(
            tr("{seconds} s is not a possible wait.", seconds=within_s),
            remedy=tr("State how many seconds to keep trying; 0 means one attempt."),
        )
    clock = clock or SystemClock()
    deadline, pause_s = Deadline.after(clock, within_s), FIRST_PAUSE_S
    while True:
        try:
            return connect()
        except (ConnectError, TransportBrokenError, TransportTimeoutError):
            if deadline.expired:
                raise
        clock.sleep(min(_drawn(pause_s), deadline.remaining_s()))
        pause_s = min(2 * pause_s, LONGEST_PAUSE_S)


def _drawn(pause_s: float) -> float:
    share: float = runtime.random_number(_BITS) / (1 << _BITS)
    return pause_s * (1 + share) / 2
