"""Remote RS232 where it differs from Remote Ethernet: silence, dialects, case, lost steps."""

import os
import select
import threading
from contextlib import contextmanager, suppress

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_serial
from robolink_simulators.hosting.streams.serial_host import SerialCable

import robolink
from robolink.controllers import EpsonController
from robolink.errors import (
    ConfigError,
    ConnectError,
    LoginUnansweredError,
    NotReadyError,
    NotReadyReason,
    ReadBackError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportTimeoutError,
)
from robolink.model import MotionProfile, ToolOffset, WorkBox
from robolink.transaction import Wanted, change_tools

BOX = WorkBox(-900, 900, -900, 900, -900, 900)
NEW = ToolOffset(12.5, -3.25, -20.0, 0.0, 0.0, 0.0)


@contextmanager
def line(**habits):
    simulator = EpsonSimulator(seed=3, options=EpsonOptions(**habits))
    with serve_serial(simulator, clock=ScaledClock(40.0)) as host:
        yield simulator, host.url


@pytest.mark.parametrize("numbers", ["binary", "ascii_hex"])
@pytest.mark.parametrize(
    ("nak_code", "flags", "port_bytes"), [("digits", 10, 1), ("binary", 11, 2)]
)
def test_every_reading_of_the_manual_is_spoken_at_both_ends(numbers, nak_code, flags, port_bytes):
    habits = {
        "rs232_numbers": numbers,
        "rs232_nak_code": nak_code,
        "rs232_status_flags": flags,
        "rs232_word_port_bytes": port_bytes,
        "rs232_eot_answer": "ack",
    }
    with line(**habits) as (simulator, url), robolink.connect(url) as controller:
        assert controller.status().ready
        assert controller.tools.read(1) is not None
        simulator.machine.inputs.set(17, True)
        assert controller.io.read_input_word(1) == 2  # type: ignore[union-attr]
        with pytest.raises(RejectedError) as caught:
            controller.io.read_input(65535)  # type: ignore[union-attr]
        assert caught.value.code == 12


def test_numbers_that_are_written_otherwise_are_noticed_on_connecting():
    with line(rs232_numbers="ascii_hex") as (_, url):
        with pytest.raises((TransportTimeoutError, RemoteProtocolError)) as caught:
            robolink.connect(url.replace("numbers=ascii_hex", "numbers=binary"), timeout_s=0.5)
        assert "numbers=ascii_hex" in caught.value.remedy


def test_nothing_moves_over_a_line_that_could_not_stop_it():
    with line(rs232_letters="documented") as (simulator, url):
        with robolink.connect(url) as controller:
            controller.motors(True)
            group = controller.groups[0]
            with pytest.raises(NotReadyError) as caught:
                group.move_to(group.pose(), MotionProfile(), box=BOX)
            assert caught.value.reason is NotReadyReason.NO_ABORT
            with pytest.raises(NotReadyError):
                controller.execute_raw("Go P1")  # type: ignore[attr-defined]
            controller.tools.write(1, NEW, expected=controller.tools.read(1))
            assert controller.tools.read(1) == NEW
            controller.stop()
        assert not [text for _, way, text in simulator.log if way == ">" and "Go " in text]


@pytest.mark.fault("F02")
def test_f02_a_late_answer_is_never_the_answer_to_a_later_question():
    """The first session times out while its answer is still on its way; the line stays."""
    from robolink_simulators.faults import Fault, FaultAction

    with line() as (simulator, url):
        with robolink.connect(url, timeout_s=0.3) as controller:
            tool = controller.tools.read(1)
            late = Fault(FaultAction.DELAY, match="TLSet(1)", seconds=40.0)  # one real second
            simulator.faults.add(late)
            with pytest.raises(RobolinkError):
                controller.tools.read(1)
        assert _read_on_a_new_session(url, 2) != tool
        assert _read_on_a_new_session(url, 1) == tool


def _read_on_a_new_session(url, number):
    """An answer that arrives while the line is opened may cost a session, never a wrong value."""
    for _ in range(3):
        with (
            suppress(RemoteProtocolError, LoginUnansweredError),
            robolink.connect(url) as controller,
        ):
            return controller.tools.read(number)
    raise AssertionError


