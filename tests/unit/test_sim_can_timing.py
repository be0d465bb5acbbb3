"""The boot-up time of a simulated CANopen node on a slow computer."""

from itertools import pairwise

from robolink_simulators.hosting.fieldbus.canopen_node import LOOK_S, PERIOD_S, EventTimer

from robolink.timing import NS_PER_S
from tests._rows import each_row

PERIOD_NS = round(PERIOD_S * NS_PER_S)
LOOK_NS = round(LOOK_S * NS_PER_S)


def due_at(looks_ns):
    """Return the time at which it was due, for a client that looks at these times."""
    timer = EventTimer(0)
    return [now_ns for now_ns in looks_ns if timer.due(now_ns)]


def test_a_heartbeat_comes_with_its_period():
    assert due_at(range(0, 10 * PERIOD_NS, LOOK_NS)) == list(range(0, 10 * PERIOD_NS, PERIOD_NS))


@each_row("times_slower", [3, 7, 25])
def test_a_heartbeat_is_late_by_one_look_at_most(times_slower):
    look_ns = times_slower * LOOK_NS
    found = due_at(range(0, 100 * PERIOD_NS, look_ns))
    gaps = [later - earlier for earlier, later in pairwise(found)]
    assert max(gaps) < PERIOD_NS + look_ns
    assert len(found) >= 0.97 * min(100, 100 * PERIOD_NS / look_ns)


def test_what_was_missed_is_not_made_up_for():
    asleep_ns = 20 * PERIOD_NS + LOOK_NS
    assert due_at([0, asleep_ns, asleep_ns + LOOK_NS, 21 * PERIOD_NS]) == [
        0,
        asleep_ns,
        21 * PERIOD_NS,
    ]
