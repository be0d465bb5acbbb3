"""The other end of a job's wire: reads views, and presses as a page would, in a thread."""

import json
import select
import socket
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from robolink_cli import job_process
from robolink_cli.wizard.views.records import (
    CheckView,
    ChoiceView,
    EndView,
    FitView,
    QuestionView,
    TouchView,
    ValuesView,
)
from robolink_cli.wizard.views.wire import from_wire

RECIPE = Path(__file__).parents[3] / "examples" / "recipes" / "needle-one-touch.toml"
SIZES = (5.0, 1.0, 0.5, 0.1, 0.01)


class Gone(Exception):
    """The job has closed the wire."""


class Tablet:
    """Reads the wire, and presses.

    Args:
        wire: The panel's end of it.
        lives: Whether it says every half second that it is there.

    Attributes:
        view: What is shown; ``None`` before the first view.
        views: All that were shown.
        left: The last line, when the job has ended.
    """

    def __init__(self, wire, *, lives=True):
        self.wire, self.views, self.told = wire, [], []
        self.view: Any = None
        self.left: Any = None
        self.came_s = []
        self._held = b""
        self._lock = threading.Lock()
        self._over = threading.Event()
        if lives:
            threading.Thread(target=self._live, daemon=True).start()

    def _live(self):
        while not self._over.wait(0.4):
            with suppress(OSError):
                self.send({"t": "alive"})

    def close(self):
        self._over.set()
        self.wire.close()

    def dies(self):
        """Be silent from now on."""
        self._over.set()

    def send(self, line):
        self.raw(json.dumps(line).encode() + b"\n")

    def raw(self, data):
        with self._lock:
            self.wire.sendall(data)

    def read(self, wait_s=0.05):
        """Take in what came; raise when the wire has ended."""
        if not select.select([self.wire], [], [], wait_s)[0]:
            return
        try:
            data = self.wire.recv(1 << 16)
        except ConnectionError:
            data = b""
        if not data:
            raise Gone
        *lines, self._held = (self._held + data).split(b"\n")
        for line in lines:
            assert len(line) < 64 * 1024
            said = json.loads(line)
            if said["t"] == "view":
                self.view = from_wire(said["view"])
                self.views.append(self.view)
                self.came_s.append(time.monotonic())
            elif said["t"] == "told":
                self.told.append(said["text"])
            else:
                assert said["t"] == "left"
                self.left = said

    def see(self, wanted, patience_s=20.0):
        """Wait for a view; return it."""
        end_s = time.monotonic() + patience_s
        while time.monotonic() < end_s:
            if self.view is not None and wanted(self.view):
                return self.view
            self.read()
        raise AssertionError(f"not shown within {patience_s} s; last was {self.view}")

    def body(self, kind, patience_s=20.0):
        """Wait for a view of a kind in which something can be pressed; return its body."""
        self.see(lambda view: isinstance(view.body, kind) and view.waits, patience_s)
        time.sleep(0.32)  # longer than a press is ignored for
        self.read(0.0)
        return self.view.body

    def changes(self, body):
        """Wait until something else is shown."""
        return self.see(lambda view: view.body != body)

    def goes_on(self, number):
        """Wait until something else is asked, or nothing."""
        return self.see(lambda view: view.number != number)

    def press(self, action, value="", number=None):
        number = self.view.number if number is None else number
        self.send({"t": "press", "number": number, "action": action, "value": value})

    def ends(self, patience_s=20.0):
        """Read until the wire ends."""
        end_s = time.monotonic() + patience_s
        with suppress(Gone):
            while time.monotonic() < end_s:
                self.read()
            raise AssertionError(f"did not end; shows {self.view}")
        return self.left


class Hand:
    """Brings the tip onto the pin by taps, as somebody at the tablet would.

    Args:
        tablet: The tablet.
        eyes: Sees the simulated tip.
    """

    def __init__(self, tablet, eyes, tool=1):
        self.tablet, self.eyes, self.tool = tablet, eyes, tool

    def left_mm(self):
        seen = self.eyes.look(self.tool)
        return {"x": seen.dx_mm, "y": seen.dy_mm, "z": seen.dz_mm}

    def tap(self, value):
        """Tap one step, and wait for its end."""
        before = self.tablet.view.body.rows
        self.tablet.press("jog", value)
        self.tablet.see(
            lambda view: (
                view.waits and isinstance(view.body, TouchView) and view.body.rows != before
            )
        )

    def bring(self):
        """Jog until the tip is on the pin; the last step is a fine one, straight down."""
        for size in SIZES:
            while True:
                left = self.left_mm()
                if size >= 0.5:
                    left["z"] += 0.3
                axis, far = max(left.items(), key=lambda one: abs(one[1]))
                if abs(far) < size * 0.6:
                    break
                self.tap(f"{axis}{'+' if far > 0 else '-'}{size:g}")

    def touch(self):
        self.tablet.body(TouchView)
        self.bring()
        time.sleep(0.4)
        self.tablet.press("take")
        number = self.tablet.view.number
        self.tablet.see(lambda view: view.number != number)


def change(tablet, eyes, needle="N-0418"):
    """Do a whole change; return what the last screen says."""
    hand, touches = Hand(tablet, eyes), 0
    while True:
        body = tablet.body(
            (ChoiceView, CheckView, TouchView, FitView, ValuesView, QuestionView, EndView)
        )
        number = tablet.view.number
        match body:
            case CheckView(rows=rows, open=left):
                todo = [row for row in rows if row.mark in ("you", "to do") and not row.confirmed]
                if left:
                    tablet.press("confirm", todo[0].name)
                    tablet.changes(body)
                    continue
                tablet.press("start")
            case TouchView():
                hand.touch()
                touches += 1
                continue
            case FitView():
                tablet.press("go_on")
            case ValuesView(tools=tools):
                tablet.press("write", "".join(str(one.tool) for one in tools))
            case QuestionView(text=True):
                tablet.press("answer", needle)
            case QuestionView():
                tablet.press("yes")
            case ChoiceView(rows=rows):
                tablet.press("choose", rows[0].value)
            case EndView():
                return body
        tablet.goes_on(number)


def to_the_jog(tablet):
    """Agree to a jog by hand, and wait for its pad."""
    tablet.body(QuestionView)
    tablet.press("yes")
    tablet.body(TouchView)


def at_the_wire(arguments, script, *, lives=True):
    """Run a job here, and a script with its tablet beside it; return the exit code and the tablet.

    What goes wrong in the script ends the job, and is raised.
    """
    ours, theirs = socket.socketpair()
    tablet, failed = Tablet(ours, lives=lives), []

    def play():
        try:
            script(tablet)
            tablet.ends()
        except Gone:
            pass
        except BaseException as error:
            failed.append(error)
        finally:
            tablet.close()

    thread = threading.Thread(target=play, daemon=True)
    thread.start()
    code = job_process.run(theirs, arguments)
    thread.join(30.0)
    if failed:
        raise failed[0]
    return code, tablet
