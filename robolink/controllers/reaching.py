"""Reaching a controller that is not there yet, without a storm when many come back at once.

No link is renewed by itself (docs/reference/rules.md 11), so whoever wants to wait for a
controller, a monitor after a power cut say, says so. A switch that restarts loses every cell
behind it at the same instant; if all of them tried again at fixed times they would knock together
for ever (docs/reference/faults.md F77).
"""

from collections.abc import Callable
from typing import Final, TypeVar

from robolink import ambient
from robolink.errors import ConfigError, ConnectError, TransportBrokenError, TransportTimeoutError
from robolink.messages import tr
from robolink.timing import Clock, Deadline, SystemClock

Reached = TypeVar("Reached")

FIRST_PAUSE_S: Final = 1.0
LONGEST_PAUSE_S: Final = 60.0

_BITS: Final = 32


def connect_when_reachable(
    connect: Callable[[], Reached], *, within_s: float, clock: Clock | None = None
) -> Reached:
    """Connect to a controller as soon as it is there.

    The first attempt is made at once. After each that fails there is a pause, counted from its
    end: drawn between half and the whole of :data:`FIRST_PAUSE_S`, which doubles each time up to
    :data:`LONGEST_PAUSE_S`. What waiting does not mend, as a wrong password or a mistake in the
    URL, ends it at once. ::

        robot = connect_when_reachable(lambda: robolink.connect(url), within_s=600)

    Args:
        connect: One attempt; nothing but connecting should happen in it, since it is repeated.
        within_s: How long it is tried; an attempt that has begun is awaited.
        clock: Replaces the machine's clock.

    Returns:
        What ``connect`` returned.

    Raises:
        ConfigError: ``within_s`` is negative or no number.
        ConnectError, TransportBrokenError, TransportTimeoutError: The last attempt failed so.
        RobolinkError: As ``connect`` raised it, where waiting is no remedy.

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
            tr("A wait of {seconds} s is not possible.", seconds=within_s),
            remedy=tr("Say for how many seconds to keep trying; 0 means one attempt."),
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
    share: float = ambient.random_number(_BITS) / (1 << _BITS)
    return pause_s * (1 + share) / 2
