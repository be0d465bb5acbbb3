"""A client that waits gets its turn; a stop, Ctrl-C or the end of its time ends the wait."""

import _thread
import threading
import time
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import replace
from math import inf, nan

import pytest

import robolink
from robolink import ANY, ToolOffset, runtime
from robolink.controllers import SimpleController, SimpleMachine
from robolink.errors import (
    BusyError,
    ConfigError,
    LeaseHeldError,
    LeaseLostError,
    RobolinkError,
    StoppedError,
)
from robolink.journal import JournalOutcomeLog, memory_journal, this_process
from robolink.model import EntryKind, new_operation
from robolink.transaction import ToolChange, Wanted, carrying_out, change_tools, recover
from tests._meanwhile import Meanwhile
from tests._patience import PATIENCE_S

URL = "memory+object://turns"


def value(number: int) -> ToolOffset:
    return ToolOffset(10.0 + number, -3.5, -20.0)


@pytest.fixture
def controller():
    machine = SimpleMachine(tools={1: value(0), 2: value(0)}, selected=1)
    with SimpleController(machine, identity=f"memory+object://{new_operation()}") as controller:
        yield controller


@pytest.fixture
def threads():
    with ThreadPoolExecutor(8) as pool:
        yield pool


def come_to_wait(controller: SimpleController, number: int) -> None:
    """Return as soon as this many threads wait for their turn."""
    deadline = time.monotonic() + PATIENCE_S
    while len(controller._driver.lock._waiting) != number:
        assert time.monotonic() < deadline
        time.sleep(0.001)


# Threads of one program, on one controller.


def test_those_that_wait_get_their_turn_in_the_order_in_which_they_came(controller, threads):
    came: list[int] = []

    def write(number: int) -> None:
        with controller.procedure(f"write {number}", wait_s=PATIENCE_S):
            came.append(number)

    with controller.procedure("a look"):
        ends = []
        for number in range(5):
            ends.append(threads.submit(write, number))
            come_to_wait(controller, number + 1)
        with pytest.raises(BusyError, match="must wait"):  # a client that does not wait is told
            threads.submit(controller.tools.write, 2, value(9), expected=ANY).result(PATIENCE_S)
        assert came == []
    for end in ends:
        end.result(PATIENCE_S)
    assert came == [0, 1, 2, 3, 4]


@pytest.mark.parametrize("usual_s", [0.0, PATIENCE_S])
def test_each_write_says_how_long_it_waits_or_the_connection_does(controller, threads, usual_s):
    controller.patience.wait_s = usual_s
    wait_s = None if usual_s else PATIENCE_S
    held = value(0)
    with controller.procedure("a look"):
        ends = [
            threads.submit(controller.tools.write, 1, value(5), expected=held, wait_s=wait_s),
            threads.submit(controller.tools.select, 2, wait_s=wait_s),
            threads.submit(change_tools, controller, [Wanted(3, value(3), None)], wait_s=wait_s),
            threads.submit(_ordered, controller, wait_s),
        ]
        come_to_wait(controller, 4)
        with pytest.raises(BusyError):
            threads.submit(
                controller.tools.clear, 2, expected=held, then_select=1, wait_s=0
            ).result(PATIENCE_S)
    for end in ends:
        end.result(PATIENCE_S)
    assert [controller.tools.read(tool) for tool in (1, 2, 3, 4)] == [
        value(5),
        value(0),
        value(3),
        value(4),
    ]
    assert controller.tools.selected() == 2


def _ordered(controller: SimpleController, wait_s: float | None) -> None:
    with carrying_out(controller, "J-1", {}, wait_s=wait_s) as order:
        change_tools(controller, [Wanted(4, value(4), None)], order=order)


def test_what_was_written_meanwhile_is_not_overwritten(controller, threads):
    held = controller.tools.read(1)
    with controller.procedure("a look"):
        late = threads.submit(controller.tools.write, 1, value(2), expected=held, wait_s=PATIENCE_S)
        come_to_wait(controller, 1)
        controller.tools.write(1, value(1), expected=held)
    with pytest.raises(robolink.errors.ToolChangedError):
        late.result(PATIENCE_S)
    assert controller.tools.read(1) == value(1)


@pytest.mark.parametrize("released", [False, True])
def test_a_stop_ends_every_wait_with_its_own_error(controller, threads, released):
    with controller.procedure("a calibration"):
        ends = [
            threads.submit(controller.tools.write, 1, value(n), expected=ANY, wait_s=PATIENCE_S)
            for n in range(4)
        ]
        come_to_wait(controller, 4)
        began = time.monotonic()
        controller.stop()
        if released:  # at once: nobody may have slept through it
            controller.release_stop()
        for end in ends:
            with pytest.raises(StoppedError):
                end.result(PATIENCE_S)
        assert time.monotonic() - began < PATIENCE_S / 2
    controller.release_stop()
    assert controller.tools.read(1) == value(0)
    assert controller.tools.write(1, value(1), expected=value(0)).read_back == value(1)


