"""``robolink stop`` up to its frame, and ``robolink status`` as a whole, against ``import click``.

The far ends are simulators behind a listener that notes when each piece came in and how long
the simulator took for its answer; that time is the peer's and is subtracted. The cell file names
the controller, and the journal, the state folder and bytecode are there, as after a day of work.
For ``status`` there are two cell files: one with the URL alone, and one with all that a shop says.
"""

import os
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from statistics import median
from time import monotonic_ns, perf_counter_ns
from urllib.parse import urlsplit

from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.fieldbus.canopen_node import CanPlace, serve_canopen
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.fieldbus.opcua import serve_opcua
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from benchmarks.table import Amount, Figure
from robolink.model import Secret
from robolink.protocols.mailbox import COMMAND, COMMAND_WORDS, Opcode

ROUNDS = 15
_WHOLE = """
robot = "T6-602S"
tool = 1
remote_timeout_s = 60.0
remote_timeout_confirmed_by = "Anna, on the controller's page"
box_mm = 30.0
max_change_mm = 1.5
people = { "4711" = "operator", "Anna" = "engineer" }
[cells.%(name)s.stations.post]
kind = "pin"
x_mm = 300.0
y_mm = 0.0
z_mm = 100.0
[cells.%(name)s.stations.gate]
kind = "beams"
z_mm = 120.0
beams = [
  { input = 1, x_mm = 300.0, y_mm = 50.0, direction_deg = 45.0 },
  { input = 2, x_mm = 300.0, y_mm = 50.0, direction_deg = 135.0 },
]
[cells.%(name)s.stations.camera]
kind = "camera"
x_mm = 280.0
y_mm = 40.0
z_mm = 130.0
"""
"""All optional parts of a cell file. The positions of the stations do not matter."""

_CAN_PORT = 43217
_OPCUA_GOAL = 18.0


class Tap:
    """Passes bytes on to a served simulator and keeps the time.

    Args:
        port: Of the simulator.
        is_stop: Tells the piece that is the frame of a stop.

    Attributes:
        port: Where clients connect to.
        frame_ns: When the first such frame came in, 0 for not yet.
        waited_ns: How long the far end took for its answers until then.
    """

    def __init__(self, port: int, is_stop: Callable[[bytes], bool]) -> None:
        self._far, self._is_stop = port, is_stop
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listening.getsockname()[1]
        self.frame_ns = self.waited_ns = 0
        threading.Thread(target=self._accept, daemon=True).start()

    def reset(self) -> None:
        """Forget what was seen."""
        self.frame_ns = self.waited_ns = 0

    def close(self) -> None:
        """Listen no more."""
        self._listening.close()

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._listening.accept()
            except OSError:
                return
            self._pass_on(near)

    def _pass_on(self, near: socket.socket) -> None:
        """Serve one connection; requests and answers take turns in both protocols."""
        with near, socket.create_connection(("127.0.0.1", self._far)) as far:
            for one in (near, far):
                one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            while request := near.recv(65536):
                came_ns = perf_counter_ns()
                if self._is_stop(request) and not self.frame_ns:
                    self.frame_ns = came_ns
                far.sendall(request)
                answer = far.recv(65536)
                if not self.frame_ns:
                    self.waited_ns += perf_counter_ns() - came_ns
                near.sendall(answer)


def measure_stopping() -> Iterator[Figure]:
    """Yield the figures; the commands that are compared are run in turn."""
    beside = Path(sys.executable).with_name("robolink")
    robolink = str(beside) if beside.exists() else shutil.which("robolink") or "robolink"
    floor = [sys.executable, "-c", "import click"]
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        stack.enter_context(_working_in(folder))
        epson = stack.enter_context(serve_tcp(EpsonSimulator(seed=1)))
        plc = stack.enter_context(serve_modbus_tcp(SoftMotionSimulator(seed=1)))
        aborts = Tap(_port(epson.url), lambda piece: b"$Abort" in piece)
        # Function 16 with the whole command block: nothing but the stop writes it.
        stops = Tap(_port(plc.url), lambda piece: piece[7:8] == b"\x10")
        stack.callback(aborts.close)
        stack.callback(stops.close)
        urls = {
            "tcp": f"epson+tcp://127.0.0.1:{aborts.port}",
            "modbus": f"softmotion+modbus-tcp://127.0.0.1:{stops.port}",
        }
        (folder / "robolink.toml").write_text(_cells(urls))
        for name in urls:
            _run([robolink, "-c", name, "status"])
        for name, tap, what in (
            ("tcp", aborts, "robolink stop to the Abort frame, EPSON over TCP"),
            ("modbus", stops, "robolink stop to the 2003 frame, PLC over Modbus TCP"),
        ):
            command = [robolink, "-c", name, "stop"]
            pairs = [(_run(floor), _to_frame(command, tap)) for _ in range(ROUNDS)]
            yield _figure(what, pairs, 2.50)
        yield from _over_canopen(robolink, floor)
        yield from _over_opcua(robolink, floor)
        for name, what in (
            ("tcp", "EPSON over TCP"),
            ("modbus", "PLC over Modbus TCP"),
            ("tcp-whole", "EPSON over TCP, cell file of a shop"),
            ("modbus-whole", "PLC over Modbus TCP, cell file of a shop"),
        ):
            command = [robolink, "-c", name, "status"]
            _run(command)  # the cell file is checked only once
            pairs = [(_run(floor), _run(command)) for _ in range(ROUNDS)]
            yield _figure(f"robolink status, {what}", pairs, 5.00)


