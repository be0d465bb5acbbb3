"""The wire of a job: lines of JSON to and from whoever shows it.

One thread reads. What ends a movement, or keeps it from beginning, is noted there at once, with the
time at which it came: a press that waits to be carried out never delays it. What is not understood
is dropped, and so is what comes faster than any hand.
"""

import json
import math
import select
import socket
import threading
import time
from collections import deque
from collections.abc import Mapping
from typing import Final

from robolink_cli.console.output import visible
from robolink_cli.wizard.happenings import Pressed
from robolink_cli.wizard.lease import Hold, JogLease
from robolink_cli.wizard.views.page_ways import on_a_page

LONGEST_LINE: Final = 64 * 1024
"""Most bytes of a line, both ways."""

_MOST_PRESSES: Final = 16
"""Most presses that wait to be carried out. A hand is slower."""

_MOST_LINES_A_SECOND: Final = 400
_PATIENCE_S: Final = 5.0
"""Time in seconds after which whoever does not read any more counts as gone."""

_LONGEST_WORD: Final = 200


_COMES_BACK: Final = frozenset({"name", "value"})
"""Keys of what a press brings back: it is no sentence, and stays as it is."""


def _visible(value: object, *, said: bool = True) -> object:
    """Return what is sent: no control characters, as on a terminal, and a page's own ways.

    Args:
        value: Any part of a line.
        said: Whether its texts are for a person.
    """
    match value:
        case str():
            return on_a_page(visible(value)) if said else visible(value)
        case dict():
            return {key: _visible(one, said=key not in _COMES_BACK) for key, one in value.items()}
        case list() | tuple():
            return [_visible(one, said=said) for one in value]
        case _:
            return value


class WireLink:
    """The wire, from its job's side.

    Args:
        wire: A connected stream socket, which belongs to this object from now on.
    """

    def __init__(self, wire: socket.socket) -> None:
        wire.setblocking(False)
        self._wire = wire
        self._lock = threading.Lock()
        self._sending = threading.Lock()
        self._presses: deque[Pressed] = deque()
        self._lease = JogLease()
        self._alive_s = time.monotonic()
        self._left = self._broken = False
        self.came = threading.Event()
        """Set when something came; whoever looks clears it."""
        threading.Thread(target=self._read, name="wire", daemon=True).start()

    @property
    def left(self) -> bool:
        """Whether nobody is at the other end any more."""
        return self._left

    def silent_s(self) -> float:
        """Return for how long nothing was heard of the seat, in seconds."""
        return math.inf if self._left else time.monotonic() - self._alive_s

    def presses(self) -> list[Pressed]:
        """Return what was pressed since the last call."""
        with self._lock:
            found = list(self._presses)
            self._presses.clear()
            return found

    def held(self) -> Hold | None:
        """Return the key that is held now; ``None`` for none."""
        with self._lock:
            return self._lease.held(time.monotonic())

    def spend_sign(self) -> bool:
        """Return whether the next step of the held key may begin now, once for each sign."""
        with self._lock:
            return self._lease.spend(time.monotonic())

    def end_held(self) -> None:
        """End what is held."""
        with self._lock:
            self._lease.end()

    def send(self, line: Mapping[str, object]) -> bool:
        """Send a line; return whether it went out, which one that is too long does not.

        Who does not read for a time counts as gone, so that nothing waits for them for ever.
        """
        text = json.dumps(_visible(line), ensure_ascii=False, allow_nan=False)
        data = text.encode("utf-8", "replace") + b"\n"
        if len(data) > LONGEST_LINE:
            return False
        with self._sending:
            return self._send(data)

    def _send(self, data: bytes) -> bool:
        rest = memoryview(data)
        end_s = time.monotonic() + _PATIENCE_S
        while rest and not self._broken:
            try:
                sent = self._wire.send(rest)
            except BlockingIOError:
                left_s = end_s - time.monotonic()
                if left_s <= 0 or not select.select([], [self._wire], [], left_s)[1]:
                    self._break()
            except (OSError, ValueError):
                self._break()
            else:
                rest = rest[sent:]
        return not rest

    def close(self) -> None:
        """Close the wire."""
        self._break()
        with self._sending:
            self._wire.close()

    def _break(self) -> None:
        self._broken = True
        self._leave()

    def _leave(self) -> None:
        self._left = True
        self.came.set()

    def _read(self) -> None:
        held, skips, began_s, count = b"", False, time.monotonic(), 0
        try:
            while not self._left:
                if not select.select([self._wire], [], [], 1.0)[0]:
                    continue
                data = self._wire.recv(LONGEST_LINE)
                if not data:
                    break
                *lines, held = (held + data).split(b"\n")
                for line in lines:
                    if not skips and len(line) < LONGEST_LINE:
                        self._take(line)
                    skips = False
                    count += 1
                if len(held) >= LONGEST_LINE:
                    held, skips = b"", True
                now_s = time.monotonic()
                if now_s - began_s >= 1.0:
                    began_s, count = now_s, 0
                elif count > _MOST_LINES_A_SECOND:
                    time.sleep(1.0 - (now_s - began_s))
        except (OSError, ValueError):
            pass  # closed: nobody is there any more
        finally:
            self._leave()

    def _take(self, line: bytes) -> None:
        try:
            said = json.loads(line)
        except (ValueError, RecursionError):
            return
        if not isinstance(said, dict):
            return
        now_s = time.monotonic()
        match said:
            case {"t": "alive"}:
                self._alive_s = now_s
                return
            case {"t": "leave"}:
                self._leave()
                return
            case {"t": "press", "number": int(number), "action": str(action), "value": str(value)}:
                if max(len(action), len(value)) <= _LONGEST_WORD and not isinstance(number, bool):
                    self._press(Pressed(number, action, value, now_s))
            case {"t": "hold", "number": int(number), "axis": str(axis), "finger": str(finger)}:
                if max(len(axis), len(finger)) <= _LONGEST_WORD and not isinstance(number, bool):
                    with self._lock:
                        self._lease.hold(number, axis, finger, now_s)
            case {"t": "beat", "finger": str(finger)}:
                with self._lock:
                    self._lease.beat(finger, now_s)
            case {"t": "release", "finger": str(finger)} if len(finger) <= _LONGEST_WORD:
                with self._lock:
                    self._lease.release(finger)
            case _:
                return
        self.came.set()

    def _press(self, press: Pressed) -> None:
        with self._lock:
            if len(self._presses) < _MOST_PRESSES:
                self._presses.append(press)
