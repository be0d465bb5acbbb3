"""The files through which a tool write, a recipe, a request in the simulator and poses pass.

``python -m tests.packaging._way_to_the_wire`` prints them. It counts the files of the three
packages in which a function is entered, once each, from the call of a function of a given name
until the request is passed to the socket: that of the tool write, or the first movement of a
recipe. In the simulator, from the bytes of a tool write until its tool is stored; with poses, from
the call of the method's ``solve`` until it returns. Not counted: code that runs because a module is
being imported, and class bodies and comprehensions, since nothing is entered there.
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
    """The functions entered on the way, by the function at which counting starts.

    Attributes:
        request: A part of the request's bytes.
        entered: For each function at which counting starts, the files and their functions.
        stack: The calls that were open when the request was sent, outermost first, as file and
            function; empty until then.
    """

    request: bytes
    entered: dict[str, dict[str, set[str]]]
    stack: list[tuple[str, str]] = field(default_factory=list)
    _begun: set[str] = field(default_factory=set)
    _importing: FrameType | None = None

    def follow(self, act: Callable[[], object]) -> None:
        """Call ``act``, and record each call of this thread meanwhile."""
        sys.setprofile(self._look)
        try:
            act()
        finally:
            sys.setprofile(None)

    def of_the_library(self, name: str) -> set[str]:
        """Return the entered files of the library, from a function on."""
        return {file for file in self.entered[name] if file.startswith("robolink/")}

    def _look(self, frame: FrameType, event: str, called: object) -> None:
        if self.stack:
            sys.setprofile(None)
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


@dataclass
class WayToTheSolver(WayToTheWire):
    """The functions entered while poses are solved, from the method's ``solve`` until it returns.

    ``stack`` holds the calls that were open when most files were, from :meth:`PointsSource.find`
    on, where the poses are made; ``command`` the same from the command's function on.
    """

    command: list[tuple[str, str]] = field(default_factory=list)
    _solving: FrameType | None = None
    _deepest: list[tuple[str, str]] = field(default_factory=list)

    def _look(self, frame: FrameType, event: str, called: object) -> None:
        if event == "return" and frame is self._solving:
            names = [function for _, function in self._deepest]
            self.stack = self._deepest[names.index("find") :]
            self.command = self._deepest[names.index("calibrate_with") :]
        super()._look(frame, event, called)

    def _sends(self, frame: FrameType) -> bool:
        return False

    def _enter(self, frame: FrameType) -> None:
        if self._solving is None and frame.f_code.co_qualname == "TwoTouches.solve":
            self._solving = frame
        super()._enter(frame)
        calls = list(reversed(list(_calls(frame)))) if self._solving is not None else []
        if len({file for file, _ in calls}) > len({file for file, _ in self._deepest}):
            self._deepest = calls


@dataclass
class WayIntoTheSimulator(WayToTheWire):
    """The functions entered from the bytes of a request until the simulator has stored its tool."""

    def _sends(self, frame: FrameType) -> bool:
        return False

    def _enter(self, frame: FrameType) -> None:
        super()._enter(frame)
        if frame.f_code.co_qualname == "ToolMemory.set":
            self.stack = list(reversed(list(_calls(frame))))


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

    The first one makes the journal and the first backup, which a controller needs once.

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


def follow_a_recipe(url: str, recipe: Path, assist: str) -> WayToTheWire:
    """Change a nozzle by a recipe, and follow it up to the first movement.

    Args:
        url: The controller, an EPSON one. Its robot moves, and its tool is written.
        recipe: The recipe.
        assist: The person at the cell.
    """
    from robolink_cli import main

    words = ["-c", url, "recalibrate", str(recipe), "--assist", assist, "--yes"]
    way = WayToTheWire(b'$Execute,"Move ', {"run": {}})
    way.follow(lambda: main.run(words))
    return way


def follow_into_the_simulator() -> WayIntoTheSimulator:
    """Hand two tool writes to a simulated EPSON controller, and follow the second.

    With the first it has parsed a line of this shape, which it does once in a process.
    """
    from robolink_simulators.epson.device import EpsonSimulator

    simulator = EpsonSimulator(seed=1)
    link = simulator.connect(0)
    link.receive(b"$Login\r\n", 0)

    def write(x_mm: float, at_s: int) -> None:
        line = f'$Execute,"TLSet 1, XY({x_mm}, 0, 0, 0)"\r\n'
        link.receive(line.encode(), at_s * 1_000_000_000)
        simulator.advance((at_s + 1) * 1_000_000_000)

    write(12.5, 1)
    way = WayIntoTheSimulator(b"", {"receive": {}})
    way.follow(lambda: write(12.7, 3))
    return way


def follow_typed_poses(url: str) -> WayToTheSolver:
    """Calibrate tool 1 from two poses on the command line, twice, and follow the second time.

    Args:
        url: The controller, whose tool is written.
    """
    from robolink_cli import main

    def calibrate(x_mm: str) -> None:
        poses = ("--pose", f"{x_mm},100,0", "--pose", "290,104,180", "--max-change", "50", "--yes")
        assert main.run(["-c", url, "calibrate", "two-pose", "--tool", "1", *poses]) == 0

    calibrate("300")
    way = WayToTheSolver(b"", {"solve": {}})
    way.follow(lambda: calibrate("301"))
    return way


def main() -> None:
    """Print the files for a tool write and two poses, with a simulated controller."""
    import os

    from robolink_simulators.cell.clock import ScaledClock
    from robolink_simulators.epson.device import EpsonSimulator
    from robolink_simulators.hosting.streams.epson import serve_tcp

    with tempfile.TemporaryDirectory() as folder:
        os.environ["ROBOLINK_STATE_DIR"] = folder
        with serve_tcp(EpsonSimulator(seed=1), clock=ScaledClock()) as served:
            way = follow_a_tool_write(served.url)
            poses = follow_typed_poses(served.url)
    _print_entered(way)
    _print_calls("open when the request is sent", way.stack)
    _print_entered(poses)
    _print_calls("open from the command's function on, where most files are", poses.command)


def _print_entered(way: WayToTheWire) -> None:
    for name, files in way.entered.items():
        print(f"\n{len(files)} files from {name}() on")  # noqa: T201
        for file, functions in sorted(files.items()):
            print(f"  {file}: {', '.join(sorted(functions))}")  # noqa: T201


def _print_calls(when: str, calls: list[tuple[str, str]]) -> None:
    print(f"\n{len(calls)} calls, {len({file for file, _ in calls})} files {when}")  # noqa: T201
    for file, function in calls:
        print(f"  {file}: {function}")  # noqa: T201


if __name__ == "__main__":
    main()
