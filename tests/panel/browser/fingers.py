"""Fingers on a page, by the touch events of the browser's own protocol."""

import time

# A person scrolls to what is out of view on a full screen.
MIDDLE = """(selector) => {
  const found = document.querySelector(selector);
  if (found?.closest("main")) found.scrollIntoView({block: "nearest"});
  const box = found?.getBoundingClientRect();
  return box && box.width ? {x: box.x + box.width / 2, y: box.y + box.height / 2} : null;
}"""


class Fingers:
    """Puts fingers on a page and takes them away.

    Args:
        page: The page.
    """

    def __init__(self, page):
        self._page = page
        self._protocol = page.context.new_cdp_session(page)
        self._down = {}

    def middle(self, selector):
        """Return the middle of the first element that a selector finds."""
        end_s = time.monotonic() + 15.0
        while True:
            # A part may be drawn anew at any moment: found and measured in one go.
            at = self._page.evaluate(MIDDLE, selector)
            if at is not None:
                return at["x"], at["y"]
            assert time.monotonic() < end_s, selector
            time.sleep(0.02)

    def down(self, where, number=0):
        """Put a finger down, on an element or a place."""
        at = self.middle(where) if isinstance(where, str) else where
        self._down[number] = at
        self._send("touchStart")
        return at

    def move(self, x, y, number=0):
        """Slide a finger to a place."""
        self._down[number] = (x, y)
        self._send("touchMove")

    def up(self, number=0):
        """Take a finger away."""
        del self._down[number]
        self._send("touchEnd")

    def lift(self):
        """Take all fingers away."""
        if self._down:
            self._down = {}
            self._send("touchEnd")

    def tap(self, where):
        """Touch once."""
        self.down(where)
        self.up()

    def _send(self, kind):
        points = [{"x": x, "y": y, "id": number} for number, (x, y) in self._down.items()]
        self._protocol.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
