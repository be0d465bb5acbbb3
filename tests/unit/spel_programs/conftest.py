"""Programs in a simulated controller whose time the test steps."""

from pathlib import Path

import pytest
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.epson.spel.source_text import ProgramRefused
from robolink_simulators.epson.spel.tasks.runner import ProgramRunner

from robolink.errors import ConfigError

NS = 1_000_000_000


class Cell:
    """A controller with one program in it."""

    def __init__(self, folder: Path, options: EpsonOptions) -> None:
        self.folder = folder
        self.simulator = EpsonSimulator(options=options, serial="SIM00001")
        self.runner: ProgramRunner

    def load(self, text, *, files=None, points=(), ports=None):
        """Load a main.prg and the files beside it."""
        for name, content in (files or {}).items():
            data = content if isinstance(content, bytes) else content.encode()
            (self.folder / name).write_bytes(data)
        main = self.folder / "main.prg"
        main.write_text(text, encoding="utf-8")
        programs = [main, *sorted(p for p in self.folder.glob("*.prg") if p != main)]
        paths = [self.folder / name for name in points]
        self.runner = self.simulator.load(programs, paths, ports=ports)
        return self

    def run(self, function="main", *, most_s=1000.0):
        """Start a function and let time pass until all tasks have ended; return the output."""
        before = len(self.runner.console)
        self.runner.start(function, self.simulator.now_ns)
        end_ns = self.simulator.now_ns + round(most_s * NS)
        while self.runner.tasks:
            change = self.simulator.next_change()
            if change is None or change > end_ns:
                break
            self.simulator.advance(change)
        return "".join(list(self.runner.console)[before:]).splitlines()

    @property
    def now_s(self):
        """Simulated time."""
        return self.simulator.now_ns / NS


@pytest.fixture
def cell(tmp_path):
    """Makes cells; options are those of the controller."""

    cells = []

    def make(text="", **options):
        files = options.pop("files", None)
        points = options.pop("points", ())
        ports = options.pop("ports", None)
        made = Cell(tmp_path, EpsonOptions(**options))
        cells.append(made)
        return made.load(text, files=files, points=points, ports=ports) if text else made

    yield make
    for made in cells:
        if made.simulator.program is not None:
            made.simulator.program.forget()


@pytest.fixture
def printed(cell):
    """Returns the output of a function main with the given lines."""

    def run(*lines, **options):
        made = cell("\n".join(["Function main", *lines, "Fend"]), **options)
        shown = made.run()
        assert made.runner.failure is None, made.runner.failure
        return shown

    return run


@pytest.fixture
def failure(cell):
    """Returns the error of a function main with the given lines."""

    def run(*lines, **options):
        made = cell("\n".join(["Function main", *lines, "Fend"]), **options)
        made.run()
        assert made.runner.failure is not None
        return made.runner.failure

    return run


@pytest.fixture
def faults(cell):
    """Return the faults in a program's text."""

    def look(text, **options):
        try:
            cell(text, **options)
        except ProgramRefused as refused:
            return [str(fault) for fault in refused.faults]
        except ConfigError as refused:
            return [str(refused)]
        return []

    return look