def test_nobody_begins_to_wait_under_a_stop(controller, threads):
    with controller.procedure("a calibration"):
        controller.stop()
        with pytest.raises(StoppedError):
            threads.submit(
                controller.tools.write, 1, value(1), expected=ANY, wait_s=PATIENCE_S
            ).result(PATIENCE_S)


@pytest.mark.parametrize("gate", [False, True])
def test_ctrl_c_ends_the_wait(controller, threads, gate):
    inside, leave = threading.Event(), threading.Event()

    def long() -> None:
        with controller.procedure("a calibration"):
            inside.set()
            leave.wait(PATIENCE_S)

    other = threads.submit(long)
    assert inside.wait(PATIENCE_S)

    def press() -> None:
        come_to_wait(controller, 1)
        _thread.interrupt_main()

    threads.submit(press)
    with pytest.raises(KeyboardInterrupt):
        with controller.uninterrupted() if gate else nullcontext():
            controller.tools.write(1, value(1), expected=ANY, wait_s=PATIENCE_S)
    assert controller._driver.lock._waiting == []
    leave.set()
    other.result(PATIENCE_S)
    assert controller.tools.read(1) == value(0)


def test_the_wait_ends_with_its_time(threads):
    time = Meanwhile()
    with runtime.replaced(time), SimpleController(identity=URL) as controller:
        with controller.procedure("a calibration"):
            late = threads.submit(controller.tools.write, 1, value(1), expected=None, wait_s=7.0)
            with pytest.raises(BusyError, match="another operation is running"):
                late.result(PATIENCE_S)
        assert time.slept_s == pytest.approx(7.0)
        assert controller._driver.lock._waiting == []
        controller.tools.write(1, value(1), expected=None)


@pytest.mark.parametrize("wait_s", [-1.0, nan, inf, 1e9])
def test_no_other_wait_is_taken(controller, wait_s):
    for attempt in (
        lambda: controller.tools.write(1, value(1), expected=ANY, wait_s=wait_s),
        lambda: setattr(controller.patience, "wait_s", wait_s),
        lambda: robolink.connect("epson+sim://no-wait", wait_s=wait_s),
        lambda: change_tools(controller, [Wanted(1, value(1), ANY)], wait_s=wait_s),
    ):
        with pytest.raises(ConfigError, match="is not possible"):
            attempt()
    assert controller.tools.read(1) == value(0)


# A change of several steps belongs to the thread that entered it.


def test_a_second_change_does_not_come_in_between(controller, threads):
    with ToolChange(controller, [Wanted(1, value(1), ANY)], verify=True) as change:
        change.write()
        refused: list[Future[object]] = [
            threads.submit(change_tools, controller, [Wanted(2, value(2), ANY)]),
            threads.submit(controller.tools.write, 2, value(2), expected=ANY),
            threads.submit(recover, controller),
        ]
        for end in refused:
            with pytest.raises(BusyError):
                end.result(PATIENCE_S)
        late = threads.submit(change_tools, controller, [Wanted(2, value(2), ANY)], wait_s=60)
        come_to_wait(controller, 1)
        change.keep("good parts")
    late.result(PATIENCE_S)
    assert (controller.tools.read(1), controller.tools.read(2)) == (value(1), value(2))
    assert controller.outcomes.open_markers() == ()
    written = list(controller.outcomes.recorded(kinds=(EntryKind.WRITE,)))
    assert [entry.tool for entry in written] == [2, 1]
    assert written[0].change != written[1].change  # each has an id of its own


def test_a_change_that_cannot_begin_leaves_nothing_held(controller, threads):
    with controller.procedure("a look"):
        with pytest.raises(BusyError):
            threads.submit(change_tools, controller, [Wanted(1, value(1), ANY)]).result(PATIENCE_S)
    threads.submit(change_tools, controller, [Wanted(1, value(1), ANY)]).result(PATIENCE_S)
    assert controller.outcomes.change == ""


# Other programs, which have the lease.


@contextmanager
def two_programs():
    """Two controllers on one machine, each with its own log in one journal."""
    journal = memory_journal(new_operation())
    machine = SimpleMachine(tools={1: value(0)}, selected=1)
    holders = [replace(this_process(), operator=name) for name in ("Anna", "Bert")]
    with ExitStack() as stack:
        stack.callback(journal.close)
        yield tuple(
            stack.enter_context(
                SimpleController(machine, identity=URL, outcomes=journal.log(URL, holder=holder))
            )
            for holder in holders
        )


def test_another_program_is_waited_for_and_told_about():
    with two_programs() as (anna, bert), ExitStack() as block:
        said: list[str] = []
        bert.patience.tell = said.append
        block.enter_context(anna.outcomes.hold("a calibration"))
        with pytest.raises(LeaseHeldError, match="Anna"):
            bert.tools.write(1, value(1), expected=ANY)
        with runtime.replaced(Meanwhile(block.close)) as _:
            bert.tools.write(1, value(1), expected=value(0), wait_s=9.0)
        (told,) = said
        assert "Anna" in told
        assert "Waiting for up to 9 s." in told
        assert bert.tools.read(1) == value(1)
        anna.tools.write(1, value(2), expected=value(1))  # it was given back


