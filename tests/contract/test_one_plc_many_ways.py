"""One simulated PLC on five links at once: a job left open on one shows on all."""

from contextlib import ExitStack

import pytest
from robolink_simulators.hosting.fieldbus.canopen_node import CanPlace, serve_canopen
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_rtu, serve_modbus_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.errors import LeaseHeldError, OutcomeUnknownError
from robolink.journal import open_journal
from robolink.model import ToolOffset
from robolink.transport import parse_url


class Killed(BaseException):
    """The end of a process, which no error handler sees."""


@pytest.fixture
def ways():
    """The URLs of one PLC, by link."""
    simulator = SoftMotionSimulator(seed=5)
    with ExitStack() as stack:
        tcp = stack.enter_context(serve_modbus_tcp(simulator)).url
        rtu = stack.enter_context(serve_modbus_rtu(simulator)).url
        can = stack.enter_context(serve_canopen(simulator, CanPlace("virtual", "many-ways"))).url
        by_name = tcp.replace("127.0.0.1", "localhost")
        yield {"number": tcp, "name": by_name, "RTU": rtu, "CAN": can}


def connect(url):
    # Otherwise the journal of an in-process bus would end with it.
    return robolink.connect(url, outcomes=open_journal().log(url))


def kill_a_calibration(url):
    """Leave tool 0 selected and the marker open, as a process does that is killed at a touch."""
    controller = connect(url)
    with pytest.raises(Killed), controller.preserved("calibration of tool 1"):
        controller.tools.select(0)
        # The link dies with the process, so that nothing can be restored.
        controller._mailbox.wire.close()
        raise Killed
    controller.close()


@pytest.mark.parametrize(
    "killed", ["number", pytest.param("name", marks=pytest.mark.soak), "RTU", "CAN"]
)
def test_a_calibration_that_was_killed_blocks_whichever_way_the_next_one_comes(ways, killed):
    kill_a_calibration(ways[killed])
    for url in ways.values():
        with connect(url) as controller:
            (marker,) = controller.outcomes.open_markers()
            assert (marker.request, controller.tools.selected()) == ("calibration of tool 1", 0)
            with pytest.raises(OutcomeUnknownError, match="calibration of tool 1"):
                controller.require_settled("a jog")
    ((identity, _),) = open_journal().open_markers()
    assert len(open_journal().addresses_of(identity)) == len(ways)


def test_who_works_on_one_way_is_named_on_the_others(ways):
    with connect(ways["CAN"]) as working, working.outcomes.hold("a calibration"):
        for way in ("number", "name", "RTU"):
            with (
                connect(ways[way]) as other,
                pytest.raises(LeaseHeldError, match="a calibration"),
                other.outcomes.hold("a jog"),
            ):
                pass


def test_a_tool_written_on_one_way_is_on_record_for_the_others(ways):
    with connect(ways["RTU"]) as controller:
        controller.tools.write(7, ToolOffset(1.5), expected=controller.tools.read(7))
    for url in ways.values():
        with connect(url) as controller:
            newest = next(controller.outcomes.recorded(tool=7))
            assert newest.details["value"][0] == 1.5


def test_a_url_names_the_far_end_as_the_link_does(ways):
    for url in (*ways.values(), ways["number"] + "?unit=3"):
        with connect(url) as controller:
            assert parse_url(url).address == controller.identity
    assert parse_url("plc+modbus-tcp://h?map=a&unit=255").address == "plc+modbus-tcp://h:502"
    assert parse_url("softmotion+modbus-rtu:///dev/ttyS0?unit=2&command=64&baud=9600").address == (
        "softmotion+modbus-rtu:///dev/ttyS0?unit=2&command=64"
    )
