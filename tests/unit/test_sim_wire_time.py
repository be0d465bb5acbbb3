"""A silent client is given real seconds, however fast simulated time runs."""

import pytest
from robolink_simulators.cell.clock import ManualClock, SteeredClock
from robolink_simulators.device.wire_time import WireTime
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.softmotion.mailbox import MailboxOptions, PlcOptions, SoftMotionSimulator

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

NS = 1_000_000_000
SLOW = (0.02, 100.0, 100.0, 1000.0)


@pytest.fixture
def really():
    """The time that really passes."""
    return ManualClock()


def passing(simulator, clock, really, seconds):
    """Let real seconds pass, as a host does whom nobody asks for anything."""
    really.advance(seconds)
    simulator.advance(clock.now_ns())


def ended(link):
    """Tell whether the controller has ended the link, once a client has taken what was sent."""
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
    """Return a PLC whose client has begun a slow movement and beaten once."""
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