@pytest.mark.fault("F08")
def test_f08_a_write_that_arrives_with_two_bytes_swapped_is_found_and_put_back():
    """The checksum does not detect it: 12.500 and 21.500 have the same."""
    cable = SerialCable()
    try:
        with line() as (_, url), _relay(cable, url, b"12.500", b"21.500"):
            swapped = url.replace(url[len("epson+serial://") :].partition("?")[0], cable.near)
            with robolink.connect(swapped) as controller:
                before = controller.tools.read(1)
                assert before is not None
                with pytest.raises(ReadBackError):
                    change_tools(controller, [Wanted(1, NEW, before)])
                assert controller.tools.read(1) == before
    finally:
        cable.close()


@contextmanager
def _relay(cable, url, find, put):
    """Carry the bytes between a cable and the port of ``url``, and alter one text on the way."""
    import tty

    port = os.open(url[len("epson+serial://") :].partition("?")[0], os.O_RDWR | os.O_NOCTTY)
    near = os.open(cable.far, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(port)
    tty.setraw(near)
    over, end = os.pipe()

    def carry():
        while True:
            ready, _, _ = select.select([port, near, over], [], [])
            if over in ready:
                return
            if near in ready:
                os.write(port, os.read(near, 4096).replace(find, put))
            if port in ready:
                os.write(near, os.read(port, 4096))

    thread = threading.Thread(target=carry, daemon=True)
    thread.start()
    try:
        yield
    finally:
        os.write(end, b"x")
        thread.join()
        for descriptor in (port, near, over, end):
            os.close(descriptor)


@pytest.mark.parametrize("letters", ["documented", "guessed"])
def test_what_a_line_cannot_tell_hides_no_flag(letters):
    with line(rs232_letters=letters) as (simulator, url), robolink.connect(url) as controller:
        assert isinstance(controller, EpsonController)
        assert controller.condition()["selected_tool"] == 1
        simulator.panel.start_production()
        found = controller.condition()
        assert controller.status().running
        with pytest.raises(RejectedError) as caught:
            controller.published_tools()
        assert caught.value.code == 11
        assert "Remote Ethernet" in caught.value.remedy
        simulator.panel.press_estop()
        assert controller.condition()["text"] == ""
        assert controller.status().emergency_stop
    assert found["alarms"] is None
    assert found["selected_tool"] is found["published_selected_tool"] is None
    assert found["motors_on"] is found["power"] is found["preferences"] is None


def test_a_single_variable_is_read_over_a_line_and_an_array_is_refused_by_name():
    with line() as (_, url), robolink.connect(url) as controller:
        assert isinstance(controller, EpsonController)
        variables = controller.variables
        assert variables.read("g_Byte", "Byte") == 0
        with pytest.raises(RejectedError, match="several values"):
            variables.read_array("g_Long_table", (0, 0), "Long", count=3)
        assert variables.read("g_Byte", "Byte") == 0


def test_a_cable_at_whose_far_end_nobody_reads_loses_it_and_can_be_unplugged():
    cable = SerialCable()
    near = os.open(cable.near, os.O_RDWR | os.O_NOCTTY)

    def send_and_unplug():
        for _ in range(16):
            os.write(near, bytes(4096))
        cable.close()

    thread = threading.Thread(target=send_and_unplug, daemon=True)
    thread.start()
    thread.join(20)
    assert not thread.is_alive()
    os.close(near)


def test_a_line_that_never_falls_silent_is_not_opened():
    cable = SerialCable()
    far = os.open(cable.far, os.O_RDWR | os.O_NOCTTY)
    ended = threading.Event()

    def chatter():
        while not ended.wait(0.02):
            os.write(far, b"U")

    thread = threading.Thread(target=chatter)
    thread.start()
    try:
        with pytest.raises(RobolinkError, match="is never quiet"):
            robolink.connect(f"epson+serial://{cable.near}?baud=9600")
    finally:
        ended.set()
        thread.join()
        os.close(far)
        cable.close()


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("epson+serial:///dev/ttyS77", "baud"),
        ("epson+serial:///dev/ttyS77?baud=9600&letters=all", "letters"),
        ("epson+serial://127.0.0.1:9?baud=9600", "server"),
        ("epson+serial:///dev/ttyS77?baud=9600&nak=1", "nak"),
    ],
)
def test_an_option_that_is_missing_or_wrong_is_named(url, said):
    with pytest.raises(ConfigError, match=said):
        robolink.connect(url)


def test_a_port_that_is_missing_is_no_connection():
    with pytest.raises(ConnectError):
        robolink.connect("epson+serial:///dev/ttyS77x?baud=9600")