def test_whoever_waits_keeps_others_out_until_he_has_written():
    with two_programs() as (anna, bert):
        with bert.procedure("shift", wait_s=5.0):
            with pytest.raises(LeaseHeldError, match="Bert"):
                anna.tools.write(1, value(1), expected=ANY)
            bert.tools.write(1, value(2), expected=value(0))
        anna.tools.write(1, value(3), expected=value(2))


def test_who_was_faster_is_waited_for_as_well(monkeypatch):
    with two_programs() as (_, bert):
        real, attempts = JournalOutcomeLog.hold, []

        def overtaken(log, purpose):
            attempts.append(purpose)
            if len(attempts) == 1:
                raise LeaseLostError("Anna took it.")
            return real(log, purpose)

        monkeypatch.setattr(JournalOutcomeLog, "hold", overtaken)
        with runtime.replaced(Meanwhile()):
            bert.tools.write(1, value(1), expected=value(0), wait_s=5.0)
        assert len(attempts) == 2


def test_the_wait_for_a_program_ends_with_its_time_or_a_stop():
    with two_programs() as (anna, bert), anna.outcomes.hold("a calibration"):
        time = Meanwhile()
        with runtime.replaced(time), pytest.raises(LeaseHeldError, match="Anna"):
            bert.tools.write(1, value(1), expected=ANY, wait_s=3.0)
        assert time.slept_s == pytest.approx(3.0)
        with runtime.replaced(Meanwhile(bert.stop)), pytest.raises(StoppedError):
            bert.tools.write(1, value(1), expected=ANY, wait_s=3.0)
        assert anna.tools.read(1) == value(0)


def test_motors_and_reset_need_no_lease_and_wait_for_none():
    url = f"epson+sim://{new_operation()}"
    journal = memory_journal(new_operation())
    other = journal.log(url, holder=replace(this_process(), operator="Anna"))
    with robolink.connect(url, outcomes=journal.log(url), wait_s=60) as controller:
        other.ask(lambda: robolink.model.Identity(controller.outcomes.identity, url, url))
        with other.hold("a calibration"):
            controller.motors(False)
            controller.reset_fault()
            with pytest.raises(LeaseHeldError), runtime.replaced(Meanwhile()):
                controller.tools.write(1, value(1), expected=ANY)


def test_the_owner_of_a_mailbox_is_waited_for():
    url = f"softmotion+sim://{new_operation()}"
    logs = [memory_journal(new_operation()).log(url) for _ in range(2)]
    first = robolink.connect(url, outcomes=logs[0])
    with robolink.connect(url, outcomes=logs[1]) as second:
        first.tools.write(1, value(1), expected=ANY)  # owns the mailbox until it is closed
        with pytest.raises(LeaseHeldError, match="commands the PLC"):
            second.tools.write(1, value(2), expected=ANY)
        with runtime.replaced(Meanwhile(first.close)):
            second.tools.write(1, value(2), expected=value(1), wait_s=5.0)


# Connecting, to a controller that lets one client in.


def test_connecting_waits_for_whoever_is_logged_in(monkeypatch):
    url = f"epson+sim://{new_operation()}"
    first = robolink.connect(url)
    with pytest.raises(RobolinkError):
        robolink.connect(url, timeout_s=0.1)
    said: list[str] = []
    time = Meanwhile(first.close)
    monkeypatch.setattr(time, "random_bytes", bytes)  # the shortest pause is drawn
    with runtime.replaced(time):
        second = robolink.connect(url, timeout_s=0.1, wait_s=5, tell=said.append)
    assert time.slept_s == pytest.approx(0.25)
    with second:
        assert second.patience.wait_s == 5
        assert second.status().ready
    (told,) = said
    assert "does not answer the login" in told
    assert "Waiting for up to 5 s." in told


def test_connecting_does_not_wait_for_ever():
    url = f"epson+sim://{new_operation()}"
    time = Meanwhile()
    with robolink.connect(url):
        with runtime.replaced(time), pytest.raises(RobolinkError, match="does not answer"):
            robolink.connect(url, timeout_s=0.1, wait_s=2)
    assert time.slept_s == pytest.approx(2.0)


@pytest.mark.soak
@pytest.mark.parametrize("kind", ["epson", "softmotion"])
def test_what_many_connections_add_up_one_after_another_is_all_there(kind, threads):
    url = f"{kind}+sim://{new_operation()}"
    with robolink.connect(url) as controller:
        controller.tools.write(4, ToolOffset(), expected=ANY)

    def add() -> None:
        for _ in range(4):
            with robolink.connect(url, timeout_s=1, wait_s=PATIENCE_S) as controller:
                with controller.procedure("add 1 mm"):
                    old = controller.tools.read(4)
                    assert old is not None
                    controller.tools.write(4, replace(old, x_mm=old.x_mm + 1), expected=old)

    for end in [threads.submit(add) for _ in range(4)]:
        end.result(PATIENCE_S)
    with robolink.connect(url) as controller:
        assert controller.tools.read(4) == ToolOffset(16.0)
