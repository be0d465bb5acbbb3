"""An EPSON controller's answer cut, split and altered at each byte; a request altered.

Text has no checksum (docs/reference/epson.md 1.1). Reading back finds what no check can see.
"""

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.hosting.streams.epson import serve_tcp

import robolink
from robolink import ToolOffset
from robolink.errors import (
    OutcomeUnknownError,
    RobolinkError,
    TransportClosedError,
    TransportTimeoutError,
)
from robolink.model import Verdict
from robolink.transaction import Wanted, change_tools, recover
from tests.faults._bending_relay import BendingRelay

OLD, NEW = ToolOffset(12.5, -3.25, -20.0), ToolOffset(12.75, -3.0, -20.5)
READ, WRITE = "TLSet(1)", "TLSet 1"
WRITTEN = b"#Execute,0\r\n"


@pytest.fixture
def controlled(serve_simulator):
    """A controller in process, in simulated time, and its link."""
    simulator = EpsonSimulator(seed=5)
    simulator.machine.tools.set(1, OLD)
    return simulator, serve_simulator(simulator).url


def length_of(simulator, url, text):
    """Return the length of the answer to a request that contains ``text``."""
    with robolink.connect(url) as controller:
        assert controller.tools.read(1) == OLD
    log = [shown for _, _, shown in simulator.log]
    (asked, *_) = [n for n, shown in enumerate(log) if text in shown]
    return len(log[asked + 1].encode()) + 2


@pytest.mark.fault("F04")
def test_f04_an_answer_that_ends_at_any_byte_is_a_time_out_that_names_the_bytes(controlled):
    simulator, url = controlled
    for at in range(1, length_of(simulator, url, READ) - 2):
        simulator.faults.add(Fault(FaultAction.TRUNCATE_REPLY, match=READ, position=at))
        with robolink.connect(url, timeout_s=0.3) as controller:
            with pytest.raises(TransportTimeoutError, match=f"sent only {at} bytes") as caught:
                controller.tools.read(1)
            assert len(caught.value.raw) == at
            with pytest.raises(TransportClosedError):
                controller.tools.read(1)
    assert simulator.faults.pending == ()


@pytest.mark.fault("F04")
def test_f04_an_acknowledgement_that_ends_at_any_byte_leaves_the_write_unproved(controlled):
    simulator, url = controlled
    # It is complete from the first byte of the line end on.
    for at in range(1, len(WRITTEN) - 1):
        simulator.machine.tools.set(1, OLD)
        simulator.faults.add(Fault(FaultAction.TRUNCATE_REPLY, match=WRITE, position=at))
        with robolink.connect(url, timeout_s=0.3) as controller:
            with pytest.raises(OutcomeUnknownError):
                controller.tools.write(1, NEW, expected=OLD)
            (marker,) = controller.outcomes.open_markers()
        with robolink.connect(url) as controller:
            finding = controller.resolver.examine(marker)
            assert finding.verdict is Verdict.DONE
            controller.resolver.settle(finding)
    writes = [text for _, way, text in simulator.log if way == ">" and f"{WRITE}, XY" in text]
    assert len(writes) == len(WRITTEN) - 2


@pytest.mark.fault("F05")
def test_f05_an_answer_split_at_any_byte_is_the_same_over_a_socket():
    simulator = EpsonSimulator(seed=5)
    simulator.machine.tools.set(1, OLD)
    with serve_tcp(simulator, clock=ScaledClock(40.0)) as host:
        length = length_of(simulator, host.url, READ)
        with robolink.connect(host.url) as controller:
            for at in range(1, length):
                split = Fault(FaultAction.SPLIT_REPLY, match=READ, position=at, seconds=0.1)
                simulator.faults.add(split)
                assert controller.tools.read(1) == OLD
    assert len(simulator.faults.fired) == length - 1


@pytest.mark.fault("F05")
def test_f05_an_answer_in_single_bytes_is_the_same_over_a_socket():
    simulator = EpsonSimulator(seed=5)
    simulator.machine.tools.set(1, OLD)
    with serve_tcp(simulator, clock=ScaledClock(40.0)) as host:
        port = int(host.url.rpartition(":")[2])
        with BendingRelay(port, bytewise=True) as relay:
            with robolink.connect(host.url.replace(str(port), str(relay.port))) as controller:
                assert controller.tools.read(1) == OLD
                controller.tools.write(1, NEW, expected=OLD)
                assert controller.tools.read(1) == NEW


def put_right(simulator, url):
    """Do what a person does after an error: reset and recover."""
    with robolink.connect(url) as controller:
        if simulator.condition.error:
            controller.reset_fault()
        recover(controller)


@pytest.mark.fault("F07")
@pytest.mark.parametrize(
    ("step", "told"),
    [(3, 4), pytest.param(1, 15, marks=pytest.mark.soak)],
    ids=["every third", "every one"],
)
def test_f07_no_request_with_a_bent_bit_leaves_a_value_that_nobody_noticed(step, told):
    simulator = EpsonSimulator(seed=5)
    bent_at = [0, 0]

    def bend(data):
        begin = data.find(b"XY(")
        if begin < 0 or data.startswith(b"#") or b"TLSet 1" not in data or not bent_at[1]:
            return data
        bent_at[1] = 0
        bent = bytearray(data)
        # Another bit at each place; the lower bits make a digit another digit.
        bent[begin + bent_at[0]] ^= 1 << (bent_at[0] * 5 % 4)
        return bytes(bent)

    refused = 0
    with serve_tcp(simulator, clock=ScaledClock(40.0)) as host:
        port = int(host.url.rpartition(":")[2])
        with BendingRelay(port, to_server=bend) as relay:
            url = host.url.replace(str(port), str(relay.port))
            for place in range(0, len("XY(12.750, -3.000, -20.500"), step):
                simulator.machine.tools.set(1, OLD)
                bent_at[:] = [place, 1]
                said = None
                with robolink.connect(url, timeout_s=1.0) as controller:
                    try:
                        change_tools(controller, [Wanted(1, NEW, OLD)])
                    except RobolinkError as error:
                        said = error
                assert bent_at[1] == 0, "nothing was bent"
                if said is not None:
                    refused += 1
                    put_right(simulator, host.url)
                held = simulator.machine.tools.get(1)
                assert held == (NEW if said is None else OLD), f"place {place}: {said}"
    # An altered blank may still be read as a blank; digits never.
    assert refused > told