def _cells(urls: dict[str, str]) -> str:
    """Return a cell file that names each far end twice: barely, and as a shop does."""
    said = [f'[cells.{name}]\nurl = "{url}"\n' for name, url in urls.items()]
    for name, url in urls.items():
        whole = _WHOLE % {"name": f"{name}-whole"}
        if name != "tcp":  # the PLC names its kinematics where a controller names its robot
            whole = whole.replace("T6-602S", "Kin_Scara3_Z")
        said.append(f'[cells.{name}-whole]\nurl = "{url}"{whole}')
    return "".join(said)


def _over_canopen(robolink: str, floor: list[str]) -> Iterator[Figure]:
    """Measure a stop over CANopen; the node's answers are not subtracted."""
    simulator = SoftMotionSimulator(seed=1)
    place = CanPlace("udp_multicast", "239.74.163.9", port=_CAN_PORT)
    with serve_canopen(simulator, place) as host:
        pairs = _until_told([robolink, "-c", host.url, "stop"], floor, simulator)
    yield _figure("robolink stop to the 2003 frame, PLC over CANopen", pairs, 5.00)


def _over_opcua(robolink: str, floor: list[str]) -> Iterator[Figure]:
    """Measure a stop over OPC UA, plain by its bytes, and encrypted.

    What the server takes to answer is subtracted only where nothing is encrypted.
    """
    simulator = SoftMotionSimulator(seed=1)
    what = "robolink stop to the 2003 frame, PLC over OPC UA"
    with serve_opcua(simulator) as host:
        tap = Tap(_port(host.url), _stops_over_opcua)
        url = host.url.replace(str(_port(host.url)), str(tap.port), 1)
        command = [robolink, "-c", url, "stop"]
        _run(command)
        pairs = [(_run(floor), _to_frame(command, tap)) for _ in range(ROUNDS)]
        tap.close()
        yield _figure(f"{what}, not encrypted", pairs, _OPCUA_GOAL)
    users = {"bench": Secret("of a benchmark")}
    with serve_opcua(simulator, users=users) as host, _password(users["bench"]):
        command = [robolink, "-c", host.secured_url, "stop"]
        _run(command)  # makes this computer's certificate
        pairs = _until_told(command, floor, simulator)
        yield _figure(f"{what}, encrypted and logged in", pairs, _OPCUA_GOAL)


@contextmanager
def _password(secret: Secret) -> Iterator[None]:
    """Give commands a password; an EPSON that wants none would refuse the next one for it."""
    os.environ["ROBOLINK_PASSWORD"] = secret.reveal()
    try:
        yield
    finally:
        del os.environ["ROBOLINK_PASSWORD"]


def _stops_over_opcua(piece: bytes) -> bool:
    """Return whether a message writes the array of a command block that stops."""
    array = piece.partition(COMMAND_WORDS.to_bytes(4, "little"))[2][: 2 * COMMAND_WORDS]
    at = 2 * COMMAND["opcode"].word
    return int.from_bytes(array[at : at + 2], "little") == Opcode.STOP


def _until_told(
    command: list[str], floor: list[str], simulator: SoftMotionSimulator
) -> list[tuple[float, float]]:
    """Return the times of floor and stop in ms; the simulator's log tells when 2003 came in."""
    pairs = []
    for _ in range(ROUNDS):
        before, began_ns = _run(floor), monotonic_ns()
        _run(command)
        arrived_ns = min(
            at_ns
            for at_ns, way, text in simulator.log
            if way == ">" and text.startswith("write_command STOP") and at_ns > began_ns
        )
        pairs.append((before, (arrived_ns - began_ns) / 1e6))
    return pairs


def _figure(what: str, pairs: list[tuple[float, float]], goal: float) -> Figure:
    floor, ours = (Amount(median(column), "ms") for column in zip(*pairs, strict=True))
    ratio = median(one / bare for bare, one in pairs)
    return Figure(what, ours, 'python -c "import click"', floor, ratio, goal)


def _to_frame(command: list[str], tap: Tap) -> float:
    tap.reset()
    began = perf_counter_ns()
    _run(command)
    return (tap.frame_ns - began - tap.waited_ns) / 1e6


def _run(command: list[str]) -> float:
    start = perf_counter_ns()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return (perf_counter_ns() - start) / 1e6


def _port(url: str) -> int:
    port = urlsplit(url).port
    assert port is not None  # noqa: S101 - a served simulator has one
    return port


@contextmanager
def _working_in(folder: Path) -> Iterator[None]:
    """Work in a folder with a state folder in it, and let bytecode be kept."""
    before, here = dict(os.environ), Path.cwd()
    os.environ["ROBOLINK_STATE_DIR"] = str(folder / "state")
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(here)
        os.environ.clear()
        os.environ.update(before)
