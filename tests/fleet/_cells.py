"""The cells of a campaign, and clocks that are wrong."""

import json
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, Self

PROGRAM = (sys.executable, "-m", "robolink_cli")
SILENT_BACKLOG = 64


@contextmanager
def served_cells(
    folder: Path,
    count: int,
    *,
    name: str = "c",
    port: int = 0,
    program: Sequence[str] = PROGRAM,
) -> Iterator[Mapping[str, Any]]:
    """Serve simulated EPSON cells in a process of their own.

    Args:
        folder: Takes their file.
        count: How many.
        name: What they are called.
        port: The first of their ports; free ones unless given.
        program: The words that start ``robolink``.
    """
    if not count:
        yield {}
        return
    file = folder / f"{name}.toml"
    file.write_text(
        f'schema = "robolink/sim-cells/1"\n[cells.{name}]\nkind = "epson"\n'
        f'count = {count}\ntcp = "127.0.0.1:{port}"\n'
    )
    command = [*program, "--json", "sim", "run", str(file)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    with process:
        try:
            assert process.stdout is not None
            found = json.loads(process.stdout.readline())["cells"]
            # one alone is called by the bare name
            yield {one if count > 1 else f"{name}-1": about for one, about in found.items()}
        finally:
            process.terminate()


class LateCells:
    """Cells that are off at first: of one half the port is closed, the other accepts and is silent.

    Half of each come back; the others never do. A context manager.

    Attributes:
        urls: Of all of them.
        cells: Those that came back, as ``sim run`` told them.
    """

    def __init__(self, folder: Path, count: int) -> None:
        self._folder = folder
        self._back = count // 2
        self._stack = ExitStack()
        self._ports = _free_range(count)
        self.urls = {
            f"late-{number + 1}": f"epson+tcp://127.0.0.1:{port}"
            for number, port in enumerate(self._ports)
        }
        self.cells: dict[str, Any] = {}
        self._silent: list[socket.socket] = []

    def __enter__(self) -> Self:
        for port in self._ports[::2]:
            silent = socket.create_server(("127.0.0.1", port), backlog=SILENT_BACKLOG)
            self._silent.append(silent)
        return self

    def __exit__(self, *_: object) -> None:
        for silent in self._silent:
            silent.close()
        self._stack.close()

    def come_back(self) -> None:
        """Serve the first half from now on."""
        first = self._ports[: self._back]
        for silent in self._silent:
            if silent.getsockname()[1] in first:
                silent.close()
        cells = served_cells(self._folder, self._back, name="late", port=first[0])
        served = self._stack.enter_context(cells)
        by_url = {str(about["url"]): about for about in served.values()}
        ours = {f"{url.rpartition(':')[2]}": one for one, url in self.urls.items()}
        for url, about in by_url.items():
            port = "".join(letter for letter in url.rpartition(":")[2] if letter.isdigit())
            self.cells[ours[port]] = about
        self._silent = [one for one in self._silent if one.fileno() >= 0]


def _free_range(count: int) -> list[int]:
    """Return ports that follow each other, of which none is in use now."""
    for first in range(20_000, 30_000, count):
        ports = [*range(first, first + count)]
        with suppress(OSError), ExitStack() as stack:
            for port in ports:
                stack.enter_context(socket.create_server(("127.0.0.1", port)))
            return ports
    raise OSError("no ports that follow each other are free")


class ClockFile:
    """A clock that is wrong, and set while programs run; see ``_wrong_clock.py``.

    Attributes:
        program: The words that start ``robolink`` on that computer.
    """

    def __init__(self, folder: Path, name: str, *, days: float = 0.0) -> None:
        self._file = folder / name
        self.set(days)
        self.program = (sys.executable, "-m", "tests.fleet._wrong_clock", str(self._file))

    def set(self, days: float) -> None:
        """Set it so many days ahead."""
        draft = self._file.with_suffix(".new")
        draft.write_text(str(days * 86_400))
        draft.replace(self._file)
