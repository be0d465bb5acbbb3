"""Fingers on a page, by the touch events of the browser's own protocol."""

from playwright.sync_api import Error


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
        box = self._page.locator(selector).first.bounding_box()
        assert box is not None, selector
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

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

    def tap(self, where):
        """Touch once."""
        self.down(where)
        self.up()

    def _send(self, kind):
        points = [{"x": x, "y": y, "id": number} for number, (x, y) in self._down.items()]
        self._protocol.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


def is_gone(page):
    """Return whether a page is closed."""
    try:
        page.evaluate("1")
    except Error:
        return True
    return False
