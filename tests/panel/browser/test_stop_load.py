"""STOP while the robot moves and twenty tablets watch: from the finger to ``$Abort``.

    pytest -n 0 -s -m soak tests/panel/browser/test_stop_load.py

What it prints counts on two quiet cores; it prints how busy they were. Twenty browsers take far
more of two cores than the panel does, while a tablet has a processor of its own: so two of them are
browsers, which press, and eighteen read the stream of a page. ``BROWSERS=20`` makes all of them
browsers, their pages in one Chromium, a context each.
"""

import os
import sys
import time
from contextlib import ExitStack
from math import ceil

import pytest

from tests.panel.browser.fingers import Fingers
from tests.panel.browser.person import Person
from tests.panel.browser.real_cell import RealCell, watching
from tests.panel.browser.scripted import until

TABLETS = 20
BROWSERS = int(os.environ.get("BROWSERS", "2"))
"""So many of the tablets; one works at the cell, another presses STOP."""

COUNT = int(os.environ.get("STOPS", "100"))
LONGEST_S = float(os.environ.get("STOPS_S", "3000"))
"""After so long it prints what it has by then."""

pytestmark = [pytest.mark.soak, pytest.mark.timeout(3600)]


@pytest.fixture
def cell(tmp_path, monkeypatch, chromium):
    """A cell on which a movement lasts until a finger comes down."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    with RealCell(tmp_path, speed=SPEED) as made:
        yield made


SPEED = 2.0
"""Of the simulated robot: its movements last seconds, and the way to them is short."""


def test_stop_in_a_movement_with_twenty_tablets(cell, chromium):
    took_ms, confirmed_ms, missed = list[float](), list[float](), 0
    with ExitStack() as stack:

        def tablet():
            size = {"width": 1280, "height": 800}
            context = chromium.new_context(viewport=size, has_touch=True)
            stack.callback(context.close)
            context.set_default_timeout(180_000)
            page = context.new_page()
            page.goto(f"{cell.url}cell/line3")
            page.wait_for_selector("body:not(.silent)")
            return page

        page = tablet()
        person = Person(page, cell)
        person.opens()
        others = [tablet() for _ in range(BROWSERS - 1)]
        for _ in range(TABLETS - BROWSERS):
            stack.enter_context(watching(cell))
        fingers = Fingers(others[0])
        load, began_s = [], time.monotonic()
        while len(took_ms) < COUNT and time.monotonic() - began_s < LONGEST_S:
            begins(person)
            if not reaches_a_movement(person) or not cell.simulator.machine.arm.moving:
                missed += 1  # it was over before a busy browser had shown it
                ends(person)
                continue
            aborts, at_s = len(cell.relay.aborts), time.monotonic()
            fingers.down("#stop")
            until(lambda aborts=aborts: len(cell.relay.aborts) > aborts)
            took_ms.append(1000 * (cell.relay.aborts[aborts] - at_s))
            others[0].wait_for_selector("#stopped:visible")
            confirmed_ms.append(1000 * (time.monotonic() - at_s))
            fingers.up()
            others[0].evaluate("document.getElementById('stopped').hidden = true")
            load.append(os.getloadavg()[0])
            ends(person)
            releases(person)
    assert took_ms, "no movement was reached in time"
    for name, found in (("$Abort", took_ms), ("confirmed on the page", confirmed_ms)):
        found.sort()
        p50, p95, p99 = (found[ceil(len(found) * part) - 1] for part in (0.5, 0.95, 0.99))
        sys.stdout.write(
            f"STOP to {name}, robot moving, {TABLETS} tablets ({BROWSERS} browsers), "
            f"n = {len(found)}: p50 {p50:.0f}, p95 {p95:.0f}, p99 {p99:.0f}, "
            f"worst {found[-1]:.0f} ms; {missed} movements missed, "
            f"load {min(load):.1f} to {max(load):.1f} on {os.cpu_count()} cores\n"
        )
    # How fast a stop is depends on the machine; that each was carried out and confirmed does not.
    assert len(cell.relay.aborts) >= len(took_ms)


def begins(person):
    """Begin a change, however often a busy page has to be touched for that."""
    while person.screen == "idle":
        person.begins()
        end_s = time.monotonic() + 5.0
        while person.screen == "idle" and time.monotonic() < end_s:
            time.sleep(0.05)


def reaches_a_movement(person):
    """Answer what comes before the first movement; return whether the robot moves by itself."""
    page = person.page
    while True:
        page.wait_for_selector(MOVES_OR_ASKS)
        if person.screen == "moving":
            return True
        if person.screen in ("touch", "end"):
            return False
        number = person.number()
        time.sleep(0.35)  # longer than a press is ignored for
        person.answers(person.screen)
        end_s = time.monotonic() + 5.0  # what a busy computer took too late it does not do
        while person.number() == number and time.monotonic() < end_s:
            time.sleep(0.02)


def ends(person):
    """Leave what the stop left on the page."""
    while person.screen != "idle":
        person.page.wait_for_selector(
            "body[data-screen=idle] .row, footer .b:is([data-action=leave],[data-action=finish])"
        )
        time.sleep(0.35)
        for action in ("finish", "leave"):
            found = person.page.locator(f"footer [data-action={action}]")
            if person.screen != "idle" and found.count():
                person.fingers.tap(f"footer [data-action={action}]")
                break
        time.sleep(0.15)


def releases(person):
    """Allow movement again, as a person who has looked into the cell, and settle what is open."""
    for job in ("recover", "release"):
        row = f'.row[data-post="/start"][data-body*="{job}"]:not([aria-disabled])'
        person.page.wait_for_selector('.row[data-post="/start"]')
        time.sleep(0.3)
        if not person.page.locator(row).count():
            continue
        person.tap(row)
        while True:
            person.page.wait_for_selector(MOVES_OR_ASKS)
            screen, number = person.screen, person.number()
            if screen == "end":
                break
            time.sleep(0.35)
            person.answers(screen)
            end_s = time.monotonic() + 5.0
            while person.number() == number and time.monotonic() < end_s:
                time.sleep(0.02)
        ends(person)


MOVES_OR_ASKS = ",".join(
    f"body[data-screen={screen}] {found}"
    for screen, found in (
        ("moving", "footer"),
        ("choice", ".row[data-action=choose]:not([aria-disabled])"),
        ("check", "[data-action=leave]"),
        ("touch", "[data-action=jog]:not([aria-disabled])"),
        ("question", "footer .b:is([data-action=yes],[data-action=answer]):not([aria-disabled])"),
        ("end", "footer .b"),
    )
)
"""What shows that the robot moves by itself, or that something is asked."""
