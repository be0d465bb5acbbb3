"""A simulated cell in this process, and the panel's own process beside it."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from robolink_cli import main
from robolink_cli.panel.guard.people import Pins
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.control.assist import InProcessEyes, serve_assist
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.model import Secret

RECIPE = Path(__file__).parents[3] / "examples" / "recipes" / "needle-one-touch.toml"
LEARN = ("calibrate", "n-angle", "--tool", "1", "--station", "PIN-07", "--yes")
PINS = {"Chen": "40281793", "Meier": "91173528"}
ROLES = {"Chen": "operator", "Meier": "engineer"}


class RealCell:
    """A robot that knows its pin, with a new needle, and the panel that shows it.

    Attributes:
        simulator: The robot.
        eyes: See its tip.
        url: The panel.
        process: The panel's process.
    """

    def __init__(self, folder, speed=20.0):
        self.folder, self._speed = folder, speed
        for name, pin in PINS.items():
            Pins().set(name, Secret(pin))
        self.simulator = EpsonSimulator(seed=7)
        self.eyes = InProcessEyes(self.simulator)
        self.process: subprocess.Popen[bytes] | None = None
        self.url, self.port = "", 0

    def __enter__(self):
        clock = ScaledClock(self._speed)
        self._host = serve_tcp(self.simulator, clock=clock)
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
        (self.folder / "needle.toml").write_bytes(RECIPE.read_bytes())
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


class Relay:
    """Passes bytes between the panel's jobs and the robot, and notes when a stop goes by.

    Attributes:
        aborts: When ``$Abort`` went by, monotonic.
    """

    def __init__(self, far_port):
        self._far_port, self.aborts = far_port, []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self):
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()

    def _accept(self):
        with suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                threading.Thread(target=self._serve, args=(near,), daemon=True).start()

    def _serve(self, near):
        with (
            near,
            suppress(OSError),
            socket.create_connection(("127.0.0.1", self._far_port)) as far,
        ):
            for end in (near, far):
                end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            both(near, far, self._look)

    def _look(self, data):
        if b"$Abort" in data:
            self.aborts.append(time.monotonic())


def both(near, far, look):
    """Pass bytes both ways until both have ended; ``look`` sees those of the near end first."""
    back = threading.Thread(target=_pass, args=(far, near, lambda _: None), daemon=True)
    back.start()
    _pass(near, far, look)
    back.join()


def _pass(one, other, look):
    with suppress(OSError):
        while data := one.recv(65536):
            look(data)
            other.sendall(data)
    with suppress(OSError):
        other.shutdown(socket.SHUT_WR)


class Cable:
    """A SOCKS 5 proxy between a browser and the panel, whose cable can be pulled."""

    def __init__(self):
        self.out = False
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self):
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()

    def _accept(self):
        with suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                threading.Thread(target=self._serve, args=(near,), daemon=True).start()

    def _serve(self, near):
        with near, suppress(OSError):
            self._wait()
            near.recv(262)
            near.sendall(b"\x05\x00")
            asked = near.recv(262)
            port = int.from_bytes(asked[-2:], "big")
            self._wait()
            with socket.create_connection(("127.0.0.1", port)) as far:
                near.sendall(b"\x05\x00\x00\x01\x7f\x00\x00\x01" + asked[-2:])
                both(near, far, self._wait)

    def _wait(self, _=b""):
        """Hold what is sent while the cable is out: it arrives late, as TCP does it."""
        while self.out:
            time.sleep(0.02)
