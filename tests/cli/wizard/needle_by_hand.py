"""Keys and seconds for a manual needle change: ``python -m tests.cli.wizard.needle_by_hand``.

A simulated controller runs in real time; its needle differs from the stored offset. A scripted hand
sees the tip and brings it to within 0.02 mm, at a touch and at each touch of the turn test. A held
key counts once; in a line every character and ENTER count. ``--lines`` uses the earlier dialogue
(git worktree of the commit before the wizard, on PYTHONPATH); ``--pictures FOLDER`` keeps the
screens; ``--answer-ms MS`` lets the controller answer so late.
"""

import argparse
import os
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.control.assist import InProcessEyes, serve_assist
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.timing import SystemClock
from tests.cli.wizard._screen import ScreenHand
from tests.contract._terminal import Terminal

RECIPE = Path(__file__).parents[3] / "examples" / "recipes" / "needle-one-touch.toml"

LEARN = ["calibrate", "n-angle", "--tool", "1", "--station", "PIN-07", "--yes"]


class Ahead(SystemClock):
    """Real time, starting at the time that a faster clock reached."""

    def __init__(self, reached_ns):
        self.lead_ns = reached_ns - super().now_ns()

    def now_ns(self):
        return super().now_ns() + self.lead_ns


def prepare(simulator):
    """Learn the pin with a simulated person, and mount another needle; return the present time."""
    from robolink_cli import main

    clock = ScaledClock(30.0)
    with serve_tcp(simulator, clock=clock) as host, serve_assist(simulator, clock=clock) as eyes:
        assert main.run(["-c", host.url, *LEARN, "--assist", eyes.url]) == 0
    tip = simulator.world.tips[1]
    simulator.world.tips[1] = replace(
        tip, x_mm=tip.x_mm + 0.31, y_mm=tip.y_mm - 0.22, z_mm=tip.z_mm - 0.4
    )
    return Ahead(clock.now_ns())


class LineTypist:
    """The earlier dialogue: typed steps, Enter when the tip is on the pin."""

    def __init__(self, terminal, simulator):
        self.terminal, self.eyes, self.keys = terminal, InProcessEyes(simulator), 0

    def type(self, text):
        self.keys += len(text) + 1
        self.terminal.press(text.encode() + b"\n")

    def touch(self):
        self.terminal.wait_for("Enter when it is on the pin")
        time.sleep(0.5)
        for digits in (1, 1, 2):
            seen = self.eyes.look(1)
            left = (seen.dx_mm, seen.dy_mm, seen.dz_mm + (0.05 if digits == 1 else 0.0))
            rounded = [max(-5.0, min(5.0, round(by, digits))) for by in left]
            steps = [f"{a}{by:+g}" for a, by in zip("xyz", rounded, strict=True) if by]
            if steps:
                self.type(" ".join(steps))
                self.terminal.wait_for("done: moved")
                time.sleep(0.5)
        self.type("")


def by_lines(words, simulator):
    hand = LineTypist(Terminal(*words), simulator)
    began = time.monotonic()
    hand.terminal.wait_for(r"cell clear\? \[y or n\]")
    hand.type("y")
    touched = 0
    while True:
        found = hand.terminal.wait_for(
            r"(Enter when it is on the pin)|\[y or n\]|(scan it, then Enter)|[Oo]n record as"
        )
        if found[0].endswith("as"):
            break
        if found[1]:
            hand.terminal.shown = found[0] + hand.terminal.shown
            hand.touch()
            touched += 1
        elif found[2]:
            time.sleep(0.5)
            hand.type("N-0418")
        else:
            time.sleep(0.5)
            hand.type("y")
    code = hand.terminal.end()
    return hand.keys, time.monotonic() - began, touched, code


def by_screen(words, simulator, pictures):
    hand = ScreenHand(words, simulator)
    shots: dict[str, str] = {}
    began = time.monotonic()
    touched = 0
    while True:
        found = hand.see(
            r"Jog the tip onto the pin|To write, type|  Yes *\n  No|\[Enter\] Done|DONE"
            r"|Start moving \(2 open\)"
        )[0]
        if pictures:
            hand.rest(0.6)
        shots[f"{len(shots)}-{found[:8]}"] = hand.text
        if found == "DONE":
            break
        if found.startswith("Start"):
            hand.start()
            hand.see("moving|Please wait|Jog the tip")
        elif found.startswith("Jog"):
            hand.touch()
            touched += 1
            hand.see("moving|Please wait|To write|DONE|New values")
        elif found.startswith("To write"):
            hand.rest(0.4)
            hand.press(["1", "*"])
            hand.see("Please wait|moving|Turn test|DONE")
        elif found.startswith("[Enter"):
            hand.rest(0.4)
            hand.press([*"N-0418", "\r"])
            hand.rest(1.0)
        else:
            hand.rest(0.4)
            hand.press(["2", "5"])
            hand.rest(1.0)
    code = hand.end()
    if pictures:
        for name, text in shots.items():
            (pictures / f"{name.strip()}.txt").write_text(text, encoding="utf-8")
    return hand.keys, time.monotonic() - began, touched, code


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--lines", action="store_true")
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("--answer-ms", type=float, default=0.0)
    said = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        os.environ["ROBOLINK_STATE_DIR"] = folder
        simulator = EpsonSimulator(seed=7, options=EpsonOptions(remote_timeout_s=0.0))
        clock = ScaledClock(1.0, prepare(simulator))
        simulator.answer_s = said.answer_ms / 1000
        with serve_tcp(simulator, clock=clock) as host:
            command = "recalibrate" if said.lines else "change"
            words = [command, str(RECIPE), "-c", host.url]
            if said.lines:
                found = by_lines(words, simulator)
            else:
                found = by_screen(words, simulator, said.pictures)
    keys, seconds, touched, code = found
    sys.stdout.write(f"keys {keys}, seconds {seconds:.0f}, touches {touched}, exit {code}\n")


if __name__ == "__main__":
    main()
