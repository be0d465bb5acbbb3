"""The page of a recovery, and its words for the interrupted job."""

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from dataclasses import replace

import pytest
from robolink_cli import main
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.cell.tip_switches import TouchPlate
from robolink_simulators.control.assist import serve_assist
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.journal import open_journal
from robolink.model import Marker, MarkerKind, begun_in_words
from tests.cli.wizard._screen import ScreenHand

# A process killed between write and turn test: the page of a recovery, on a terminal.
# The measurement is a separate process, killed with SIGKILL in the first movement of its turn test;
# the recovery is the real command on a pseudo terminal, with a hand at its keys.

FULL = ("n-angle", "--station", "PIN-07", "--count", "3")
METHODS = {"n-angle": FULL, "one-touch": ("one-touch", "--station", "PIN-07"), "z-touch": ()}


@contextmanager
def served():
    simulator = EpsonSimulator(seed=7, options=EpsonOptions(remote_timeout_s=0.0))
    clock = ScaledClock(10.0)
    with serve_tcp(simulator, clock=clock) as host, serve_assist(simulator, clock=clock) as eyes:
        yield simulator, host.url, eyes.url


CONTACTS = {"n-angle": 3, "one-touch": 2, "z-touch": 0}
"""Touches to make: one that shows where the tip is, and the test's angles; 0 with a sensor."""


def command(url, eyes, method):
    person = () if method == "z-touch" else ("--assist", eyes)
    return ["-c", url, "calibrate", *METHODS[method], "--tool", "1", *person, "--yes"]


def with_a_plate(simulator):
    """Put a plate beside the tip that switches an input; return the options with its place."""
    x_mm, y_mm, z_mm = simulator.world.tip_mm()
    plate = (x_mm - 5.0, y_mm + 5.0, z_mm - 7.0)
    simulator.world.connect(5, TouchPlate(plate[2]))
    at = ",".join(f"{value:.3f}" for value in plate)
    return ("z-touch", "--station", "PLATE", "--at", at, "--input", "5", "--no-retake")


def killed_in_its_proof(simulator, words):
    """Run a command in a separate process; kill it in its first movement after the write."""
    seen, held = [], threading.Event()

    def hold(_number, request):
        if request.startswith('$Execute,"TLSet 1, XY'):
            seen.append(request)
        elif seen and request.startswith('$Execute,"Go '):
            os.kill(process.pid, signal.SIGKILL)
            held.set()

    with simulator.lock:
        simulator.on_request = hold
    paths = {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    process = subprocess.Popen(
        [sys.executable, "-m", "robolink_cli", *words],
        env=os.environ | paths,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    said = process.communicate(timeout=120)[1].decode()
    with simulator.lock:
        simulator.on_request = None
    assert held.is_set(), said
    assert process.returncode == -signal.SIGKILL
    end_s = time.monotonic() + 60
    while simulator.status_flags().running:  # the controller ends the movement by itself
        assert time.monotonic() < end_s
        time.sleep(0.01)


def chosen_and_tested(hand):
    hand.see("Look at the robot: which needle is mounted")
    hand.see("The new one. Make the turn test, then keep the new value.")
    hand.rest(0.4)
    for key, seen in (
        ("\x1b[B", "> The old"),
        ("\x1b[B", "> The new"),
        ("\r", "ENTER does nothing"),
    ):
        hand.press([key])
        hand.see(seen)
        hand.rest(0.2)
    hand.press(["5"])
    hand.start()
    contacts = 0
    while True:
        found = hand.see(r"Jog the tip onto the pin|All jobs are finished|DONE|STOPPED")[0]
        contacts += found.startswith("Jog")
        if not found.startswith("Jog"):
            return contacts
        hand.jog()
        hand.press(["5"])
        hand.see("moving|Please wait|All jobs are finished|DONE|STOPPED")


@pytest.mark.simulator_only
@pytest.mark.soak
@pytest.mark.timeout(300)
@pytest.mark.parametrize("method", METHODS)
def test_the_new_needle_is_chosen_tested_and_kept(method, tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    with served() as (simulator, url, eyes):
        monkeypatch.setitem(METHODS, "z-touch", with_a_plate(simulator))
        if method == "one-touch":
            assert main.run(command(url, eyes, "n-angle")) == 0
        tip, before = simulator.world.tips[1], simulator.machine.tools.get(1)
        simulator.world.tips[1] = replace(
            tip, x_mm=tip.x_mm + 0.4, y_mm=tip.y_mm - 0.3, z_mm=tip.z_mm - 0.3
        )
        killed_in_its_proof(simulator, command(url, eyes, method))
        new = simulator.machine.tools.get(1)
        assert new != before
        written = []

        def watched(_number, request):
            written.extend([request] if "TLSet 1, XY" in request else [])

        with simulator.lock:
            simulator.on_request = watched
        hand = ScreenHand(["-c", url, "recover", "--take-over", "it was killed"], simulator)
        try:
            assert chosen_and_tested(hand) == CONTACTS[method]
            assert hand.end() == 0, hand.text
        finally:
            hand.close()
        assert simulator.machine.tools.get(1) == new
        assert written == [], "the value is there already"
        assert simulator.machine.tools.selected == 1
    assert open_journal().open_markers() == ()


# The page of a recovery names the interrupted job in words; wire requests are for records.

TARGET = [164.588, 497.136, -93.572, 90.0, 0.0, 0.0]
WIRE = "Go XY(164.588, 497.136, -93.572, 90.000) /R /0"


@pytest.mark.parametrize(
    ("kind", "details", "words"),
    [
        (
            MarkerKind.MOVE,
            {"target": TARGET},
            "a movement to X 164.588 Y 497.136 Z -93.572 U 90.000",
        ),
        (MarkerKind.MOVE, {"duration_s": 0.4}, "a movement"),
        (MarkerKind.SET, {"tool": 3, "requested": TARGET}, "writing tool 3"),
        (MarkerKind.SET, {"tool": 3, "requested": None}, "clearing tool 3"),
        (MarkerKind.SET, {"select": 0, "before": 1}, "selecting tool 0"),
        (MarkerKind.CHANGE, {"tools": {}}, WIRE),
    ],
)
def test_a_movement_is_told_by_where_it_was_to_go(kind, details, words):
    assert begun_in_words(Marker("1", kind, WIRE, "2026-11-23T14:02:00Z", details)) == words
