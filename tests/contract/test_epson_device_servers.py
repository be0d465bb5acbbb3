"""Remote RS232 through a device server: raw TCP, and RFC 2217 by pyserial's own server part."""

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_serial

import robolink
from robolink.errors import ConnectError, RobolinkError
from robolink.model import ToolOffset
from tests.contract._device_server import device_server


# pyserial 3.5 starts its RFC 2217 reader with a deprecated call.
@pytest.mark.filterwarnings("ignore:set(Daemon|Name):DeprecationWarning")
@pytest.mark.parametrize("kind", ["socket", "rfc2217"])
def test_a_tool_is_written_and_read_back_through_a_device_server(kind):
    simulator = EpsonSimulator(seed=3)
    with serve_serial(simulator, clock=ScaledClock(40.0)) as line:
        with device_server(line.cable.near, rfc2217=kind == "rfc2217") as port:
            url = f"epson+serial://127.0.0.1:{port}?baud=115200&server={kind}"
            for x_mm in (3.5, 6.25):  # 03 and 06 begin and end frames elsewhere
                with robolink.connect(url) as controller:
                    new = ToolOffset(x_mm, -2.0, -20.0, 0.0, 0.0, 0.0)
                    controller.tools.write(3, new, expected=controller.tools.read(3))
                    assert controller.tools.read(3) == new


def test_a_device_server_that_goes_ends_the_session():
    with serve_serial(EpsonSimulator(seed=3), clock=ScaledClock(40.0)) as line:
        with device_server(line.cable.near, rfc2217=False) as port:
            controller = robolink.connect(
                f"epson+serial://127.0.0.1:{port}?baud=115200&server=socket", timeout_s=0.5
            )
        with pytest.raises(RobolinkError):
            controller.tools.read(1)
        controller.close()


def test_nobody_at_the_port_of_a_device_server_is_no_connection():
    with pytest.raises(ConnectError):
        robolink.connect("epson+serial://127.0.0.1:1?baud=9600&server=socket")
