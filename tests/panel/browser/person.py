"""A person at a tablet, who does a whole change with a finger."""

import os
import time

from tests.panel.browser.fingers import Fingers
from tests.panel.browser.real_cell import PINS
from tests.panel.browser.scripted import until

SIZES = (5.0, 1.0, 0.5, 0.1, 0.01)


def pictured(page, name):
    """Keep a picture where somebody wants to look at it."""
    folder = os.environ.get("PANEL_PICTURES")
    if folder:
        page.screenshot(path=f"{folder}/{name}.png")


class Person:
    """Reads a page and presses what it shows.

    Args:
        page: A page of the tablet.
        cell: The real cell.
        who: Whose PIN is typed.
    """

    def __init__(self, page, cell, who="Chen"):
        self.page, self.cell, self.who = page, cell, who
        self.fingers = Fingers(page)
        self.screens = []

    @property
    def screen(self):
        return self.page.get_attribute("body", "data-screen")

    def tap(self, selector):
        self.page.wait_for_selector(f"{selector}:visible")
        self.fingers.tap(selector)

    def opens(self):
        """Open the cell's page and take its seat, with a PIN."""
        self.page.goto(f"{self.cell.url}cell/line3")
        self.page.wait_for_selector("body:not(.silent)")
        self.tap("footer a.main")
        self.page.wait_for_url("**/login*")
        self.logs_in()
        self.page.wait_for_url("**/cell/line3")
        self.tap('[data-post="/seat"]')
        self.page.wait_for_selector('.row[data-post="/start"]:not([aria-disabled])')

    def logs_in(self):
        self.tap(f'[data-pick=name][data-value="{self.who}"]')
        for digit in PINS[self.who]:
            self.tap(f'[data-key="{digit}"]')
        self.tap('[data-post="/login"]')

    def begins(self):
        self.tap('.row[data-post="/start"][data-body*="change"]')

    def change(self, until_screen="end", at_touch=None):
        """Go on until a screen is reached; return it."""
        while True:
            self.page.wait_for_selector(ASKED, timeout=30_000)
            screen, number = self.screen, self.number()
            self.screens.append(screen)
            if screen == until_screen:
                return screen
            time.sleep(0.35)  # longer than a press is ignored for
            if screen == "touch":
                if at_touch is not None:
                    at_touch()
                self.touches()
            else:
                self.answers(screen)
            until(lambda number=number: self.number() != number, 30)

    def number(self):
        """Return the number of the question that is on the screen."""
        return int(self.page.get_attribute("body", "data-number"))

    def answers(self, screen):
        if screen == "choice":
            self.tap(".row[data-action=choose]")
        elif screen == "check":
            while self.page.locator(OPEN).count():
                count = self.page.locator(OPEN).count()
                self.tap(OPEN)
                until(lambda count=count: self.page.locator(OPEN).count() < count)
                time.sleep(0.35)
            self.page.wait_for_selector("[data-action=start]:not([aria-disabled])")
            self.tap("[data-action=start]")
        elif screen == "fit":
            self.tap("[data-action=go_on]")
        elif screen == "values":
            self.tap('[data-key="1"]')
            self.tap("[data-action=write]")
        elif self.page.locator("[data-typed=text]").count():
            for digit in "0418":
                self.tap(f'[data-key="{digit}"]')
            self.tap("[data-action=answer]")
        else:
            self.tap("[data-action=yes]")

    def touches(self):
        """Bring the tip onto the pin, and take it."""
        self.brings()
        time.sleep(0.4)
        self.page.wait_for_selector("[data-action=take]:not([aria-disabled])")
        self.tap("[data-action=take]")

    def brings(self):
        for size in SIZES:
            while True:
                left = self.cell.tip_mm()
                if size >= 0.5:
                    left["z"] += 0.3
                axis, far = max(left.items(), key=lambda one: abs(one[1]))
                if abs(far) < size * 0.6:
                    break
                self.jogs(f"{axis}{'+' if far > 0 else '-'}", size)

    def jogs(self, axis, size):
        """Tap one step, and wait until the tip has moved."""
        chosen = f'[data-action=size][data-value="{size:g}"]'
        for _ in range(5):  # what a busy computer took too late it does not do
            if self.page.get_attribute(chosen, "aria-pressed") == "true":
                break
            self.tap(chosen)
            end_s = time.monotonic() + 4.0
            while time.monotonic() < end_s:
                if self.page.get_attribute(chosen, "aria-pressed") == "true":
                    break
                time.sleep(0.02)
        before = self.cell.tip_mm()
        key = f'[data-action=jog][data-value="{axis}{size:g}"]:not([aria-disabled])'
        for _ in range(5):  # a press while the last step still ends does nothing
            self.tap(key)
            end_s = time.monotonic() + 2.0
            while time.monotonic() < end_s:
                if self.cell.tip_mm() != before:
                    self.page.wait_for_selector(key)
                    return
                time.sleep(0.01)
        raise AssertionError(f"{key} moves nothing: {self.page.inner_text('body')}")


ASKED = ",".join(
    f"body[data-screen={screen}] {found}"
    for screen, found in (
        ("choice", ".row[data-action=choose]:not([aria-disabled])"),
        ("check", "[data-action=leave]"),
        ("touch", "[data-action=jog]:not([aria-disabled])"),
        ("fit", "[data-action=go_on]:not([aria-disabled])"),
        ("values", "[data-action=write]:not([aria-disabled])"),
        ("question", "footer .b:is([data-action=yes],[data-action=answer]):not([aria-disabled])"),
        ("end", "footer .b"),
    )
)
"""What shows that something is asked."""

OPEN = ".row[data-action=confirm][aria-pressed=false]:not([aria-disabled])"
