"""A cell for a Windows program: a simulated controller of this machine, and a needle's recipe."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

from tests.windows._consoles import Way, WindowsConsole
from tests.windows._windows_python import ROOT, WindowsPython

RECIPE: Final = ROOT / "examples" / "recipes" / "scara-pin.toml"
CELL: Final = """
[cells.line3]
url = "{url}"
remote_timeout_s = 600
remote_timeout_confirmed_by = "the test: it is a simulator"
"""

Opener = Callable[..., WindowsConsole]


@contextmanager
def cell_for_windows(
    python: WindowsPython,
    simulator: EpsonSimulator,
    state: Mapping[str, str],
    folder: Path,
    pace: float,
) -> Iterator[Opener]:
    """Serve a simulator at a pace; yield what runs a command on it in a console of Windows."""
    consoles: list[WindowsConsole] = []
    with serve_tcp(simulator, clock=ScaledClock(pace)) as host:
        (folder / "robolink.toml").write_text(CELL.format(url=host.url))
        (folder / "needle.toml").write_bytes(RECIPE.read_bytes())

        def opened(way: Way, *words: str, language: str = "en", **more: Any) -> WindowsConsole:
            words = ("--lang", language, "-c", "line3", *words)
            console = WindowsConsole(python, way, words, state, folder, simulator, **more)
            consoles.append(console)
            return console

        try:
            yield opened
        finally:
            for console in consoles:
                console.close()
