"""How large the house is: lines, rooms, functions, and the files that an act passes through.

::

    .venv/bin/python -m tools.house                    # prints the table
    .venv/bin/python -m tools.house --write            # and writes it into docs/contributing.md
    .venv/bin/python -m tools.house --write --cpu 480  # with what `make test` cost, in seconds

A line of code is one that is neither blank, nor of a docstring, a comment or an import. A function
is as long as its lines from ``def`` to its end. CPU is not measured here: without ``--cpu`` the
table keeps the figure that it has, with its date.
"""

import argparse
import io
import os
import re
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from statistics import median
from typing import Final

ROOT: Final = Path(__file__).parents[1]
PAGE: Final = ROOT / "docs" / "contributing.md"
PARTS: Final = {
    "robolink": "robolink",
    "robolink_simulators": "simulators/robolink_simulators",
    "robolink_cli": "cli/robolink_cli",
    "tests": "tests",
}
"""The parts and their folders."""

COLUMNS: Final = ("code", "modules", "folders", "median", "p90")
BEGIN: Final = "<!-- house: written by tools/house.py -->"
END: Final = "<!-- house: end -->"

_IMPORT: Final = re.compile(r"(from \S+ )?import [\w(.*]")
_DOCSTRING: Final = re.compile(r'[rR]?"""')
_CPU: Final = re.compile(r"`make test` cost .*")


