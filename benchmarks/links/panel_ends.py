"""What stands around a measured panel: a robot, and a job that shows ten views a second.

``python -m benchmarks.links.panel_ends robot`` serves a simulated controller and writes the time of
each Abort; ``... panel ARGUMENT...`` runs the panel, whose jobs are the one in this module.
"""

import json
import os
import socket
import sys
import threading
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from robolink_cli.wizard.views.records import View

EVERY_S: Final = 0.1
"""Time between two views."""

URL: Final = "BENCH_URL"
"""Variable with the controller that the job has."""


def serve_robot() -> None:
    """Serve a simulated controller; print its URL, then the time of each Abort."""
    from robolink_simulators.epson.device import EpsonSimulator
    from robolink_simulators.hosting.streams.epson import serve_tcp

    from benchmarks.links.stopping import Tap

    with serve_tcp(EpsonSimulator(seed=1)) as host:
        tap = Tap(int(host.url.rpartition(":")[2]), lambda piece: b"$Abort" in piece)
        print(f"epson+tcp://127.0.0.1:{tap.port}", flush=True)
        while True:
            if tap.frame_ns:
                print(tap.frame_ns, flush=True)
                tap.reset()
            time.sleep(0.0005)


def run_panel(arguments: list[str]) -> None:
    """Run the panel, with the job of this module."""
    from robolink_cli.entry import run
    from robolink_cli.panel.jobs import PanelJob

    PanelJob.program = "benchmarks.links.panel_ends"
    sys.exit(run(arguments))


def work(descriptor: int) -> None:
    """Have the controller, and show the time, until the line ends."""
    from robolink_cli.wizard.views.wire import to_wire

    import robolink
    from robolink.stopping import StopListener

    line, url, view = socket.socket(fileno=descriptor), os.environ[URL], _touch()

    def show() -> None:
        while True:
            head = replace(view.head, title=str(time.perf_counter_ns()))
            said = {"t": "view", "view": to_wire(replace(view, head=head))}
            try:
                line.sendall(json.dumps(said).encode() + b"\n")
            except OSError:
                return
            time.sleep(EVERY_S)

    with robolink.connect(url) as controller, StopListener(controller, url, who="a job"):
        threading.Thread(target=show, daemon=True).start()
        while (heard := line.recv(65536)) and b'"leave"' not in heard:
            pass


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
