"""Simulated time: stepped, skipped, and real seconds for a silent client."""

import random
import threading

import pytest
from robolink_simulators.cell.clock import ManualClock, ScaledClock, SteeredClock
from robolink_simulators.device.wire_time import WireTime
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.softmotion.mailbox import MailboxOptions, PlcOptions, SoftMotionSimulator

from robolink.errors import ConfigError
from robolink.protocols.mailbox import (
    Command,
    CommandState,
    CoordinateSystem,
    ErrorClass,
    Opcode,
    decode_response,
    encode_command,
    heartbeat_word,
)
from tests._rows import each_row

# Simulated time.


def test_a_manual_clock_stands_still_until_someone_waits():
    clock = ManualClock(5)
    assert clock.now_ns() == clock.now_ns() == 5
    clock.sleep(0.25)
    assert clock.now_ns() == 250_000_005


def test_a_manual_clock_never_goes_back():
    clock = ManualClock(100)
    clock.advance_to(50)
    clock.sleep(-1)
    assert clock.now_ns() == 100
    with pytest.raises(ConfigError, match="cannot go back"):
        clock.advance(-1)


def test_no_tick_is_lost_when_threads_advance_a_manual_clock():
    clock = ManualClock()

    def tick():
        for _ in range(2000):
            clock.advance(1e-9)

    threads = [threading.Thread(target=tick) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert clock.now_ns() == 8000


def test_a_scaled_clock_runs_faster_than_its_base():
    base = ManualClock(1_000)
    clock = ScaledClock(20, base)
    base.advance(1)
    assert clock.now_ns() == 1_000 + 20_000_000_000


def test_sleeping_on_a_scaled_clock_takes_less_real_time():
    base = ManualClock()
    ScaledClock(4, base).sleep(2)
    assert base.now_ns() == 500_000_000


def test_real_seconds_until_a_simulated_instant():
    base = ManualClock()
    clock = ScaledClock(10, base)
    assert clock.real_seconds(5_000_000_000) == 0.5
    assert clock.real_seconds(5_000_000_000, 3_000_000_000) == 0.2
    assert SteeredClock(10, base).real_seconds(5_000_000_000, 3_000_000_000) == 0.2
    base.advance(1)
    assert clock.real_seconds(5_000_000_000) == 0.0
    assert clock.real_seconds(5_000_000_000, 3_000_000_000) == 0.2


@each_row("factor", [0, -1, float("inf"), float("nan")])
def test_a_factor_must_be_above_zero(factor):
    with pytest.raises(ConfigError, match="factor"):
        ScaledClock(factor)


# A controller that skips idle time behaves like one that never does.
# The shortcuts of ``stepped_controller`` rest on the last prediction; any late prediction, or one
# kept too long, shows in an answer, in the true world, or in the reported time of the next change.

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
    """Examines all of itself at each instant."""

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
        """Do one thing at an instant; return everything that shows."""
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


LIVES = [
    pytest.param(seed, loaded, marks=() if loaded is (at % 2 == 0) else pytest.mark.soak)
    for at, seed in enumerate((0, 3, 8, 10, 15))
    for loaded in (False, True)
]


@pytest.mark.parametrize(("seed", "loaded"), LIVES)
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


# A silent client is given real seconds, however fast simulated time runs.

NS = 1_000_000_000
SLOW = (0.02, 100.0, 100.0, 1000.0)


@pytest.fixture
def really():
    """The time that really passes."""
    return ManualClock()


def passing(simulator, clock, really, seconds):
    """Let real seconds pass, as a host does without any request."""
    really.advance(seconds)
    simulator.advance(clock.now_ns())


def ended(link):
    """Return whether the controller has closed the link after its client took all output."""
    link.outgoing()
    return link.closed


@pytest.mark.parametrize(("factor", "exchange_s"), [(50, 0.0), (1, 0.0), (0.5, 0.0), (20, 0.05)])
def test_the_remote_timeout_of_an_epson_counts_no_faster_than_real_seconds(
    really, factor, exchange_s
):
    clock = SteeredClock(factor, base=really, exchange_s=exchange_s)
    simulator = EpsonSimulator(options=EpsonOptions(remote_timeout_s=60.0))
    simulator.keep_time(clock)
    link = simulator.connect(clock.now_ns())
    clock.exchanged()
    link.receive(b"$Login,\r\n", clock.now_ns())
    allowed_s = 60.0 / min(1, factor)
    passing(simulator, clock, really, allowed_s - 1)
    assert not ended(link)
    passing(simulator, clock, really, 2)
    assert ended(link)
    assert simulator.condition.code == 19


def test_whoever_does_not_log_in_has_as_long_as_in_real_time(really):
    clock = SteeredClock(50, base=really)
    simulator = EpsonSimulator(options=EpsonOptions(login_timeout_s=30.0))
    simulator.keep_time(clock)
    link = simulator.connect(clock.now_ns())
    passing(simulator, clock, really, 29)
    assert not ended(link)
    passing(simulator, clock, really, 2)
    assert ended(link)


def test_a_step_ages_nobody_and_a_pause_neither(really):
    clock = SteeredClock(1, base=really)
    simulator = EpsonSimulator(options=EpsonOptions(remote_timeout_s=60.0))
    simulator.keep_time(clock)
    link = simulator.connect(clock.now_ns())
    link.receive(b"$Login,\r\n", clock.now_ns())
    clock.advance(3600)
    passing(simulator, clock, really, 1)
    clock.run(0)
    passing(simulator, clock, really, 3600)
    assert not ended(link)
    clock.run(7)
    passing(simulator, clock, really, 58)
    assert not ended(link)
    passing(simulator, clock, really, 2)
    assert ended(link)


def moving(clock, **options):
    """Return a PLC whose client has begun a slow movement and sent one heartbeat."""
    plc = SoftMotionSimulator(options=PlcOptions(mailbox=MailboxOptions(**options)))
    plc.keep_time(clock)
    z = decode_response(plc.read(0, 112, clock.now_ns()).words).tcp

    def write(sequence, opcode, operands, epoch, **fields):
        command = Command(sequence, opcode, operands=operands, owner=7, epoch=epoch, **fields)
        words = encode_command(command, heartbeat=heartbeat_word(epoch, sequence))
        plc.write(0, words, clock.now_ns())
        clock.advance(0.02)
        plc.advance(clock.now_ns())
        return decode_response(plc.read(0, 112, clock.now_ns()).words)

    epoch = write(1, Opcode.OWNERSHIP, (1, 0, 0, 0), 0).answer.epoch
    target = (*z[:2], z[2] - 1.0, *z[3:])
    write(2, Opcode.MOVE_LINEAR, (0, 0, CoordinateSystem.MCS, 0), epoch, pose=target, dynamics=SLOW)
    return plc


@pytest.mark.parametrize("factor", [20, 1])
def test_a_plc_waits_as_long_for_a_beat_as_a_real_one(really, factor):
    clock = SteeredClock(factor, base=really)
    plc = moving(clock)
    assert len(plc.plc.program.jobs.moving) == 1
    passing(plc, clock, really, 0.45)
    assert len(plc.plc.program.jobs.moving) == 1
    passing(plc, clock, really, 0.1)
    assert not plc.plc.program.jobs.moving
    (end,) = decode_response(plc.read(0, 112, clock.now_ns()).words).finished[:1]
    assert (end.state, end.error_class) == (CommandState.ABORTED, ErrorClass.HEARTBEAT_LOST)


def test_the_watchdog_of_a_fieldbus_bears_as_much_as_a_real_one(really):
    clock = SteeredClock(20, base=really)
    plc = SoftMotionSimulator(options=PlcOptions(mailbox=MailboxOptions(watchdog_ms=400)))
    plc.keep_time(clock)
    plc.write(0, (9,), clock.now_ns())
    passing(plc, clock, really, 0.35)
    assert plc.plc.program.inbox.words[0] == 9
    passing(plc, clock, really, 0.1)
    assert plc.plc.program.inbox.words[0] == 0


def test_without_a_host_the_time_given_is_the_time_on_the_wire():
    time = WireTime()
    assert (time.at(5), time.simulated_at(7)) == (5, 7)
    time.clock = SteeredClock(20, base=ManualClock(3 * NS))
    assert time.at(time.simulated_at(4 * NS)) == 4 * NS
