"""A program run to its end without a client: for people who look for a mistake in it."""

from collections.abc import Callable
from typing import Final

from robolink.timing import NS_PER_S, Clock, SystemClock
from robolink_simulators.epson.spel.tasks.runner import ProgramRunner

_LONGEST_NAP_NS: Final = 20_000_000

Advance = Callable[[int], None]
"""Lets a controller's simulated time reach an instant."""


def run_to_end(
    runner: ProgramRunner,
    advance: Advance,
    next_change: Callable[[], int | None],
    *,
    most_s: float,
    clock: Clock | None = None,
) -> bool:
    """Let time pass until every task is over; tell whether that came in time.

    Nobody waits for simulated time: it goes on to what happens next. Only while a port is open
    does it pass as fast as outside, because another program may have to answer.

    Args:
        runner: What runs; it was started.
        advance: Lets the controller's time pass.
        next_change: Tells when something happens next.
        most_s: Simulated seconds after which it is left as it is.
        clock: The time outside.
    """
    outside = clock or SystemClock()
    end_ns = runner.now_ns + round(most_s * NS_PER_S)
    behind_ns = outside.now_ns() - runner.now_ns
    while runner.tasks:
        change_ns = next_change()
        if change_ns is None or change_ns > end_ns:
            return False
        if runner.ports.in_use:
            present_ns = outside.now_ns() - behind_ns
            if change_ns > present_ns:
                nap_ns = min(change_ns - present_ns, _LONGEST_NAP_NS)
                outside.sleep(nap_ns / NS_PER_S)
                change_ns = min(change_ns, present_ns + nap_ns)
        else:
            behind_ns = outside.now_ns() - change_ns
        advance(change_ns)
    return True
