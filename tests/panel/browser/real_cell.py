"""A simulated cell in this process, and the panel's own process beside it."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from robolink_cli import main
from robolink_cli.panel.guard.people import Pins
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.control.assist import InProcessEyes, serve_assist
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from websockets.sync.client import connect
from websockets.typing import Origin

from robolink.model import Secret

RECIPE = Path(__file__).parents[3] / "examples" / "recipes" / "needle-one-touch.toml"
LEARN = ("calibrate", "n-angle", "--tool", "1", "--station", "PIN-07", "--yes")
PINS = {"Chen": "40281793", "Meier": "91173528"}
ROLES = {"Chen": "operator", "Meier": "engineer"}


class RealCell:
    """A robot that knows its pin, with a new needle, and the panel that shows it.

    Args:
        folder: Where its files are.
        speed: How fast its time passes.
        plc: Whether it is a PLC, and not an EPSON controller.

    Attributes:
        simulator: The robot.
        eyes: See its tip.
        url: The panel.
        process: The panel's process.
    """

    def __init__(self, folder, speed=20.0, *, plc=False):
        self.folder, self._speed, self._plc = folder, speed, plc
        for name, pin in PINS.items():
            Pins().set(name, Secret(pin))
        self.simulator: Any = SoftMotionSimulator(seed=3) if plc else EpsonSimulator(seed=7)
        self._serve = serve_modbus_tcp if plc else serve_tcp
        self.eyes = InProcessEyes(self.simulator)
        self.process: subprocess.Popen[bytes] | None = None
        self.url, self.port = "", 0

    def __enter__(self):
        clock = ScaledClock(self._speed)
        self._host = self._serve(self.simulator, clock=clock)
        host = self._host.__enter__()
        self.relay = Relay(int(host.url.rpartition(":")[2]))
        with serve_assist(self.simulator, clock=clock) as eyes:
            assert main.run(["-c", host.url, *LEARN, "--assist", eyes.url]) == 0
        url = f"{host.url.rpartition(':')[0]}:{self.relay.port}"
        (self.folder / "cell.toml").write_text(
            f'[cells.line3]\nurl = "{url}"\ntool = 1\nremote_timeout_s = 60.0\n'
            'remote_timeout_confirmed_by = "the simulator"\n[cells.line3.people]\n'
            + "".join(f'{name} = "{role}"\n' for name, role in ROLES.items())
        )
        recipe = RECIPE.read_text()
        if self._plc:  # its safe pose is one of the EPSON arm
            before, _, behind = recipe.partition("[poses]")
            recipe = f"{before}[[tools]]{behind.partition('[[tools]]')[2]}"
        (self.folder / "needle.toml").write_text(recipe)
        self.start()
        return self

    def __exit__(self, *_):
        self.end(signal.SIGTERM)
        self.relay.close()
        self._host.__exit__(None, None, None)

    def start(self):
        """Start the panel, at the port that it had before."""
        self.process = subprocess.Popen(
            [
                *(sys.executable, "-m", "robolink_cli", "--json", "panel"),
                *("--cells", "cell.toml", "--listen", f"127.0.0.1:{self.port}"),
            ],
            cwd=self.folder,
            stdout=subprocess.PIPE,
            env=dict(os.environ),
        )
        assert self.process.stdout is not None
        self.url = json.loads(self.process.stdout.readline())["url"]
        self.port = int(self.url.rstrip("/").rpartition(":")[2])

    def end(self, how):
        """End the panel by a signal."""
        process = self.process
        assert process is not None
        assert process.stdout is not None
        process.send_signal(how)
        process.wait(30)
        process.stdout.close()

    def renew(self):
        """End the panel with its jobs, and start it again."""
        self.end(signal.SIGTERM)
        self.start()

    def mount(self, x_mm, y_mm):
        """Mount a new needle, whose tip is elsewhere."""
        tip = self.simulator.world.tips[1]
        self.simulator.world.tips[1] = replace(tip, x_mm=tip.x_mm + x_mm, y_mm=tip.y_mm + y_mm)

    def tip_mm(self):
        """Return how far the tip is from the pin, X, Y, Z."""
        seen = self.eyes.look(1)
        return {"x": seen.dx_mm, "y": seen.dy_mm, "z": seen.dz_mm}


class Proxy:
    """Passes bytes between whoever connects to :attr:`port` and a far end.

    Attributes:
        port: Where it listens, on loopback.
    """

    def __init__(self):
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self):
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()

    def far_end(self, near):
        """Return the port at which the far end of a connection listens."""
        raise NotImplementedError

    def look(self, data):
        """See bytes of the near end before they go on."""

    def _accept(self):
        with suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                threading.Thread(target=self._serve, args=(near,), daemon=True).start()

    def _serve(self, near):
        with (
            near,
            suppress(OSError),
            socket.create_connection(("127.0.0.1", self.far_end(near))) as far,
        ):
            for end in (near, far):
                end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            back = threading.Thread(target=self._pass, args=(far, near, None), daemon=True)
            back.start()
            self._pass(near, far, self.look)
            back.join()

    def _pass(self, one, other, look):
        with suppress(OSError):
            while data := one.recv(65536):
                if look is not None:
                    look(data)
                other.sendall(data)
        with suppress(OSError):
            other.shutdown(socket.SHUT_WR)


class Relay(Proxy):
    """Stands between the panel's jobs and the robot, and notes when a stop goes by.

    Attributes:
        aborts: When ``$Abort`` went by, monotonic.
    """

    def __init__(self, far_port):
        self._far_port, self.aborts = far_port, []
        super().__init__()

    def far_end(self, _near):
        return self._far_port

    def look(self, data):
        if b"$Abort" in data:
            self.aborts.append(time.monotonic())


class Cable(Proxy):
    """A SOCKS 5 proxy between a browser and the panel, whose cable can be pulled."""

    def __init__(self):
        self.out = False
        super().__init__()

    def far_end(self, near):
        self.look()
        near.recv(262)
        near.sendall(b"\x05\x00")
        asked = near.recv(262)
        self.look()
        near.sendall(b"\x05\x00\x00\x01\x7f\x00\x00\x01" + asked[-2:])
        return int.from_bytes(asked[-2:], "big")

    def look(self, _data=b""):
        """Hold what is sent while the cable is out: it arrives late, as TCP does it."""
        while self.out:
            time.sleep(0.02)


@contextmanager
def watching(cell):
    """A tablet that watches, without a browser: it reads all that comes."""
    place = cell.url.removeprefix("http").rstrip("/")
    with connect(f"ws{place}/live?cell=line3", origin=Origin(f"http{place}")) as socket:
        reads = threading.Thread(target=lambda: [None for _ in socket], daemon=True)
        reads.start()
        yield
    reads.join(5)
