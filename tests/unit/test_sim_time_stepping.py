"""A controller that passes over time in which nothing happens does what one does that never does.

The shortcuts of ``stepped_controller`` rest on what was foreseen last; whatever is foreseen too
late, or kept too long, shows in an answer, in the truth, or in when the next change is told.
"""

import random

import pytest
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction

MS = 1_000_000
REQUESTS = (
    "$GetStatus",
    "$GetIO,1",
    '$Execute,"Print Here"',
    '$Execute,"Move Here +X(3)"',
    '$Execute,"Move Here -X(3)"',
    '$Execute,"On 5, 0.2, 0"',
    '$Execute,"Off 5"',
    '$Execute,"TLSet 2, XY(1,2,-30,0)"',
    "$Abort",
    "$Stop",
    "$Reset",
    "$Login,",
)
ACTS = (
    "press_estop",
    "release_estop",
    "open_guard",
    "close_guard",
    "cut_link",
    "start_production",
    "start_production",
    "stop_production",
)
PROGRAM = """Function main
  Do
    On 7
    Wait 0.03
    Off 7
    Wait 0.05
  Loop
Fend
"""
FAULTS = (
    Fault(FaultAction.GUARD_OPEN, on_exchange=9, seconds=0.3),
    Fault(FaultAction.LOSE_LOGIN, on_exchange=25, seconds=0.1),
)


class Plain(EpsonSimulator):
    """Looks at all of itself at each instant."""

    def _passes(self, now_ns):
        if self._begun:
            self._settled_ns = -1
            return False
        return super()._passes(now_ns)

    def next_change(self):
        return self._found_next() if self._begun else None


class Side:
    """One of the two, and its client."""

    def __init__(self, simulator):
        self.simulator, self.link = simulator, simulator.connect(0)

    def does(self, what, now_ns):
        """Do one thing at an instant; return all that shows."""
        if what in ACTS:
            getattr(self.simulator.panel, what)()
        elif what == "mend":
            self.simulator.panel.release_estop()
            self.simulator.panel.close_guard()
            self.link.receive(b'$Reset\r\n$Execute,"Motor On"\r\n', now_ns)
        elif what == "connect":
            self.link = self.simulator.connect(now_ns)
            shown = self.shows()  # before anything is asked of it
            self.link.receive(b"$Login,\r\n", now_ns)
            return shown
        elif what:
            self.link.receive(f"{what}\r\n".encode(), now_ns)
        self.simulator.advance(now_ns)
        return self.shows()

    def shows(self):
        simulator = self.simulator
        flags = simulator.status_flags()
        bits = [
            simulator.machine.timed_bits.next_change(),
            simulator.machine.moving,
            simulator.variables.values(),
            simulator.machine.outputs.get(7),
        ]
        return self.link.outgoing(), simulator.next_change(), flags, bits, simulator.now_ns


@pytest.mark.parametrize("seed", [0, 3, 8, 10, 15])
@pytest.mark.parametrize("loaded", [False, True], ids=["no program", "a program"])
def test_what_shows_is_the_same_as_without_any_shortcut(seed, loaded, tmp_path):
    rng, now_ns = random.Random(seed), 0
    options = EpsonOptions(remote_timeout_s=5.0)
    sides = [
        Side(kind(seed=3, serial="SIM00003", options=options, faults=FAULTS))
        for kind in (EpsonSimulator, Plain)
    ]
    if loaded:
        (tmp_path / "Main.prg").write_text(PROGRAM)
        for side in sides:
            side.simulator.load([tmp_path / "Main.prg"])
    for what in ["$Login,", *(_drawn(rng) for _ in range(300))]:
        now_ns += rng.choice((0, 0, 1, 5 * MS, 40 * MS, 200 * MS, 700 * MS))
        changes = sides[1].simulator.next_change()
        if changes is not None and now_ns <= changes < now_ns + 500 * MS:
            now_ns = changes  # just when something is due
        one, other = (side.does(what, now_ns) for side in sides)
        assert one == other, (what, now_ns)
    lived = sides[0].simulator.counters()
    assert lived["moves_started"] + lived["tool_writes"] >= 1, "it was a life worth comparing"
    assert sides[0].simulator.truth() == sides[1].simulator.truth()
    assert sides[0].simulator.counters() == sides[1].simulator.counters()


def _drawn(rng):
    (kind,) = rng.choices(("ask", "act", "mend", "connect", ""), (50, 4, 7, 8, 31))
    return rng.choice({"ask": REQUESTS, "act": ACTS}.get(kind, (kind,)))
