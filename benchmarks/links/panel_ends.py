"""What stands around a measured panel: a robot that moves, and a job that shows ten views a second.

``python -m benchmarks.links.panel_ends robot`` serves a simulated controller and writes the time of
each Abort; ``... panel ARGUMENT...`` runs the panel, whose jobs are the one in this module.
"""

import json
import os
import socket
import sys
import threading
import time
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from robolink_cli.wizard.views.records import View

    from robolink.model import Controller

EVERY_S: Final = 0.1
"""Time between two views."""

MOVING: Final = "running"
"""State of the robot while it moves."""

URL: Final = "BENCH_URL"
"""Variable with the controller that the job has."""


def serve_robot() -> None:
    """Serve a simulated controller; print its URL, then the time of each Abort."""
    from robolink_simulators.epson.device import EpsonSimulator
    from robolink_simulators.hosting.streams.epson import serve_tcp

    with serve_tcp(EpsonSimulator(seed=1)) as host, socket.create_server(("127.0.0.1", 0)) as door:
        print(f"epson+tcp://127.0.0.1:{door.getsockname()[1]}", flush=True)
        while True:
            near, _ = door.accept()
            far = socket.create_connection(("127.0.0.1", int(host.url.rpartition(":")[2])))
            for one in (near, far):
                one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            for one, other in ((near, far), (far, near)):
                threading.Thread(target=_pass_on, args=(one, other), daemon=True).start()


def _pass_on(near: socket.socket, far: socket.socket) -> None:
    """Pass on what comes in; print the time of each Abort, which comes while a movement waits."""
    with suppress(OSError), near, far:
        while piece := near.recv(65536):
            if b"$Abort" in piece:
                print(time.perf_counter_ns(), flush=True)
            far.sendall(piece)


def run_panel(arguments: list[str]) -> None:
    """Run the panel, with the job of this module."""
    from robolink_cli.entry import run
    from robolink_cli.panel.jobs import PanelJob

    PanelJob.program = "benchmarks.links.panel_ends"
    sys.exit(run(arguments))


def work(descriptor: int) -> None:
    """Have the controller, and show the time, until the line ends."""
    from robolink_cli.wizard.views.records import Status
    from robolink_cli.wizard.views.wire import to_wire

    import robolink
    from robolink.stopping import StopListener

    line, url, view = socket.socket(fileno=descriptor), os.environ[URL], _touch()

    moves = threading.Event()

    def show() -> None:
        while True:
            head = replace(view.head, title=str(time.perf_counter_ns()))
            status = Status(MOVING if moves.is_set() else "ready", halted=False, age_s=0.0)
            said = {"t": "view", "view": to_wire(replace(view, head=head, status=status))}
            try:
                line.sendall(json.dumps(said).encode() + b"\n")
            except OSError:
                return
            time.sleep(EVERY_S)

    with robolink.connect(url) as controller, StopListener(controller, url, who="a job"):
        threading.Thread(target=show, daemon=True).start()
        threading.Thread(target=_keep_moving, args=(controller, moves), daemon=True).start()
        while (heard := line.recv(65536)) and b'"leave"' not in heard:
            pass


def _keep_moving(controller: "Controller", moves: threading.Event) -> None:
    """Move up and down, and again after each stop."""
    from robolink.errors import StoppedError
    from robolink.model import MotionProfile, Path, WorkBox

    controller.motors(True)
    group, up_mm = controller.groups[0], -20.0
    while True:
        here, up_mm = group.pose(), -up_mm
        try:
            motion = group.move_to(
                replace(here, z_mm=here.z_mm + up_mm), MotionProfile(Path.STRAIGHT), box=WorkBox()
            )
            moves.set()
            motion.wait(timeout_s=60)
        except StoppedError:
            moves.clear()
            time.sleep(0.1)  # the stop is to have ended: only then is it released
            controller.release_stop()


def _touch() -> "View":
    """Return the screen of a touch, which is the largest that changes as it is looked at."""
    from robolink_cli.wizard.views.records import (
        Arrow,
        CoordinateRow,
        Head,
        JogPad,
        Status,
        TouchView,
        View,
    )

    rows = tuple(CoordinateRow(name, "158.600", "+0.100") for name in "XYZU")
    pad = JogPad((0.01, 0.1, 0.5), 0.1, (Arrow("right", "x+", "X+"), Arrow("up", "y+", "Y+")))
    body = TouchView(
        ("Jog the tip onto the pin.",), "base", rows, "0.400 mm in 4 steps", (), (), pad
    )
    status = Status("ready", halted=False, age_s=0.0)
    return View(1, waits=True, head=Head("line3", "change", "0"), status=status, body=body)


if __name__ == "__main__":
    match sys.argv[1]:
        case "robot":
            serve_robot()
        case "panel":
            run_panel(sys.argv[2:])
        case number:
            work(int(number))
