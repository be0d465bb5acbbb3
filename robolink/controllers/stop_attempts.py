"""The attempts of a stop over a link of its own, whatever the kind of controller.

A stop from outside makes them, and an open session whose link has ended. Nothing is imported here
that the first frame of a stop does not need.
"""

from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple, Protocol

from robolink import runtime
from robolink.errors import (
    ConnectError,
    LoginRefusedError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportError,
)
from robolink.package_log import PackageLog
from robolink.transport import LinkUrl, told_to

if TYPE_CHECKING:
    from collections.abc import Callable

    from robolink.controllers.registry import ConnectionTerms
    from robolink.model import ControllerStatus
    from robolink.timing import Clock
    from robolink.transport import TraceSink

    StopWay = Callable[[LinkUrl, "StopMeans"], ControllerStatus]
    """Stops the controller at a URL over a new link, once."""


class Stoppable(Protocol):
    """What a stop needs of a controller that is open."""

    def stop(self) -> None:
        """Stop it; any thread may call this."""

    def status(self) -> "ControllerStatus":
        """Read its state."""


_LOG: Final = PackageLog(__package__)

_TRIES: Final = 3
"""Number of attempts to stop. A stop may be repeated: after a lost answer, or if another client
overwrote it in a mailbox, the robot must not go on moving."""

_REFUSED_NS: Final = 1_000_000_000
"""Time in ns for which a mailbox is asked again that refuses to be looked at."""

_AGAIN_S: Final = 0.04
"""Time between two such attempts, in s."""


class StopMeans(NamedTuple):
    """The means to reach a controller; see :func:`robolink.controllers.stop_now`."""

    password: str
    timeout_s: float
    login_s: float
    clock: "Clock | None"
    met: "Callable[[str], None] | None"
    owner: int
    """Token of all attempts in a mailbox. With a new token, an attempt would be superseded by the
    one before, whose answer was lost and whose command is acknowledged only now."""


def attempted(
    stop: "StopWay", link: LinkUrl, means: StopMeans, *, trace: "TraceSink | None" = None
) -> "ControllerStatus":
    """Stop a controller, and try again after a lost answer.

    Args:
        stop: One attempt.
        link: Which controller.
        means: How it is reached.
        trace: Receives the traffic.

    Raises:
        RobolinkError: As the last attempt.
    """
    tries_left = _TRIES
    refused_until_ns = runtime.monotonic_ns() + _REFUSED_NS
    while True:
        try:
            with told_to(trace):
                status = stop(link, means)
            _LOG.decided("stop acknowledged: it rests", controller=link.identity, request="stop")
            return status
        except (TransportError, RemoteProtocolError) as error:
            tries_left -= 1
            if isinstance(error, ConnectError) or not tries_left:
                raise
        except RejectedError as error:
            # A PLC that is busy for a moment refuses a look. A password is never tried again.
            by_mailbox = link.kind == "softmotion" and not isinstance(error, LoginRefusedError)
            if not by_mailbox or runtime.monotonic_ns() >= refused_until_ns:
                raise
            runtime.sleep(_AGAIN_S)


def anew(
    stop: "StopWay", link: LinkUrl, terms: "ConnectionTerms"
) -> "Callable[[], ControllerStatus]":
    """Return what stops a controller whose session is over, on the terms of that session.

    Args:
        stop: One attempt.
        link: Which controller.
        terms: Of its connection.
    """
    given = terms.password.reveal() if terms.password else ""
    owner = runtime.random_number(32)
    means = StopMeans(given, terms.timeout_s, terms.timeout_s, terms.clock, None, owner)
    return partial(attempted, stop, link, means, trace=terms.trace)


def tell_what_is_said_twice(asked: "Callable[[], str]", met: "Callable[[str], None]") -> None:
    """Ask twice which controller has stopped: an answer that was damaged names another one.

    The note of a stop that names another one holds nothing back here; one without a name does.
    """
    with suppress(RobolinkError):
        if (name := asked()) and name == asked():
            met(name)
