"""The identity of an EPSON controller is the same over TCP and in the same process."""

import pytest
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction, FaultPlan
from robolink_simulators.hosting.in_process.epson import register, unregister
from robolink_simulators.hosting.streams.epson import serve_serial, serve_tcp
from robolink_simulators.testkit.media import served

import robolink
from robolink.errors import OutcomeUnknownError
from robolink.journal import open_journal
from robolink.model import ANY, Marker, MarkerKind, ToolOffset
from robolink.timing import wall_label


@pytest.fixture
def simulator():
    return EpsonSimulator(seed=7)


def spellings(host):
    """Return two URLs of one served simulator."""
    port = host.url.rpartition(":")[2]
    return f"epson+tcp://127.0.0.1:{port}", f"epson+tcp://localhost:{port}"


def leave_open(url):
    """Stop in the middle of a write, as a killed process does."""
    controller = robolink.connect(url)
    marker = Marker("op-1", MarkerKind.SET, "TLSet 1, XY(...)", wall_label(), {"tool": 1})
    controller.outcomes.begin(marker)
    controller.close()
    return marker


def asked(simulator):
    return [text for _, direction, text in simulator.log if direction == ">"]


def test_what_one_spelling_left_open_blocks_under_the_other(simulator):
    with serve_tcp(simulator) as host:
        by_number, by_name = spellings(host)
        marker = leave_open(by_number)
        with robolink.connect(by_name) as controller:
            assert controller.outcomes.open_markers() == (marker,)
            assert by_number in controller.outcomes.remarks[0]
            with pytest.raises(OutcomeUnknownError):
                controller.require_settled("Move XY(...)")
        with robolink.connect(by_name) as controller:
            assert controller.outcomes.open_markers() == (marker,)
            assert controller.outcomes.remarks == ()


def test_another_simulator_on_the_same_port_inherits_nothing():
    with serve_tcp(EpsonSimulator()) as host:
        url, port = host.url, int(host.url.rpartition(":")[2])
        leave_open(url)
    with serve_tcp(EpsonSimulator(), "127.0.0.1", port), robolink.connect(url) as controller:
        assert controller.outcomes.open_markers() == ()
        assert "last time it was" in controller.outcomes.remarks[0]
    assert len(open_journal().open_markers()) == 1


def test_a_restart_does_not_make_another_controller_of_it(tmp_path):
    state = tmp_path / "flash.json"
    with serve_tcp(EpsonSimulator(state_path=state)) as host:
        marker = leave_open(host.url)
    with (
        serve_tcp(EpsonSimulator(state_path=state)) as host,
        robolink.connect(host.url) as controller,
    ):
        assert controller.outcomes.open_markers() == (marker,)


def test_asking_who_it_is_takes_two_queries_and_waits_until_it_must(simulator):
    with serve_tcp(simulator) as host:
        with robolink.connect(host.url) as controller:
            controller.status()
            controller.stop()
            assert "$GetContNo" not in asked(simulator)
            before = controller.exchanges
            for _ in range(2):
                controller.outcomes.open_markers()
                assert controller.exchanges - before == 4  # each twice: it was never met before
        with robolink.connect(host.url) as controller:
            before = controller.exchanges
            controller.outcomes.open_markers()
            assert controller.exchanges - before == 2


@pytest.mark.fault("F07")
@pytest.mark.parametrize("met_before", [False, True])
@pytest.mark.parametrize(
    "fault",
    [
        Fault(FaultAction.GARBLE_REPLY, match="GetContNo", position=13, bit=0),
        Fault(FaultAction.GARBLE_REPLY, match="GetRobotSerial", position=20, bit=0),
    ],
    ids=["number", "serial"],
)
def test_a_write_that_ends_after_an_answer_came_bent_is_met_by_the_next_run(
    simulator, fault, met_before
):
    url = register("bent-identity", simulator, clock=ManualClock())
    try:
        if met_before:
            with robolink.connect(url) as controller:
                controller.outcomes.open_markers()
        simulator.faults = FaultPlan([fault])
        marker = leave_open(url)
        assert simulator.faults.pending == ()
        with robolink.connect(url) as controller:
            assert controller.outcomes.open_markers() == (marker,)
            assert controller.outcomes.remarks == ()
    finally:
        unregister("bent-identity")


@pytest.mark.fault("F08")
def test_two_swapped_digits_of_a_serial_number_make_no_other_controller_of_it(simulator):
    """A checksum by XOR does not detect swapped digits (docs/remote-rs232.md)."""
    query = "Print RobotSerial$"
    with serve_serial(simulator) as host:
        simulator.faults = FaultPlan([Fault(FaultAction.SWAP_BYTES, match=query)])
        with robolink.connect(host.url) as controller:
            assert controller.outcomes.identity == f"epson:{simulator.machine.serial}"
        assert simulator.faults.pending == ()


def test_older_firmware_is_asked_in_its_command_window_once_it_is_ready(options):
    simulator = EpsonSimulator(options=options(extended_queries=False))
    simulator.panel.start_production()
    with serve_tcp(simulator) as host, robolink.connect(host.url) as controller:
        place = f"epson@127.0.0.1:{host.url.rpartition(':')[2]}"
        assert controller.outcomes.identity == place
        assert not any(text.startswith("$Execute") for text in asked(simulator))
        controller.stop()
        assert controller.outcomes.identity == f"epson:{simulator.machine.serial}"


def test_a_controller_that_is_busy_is_taken_for_whom_it_was_the_last_time(simulator):
    clock = ManualClock()
    with served(simulator, clock=clock) as url:
        with robolink.connect(url) as controller:
            name = controller.outcomes.identity
        # An Execute of a client that has left keeps the controller from answering.
        link = simulator.connect(clock.now_ns())
        link.receive(b'$Login,\r\n$Execute,"Move Here +X(-20)"\r\n', clock.now_ns())
        link.receive(b"", clock.now_ns())
        with robolink.connect(url) as controller:
            assert controller.outcomes.identity == name


def test_an_unconditional_write_goes_on_record_under_the_identity(simulator):
    with serve_tcp(simulator) as host, robolink.connect(host.url) as controller:
        controller.tools.write(3, ToolOffset(1), expected=ANY)
        name = f"epson:C-{simulator.machine.serial}/{simulator.machine.serial}"
        assert {entry.controller for entry in open_journal().entries()} == {name}
