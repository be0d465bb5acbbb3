"""Which files a tool write passes through before its request is sent.

``python -m tests.packaging._way_to_the_wire`` prints them. Counted are files of the three packages
in which a function is entered, once each, from the call of a function of a given name until the
request is handed to the socket. Not counted: what runs because a module is being imported, and
class bodies and comprehensions of their own, since nothing is entered there.
"""

import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Final

ROOT: Final = Path(__file__).parents[2]
PACKAGES: Final = tuple(
    str(ROOT / package) + "/"
    for package in ("robolink", "cli/robolink_cli", "simulators/robolink_simulators")
)
_FUNCTION: Final = 1  # CO_OPTIMIZED: the code of a function, not of a module or a class


@dataclass
class WayToTheWire:
    """What was entered on the way, by the function from which it is counted.

    Attributes:
        request: What the bytes of the request contain.
        entered: For each function from which is counted, the files and their functions.
        stack: The calls that were open when the request was sent, outermost first, as file and
            function; empty until then.
    """

    request: bytes
    entered: dict[str, dict[str, set[str]]]
    stack: list[tuple[str, str]] = field(default_factory=list)
    _begun: set[str] = field(default_factory=set)
    _importing: FrameType | None = None

    def follow(self, act: Callable[[], object]) -> None:
        """Call ``act``, and look at each call of this thread meanwhile."""
        sys.setprofile(self._look)
        try:
            act()
        finally:
            sys.setprofile(None)

    def _look(self, frame: FrameType, event: str, called: object) -> None:
        if self.stack:
            return
        if event == "c_call":
            if getattr(called, "__name__", "") == "send" and self._sends(frame):
                self.stack = list(reversed(list(_calls(frame))))
            return
        if event == "call" and self._importing is None:
            self._enter(frame)
        elif event == "return" and frame is self._importing:
            self._importing = None

    def _sends(self, frame: FrameType) -> bool:
        return self.request in bytes(frame.f_locals.get("data", b""))

    def _enter(self, frame: FrameType) -> None:
        code = frame.f_code
        if code.co_filename.startswith("<frozen importlib"):
            self._importing = frame
            return
        file = _file_of(frame)
        if file is None or not code.co_flags & _FUNCTION:
            return
        if code.co_name in self.entered:
            self._begun.add(code.co_name)
        for name in self._begun:
            self.entered[name].setdefault(file, set()).add(code.co_qualname)


def _calls(frame: FrameType | None) -> "list[tuple[str, str]]":
    found = []
    while frame is not None:
        file = _file_of(frame)
        if file is not None:
            found.append((file, frame.f_code.co_name))
        frame = frame.f_back
    return found


def _file_of(frame: FrameType) -> str | None:
    name = frame.f_code.co_filename
    return str(Path(name).relative_to(ROOT)) if name.startswith(PACKAGES) else None


def follow_a_tool_write(url: str) -> WayToTheWire:
    """Write tool 1 from the command line, twice, and follow the second write.

    The first makes the journal and the first backup: what a controller costs once.

    Args:
        url: The controller.
    """
    from robolink_cli import main

    def write(x_mm: float) -> None:
        assert main.run(["-c", url, "tool", "set", "1", "--x", str(x_mm), "--yes"]) == 0

    write(12.5)
    way = WayToTheWire(b"TLSet 1,", {"run": {}, "set_tool": {}, "change_tools": {}})
    way.follow(lambda: write(12.7))
    return way


def main() -> None:
    """Print what a tool write of a simulated controller passes through."""
    import os

    from robolink_simulators.cell.clock import ScaledClock
    from robolink_simulators.epson.device import EpsonSimulator
    from robolink_simulators.hosting.streams.epson_tcp import serve_tcp

    with tempfile.TemporaryDirectory() as folder:
        os.environ["ROBOLINK_STATE_DIR"] = folder
        with serve_tcp(EpsonSimulator(seed=1), clock=ScaledClock()) as served:
            way = follow_a_tool_write(served.url)
    for name, files in way.entered.items():
        print(f"\n{len(files)} files from {name}() on")  # noqa: T201
        for file, functions in sorted(files.items()):
            print(f"  {file}: {', '.join(sorted(functions))}")  # noqa: T201
    print(f"\n{len(way.stack)} calls open when the request is sent")  # noqa: T201
    for file, function in way.stack:
        print(f"  {file}: {function}")  # noqa: T201


if __name__ == "__main__":
    main()