@dataclass
class Count:
    """What a part, or one module, holds.

    Attributes:
        code: Lines of code.
        modules: Files.
        folders: Those with a module in them.
        lengths: Of each function, in lines.
    """

    code: int = 0
    modules: int = 0
    folders: int = 0
    lengths: list[int] = field(default_factory=list)

    @property
    def figures(self) -> tuple[int, ...]:
        """Return the figures of :data:`COLUMNS`."""
        ordered = sorted(self.lengths)
        p90 = ordered[len(ordered) * 9 // 10] if ordered else 0
        middle = round(median(ordered)) if ordered else 0
        return self.code, self.modules, self.folders, middle, p90


def count_part(folder: Path) -> Count:
    """Count a folder and all beneath it."""
    files = sorted(folder.rglob("*.py"))
    whole = Count(modules=len(files), folders=len({file.parent for file in files}))
    for file in files:
        one = count_module(file.read_text(encoding="utf-8"))
        whole.code += one.code
        whole.lengths += one.lengths
    return whole


def count_module(text: str) -> Count:
    """Count one module, line by line, as the formatter leaves it.

    To parse all modules costs twenty times as much, too much for a test of every run.
    """
    count = Count(modules=1)
    begun: list[tuple[int, int]] = []  # indentation and first line of the functions around
    last = 0
    for number, line, prose, inside in _lines(text.splitlines()):
        stripped = line.strip()
        if not inside and stripped and not stripped.startswith("#"):
            indent = len(line) - len(line.lstrip())
            while begun and _is_over(begun[-1][0], indent, stripped):
                count.lengths.append(last - begun.pop()[1] + 1)
            if stripped.startswith(("def ", "async def ")):
                begun.append((indent, number))
        if inside or (stripped and not stripped.startswith("#")):
            last = number if stripped or inside else last
            count.code += not prose and bool(stripped)
    count.lengths += [last - first + 1 for _, first in begun]
    return count


def _is_over(around: int, indent: int, stripped: str) -> bool:
    return indent < around or (indent == around and not stripped.startswith(")"))


def _lines(lines: list[str]) -> Iterator[tuple[int, str, bool, bool]]:
    """Yield each line: number, text, whether it is no code, whether a text of several goes on."""
    quoted = prose = bracket = False
    for number, line in enumerate(lines, 1):
        stripped, inside = line.strip(), quoted
        if not quoted and not bracket:
            prose = bool(_DOCSTRING.match(stripped))
        if not quoted and (bracket or _IMPORT.match(stripped)):
            bracket = ")" not in stripped if bracket or stripped.endswith("(") else False
            yield number, line, True, False
            continue
        if line.count('"""') % 2:
            quoted = not quoted
        yield number, line, prose, inside


def counts() -> dict[str, tuple[int, ...]]:
    """Return the figures of every part."""
    return {part: count_part(ROOT / folder).figures for part, folder in PARTS.items()}


def walks() -> dict[str, int]:
    """Return how many files each act passes through, on a simulated controller."""
    from robolink_simulators.cell.clock import ScaledClock
    from robolink_simulators.control.assist import serve_assist
    from robolink_simulators.epson.device import EpsonSimulator
    from robolink_simulators.epson.options import EpsonOptions
    from robolink_simulators.hosting.streams.epson import serve_tcp
    from robolink_simulators.testkit.operator import written_recipe

    from tests.packaging._way_to_the_wire import (
        follow_a_recipe,
        follow_a_tool_write,
        follow_into_the_simulator,
    )

    patient = EpsonOptions(remote_timeout_s=0, login_timeout_s=0)
    simulator, clock = EpsonSimulator(seed=1, options=patient), ScaledClock(200)
    simulator.machine.motors_on = True
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        os.environ["ROBOLINK_STATE_DIR"] = folder
        stack.enter_context(redirect_stdout(io.StringIO()))
        stack.enter_context(redirect_stderr(io.StringIO()))
        served = stack.enter_context(serve_tcp(simulator, clock=clock))
        person = stack.enter_context(serve_assist(simulator, clock=clock))
        write = follow_a_tool_write(served.url)
        change = follow_a_recipe(served.url, written_recipe(Path(folder)), person.url)
        request = follow_into_the_simulator()
    return {
        "`tool set` to its bytes": len(write.of_the_library("run")),
        "a recipe to its first movement": len(change.of_the_library("run")),
        "a request to the simulator's `TLSet`": len(request.entered["receive"]),
    }


def table(counted: dict[str, tuple[int, ...]], walked: dict[str, int], cpu: str) -> str:
    """Return what the page shows."""
    return "\n".join(
        [
            f"Counted after commit {_commit()}, {_today()}:",
            "",
            "| part | code | modules | folders | functions, median | functions, p90 |",
            "|---|---|---|---|---|---|",
            *(f"| {part} | {_row(figures)} |" for part, figures in counted.items()),
            "",
            "| way | files |",
            "|---|---|",
            *(f"| {way} | {files} |" for way, files in walked.items()),
            "",
            cpu,
        ]
    )


def _row(figures: tuple[int, ...]) -> str:
    return " | ".join(f"{figure:,}" for figure in figures)


def told(page: str) -> tuple[dict[str, tuple[int, ...]], dict[str, int]]:
    """Return the counts and the ways that a page shows."""
    rows = [line.strip("| ").split(" | ") for line in _between(page).splitlines() if "|" in line]
    figures = {
        row[0]: tuple(int(cell.replace(",", "")) for cell in row[1:])
        for row in rows
        if row[-1].replace(",", "").isdigit()
    }
    parts = {name: cells for name, cells in figures.items() if name in PARTS}
    return parts, {name: cells[0] for name, cells in figures.items() if name not in PARTS}


def _between(page: str) -> str:
    return page.partition(BEGIN)[2].partition(END)[0]


def _commit() -> str:
    command = ["git", "rev-parse", "--short", "HEAD"]
    return subprocess.run(
        command, cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout.strip()


def _today() -> str:
    today = date.today()  # noqa: DTZ011 - the local date
    return f"{today.day} {today:%B %Y}"


def main() -> None:
    """Print the table; write it where that is asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--write", action="store_true", help="into docs/contributing.md")
    parser.add_argument("--cpu", type=int, help="seconds of user and sys of `make test`")
    asked = parser.parse_args()
    page = PAGE.read_text(encoding="utf-8")
    if asked.cpu is not None:
        cpu = f"`make test` cost {asked.cpu} s of CPU ({_today()})."
    else:
        kept = _CPU.search(_between(page))
        cpu = kept[0] if kept else "`make test` cost: not measured."
    shown = table(counts(), walks(), cpu)
    print(shown)  # noqa: T201
    if asked.write:
        before, _, rest = page.partition(BEGIN)
        after = rest.partition(END)[2]
        PAGE.write_text(f"{before}{BEGIN}\n{shown}\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
