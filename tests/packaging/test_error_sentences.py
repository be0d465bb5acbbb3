"""Every error raised in the sources: three lines with likely values, and what to do.

``tests/cli/test_wrong_commands.py`` checks the answers to wrong commands; this module checks all
others whose sentences are written where they are raised.
"""

import ast
import re
from pathlib import Path

import pytest
from robolink_cli.console.tables import SCREEN, within

from robolink import errors

pytestmark = pytest.mark.soak

ROOT = Path(__file__).parents[2]
SHIPPED = ("robolink", "cli", "simulators")
KINDS = {name for name in errors.__all__ if name.endswith("Error")}
MOST_LINES = 3

OFFSET = "X 12.324 Y -3.729 Z -20.000 U 0.000"
URL = "epson+tcp://192.168.0.1:5000"
LIKELY = {
    **dict.fromkeys(("before", "expected", "found", "now", "offset", "requested"), OFFSET),
    **dict.fromkeys(("controller", "identity", "url"), URL),
    **dict.fromkeys(("cause", "error"), "Connection reset by peer"),
    **dict.fromkeys(("count", "line", "most", "number", "read", "slot", "tool", "written"), "64"),
    "axes": "4",
    "axis": "X",
    "baud": "9600",
    "file": "/home/cell/needle.toml",
    "folder": "/home/cell/robolink",
    "holder": "K. Sato at cell-pc-3, process 4711",
    "names": "line3, line4, north, locked",
    "parity": "even",
    "password": "keyring, --password-file or ROBOLINK_PASSWORD",
    "path": "/home/cell/robolink/needle.toml",
    "pose": "X 287.500 Y 103.250 Z -104.000 U 180.000",
    "request": "TLSet 1, XY(12.324,-3.729,-20.000,0.000)",
    "robot": "T6-602S",
    "seconds": "10",
    "shown": "0.7",
    "sign": "3 s ago",
    "since": "14:58",
    "unit": "255",
    "wait": "--wait SECONDS",
    "what": "it has no line that names its 3 columns",
    "when": "2026-11-29 14:58 (UTC+1)",
    "why": "the disk is full",
}
"""Values of a likely length; all others are a name or a number."""

OF_VARIABLES = "{request} was accepted, but reads back as {found!r}, not {requested!r}."
"""The sentence about a variable, whose values are never a whole offset."""

OF_CELLS = "Cell {cell} needs robot {expected}; at {url} there is {found}."
"""The sentence about a cell, whose values are robot models."""

TOLD_TO_PROGRAMS = ("robolink/serving/", "robolink/protocols/", "robolink/testing/")
"""Errors raised here become a line for a robot program, or a report: nobody reads what to do."""

SAID_ELSEWHERE = {
    "LeaseHeldError at robolink/controllers/softmotion/ownership.py",  # set when it is known
    "ControllerFaultError at robolink/controllers/epson/vision_looks.py",  # the cause of another
}


def sentence(node):
    """Return the sentence of an expression; ``None`` if it is not written there."""
    if not isinstance(node, ast.Call):
        return node.value if isinstance(node, ast.Constant) else None
    name = getattr(node.func, "id", "")
    if name == "tr" and isinstance(node.args[0], ast.Constant):
        return node.args[0].value
    if name == "joined" and isinstance(node.args[1], ast.Tuple):
        parts = list(map(sentence, node.args[1].elts))
        return None if None in parts else " ".join(parts)
    return "Choose one of 75: needle-beams, needle-pin ..." if name == "known_names" else None


def filled(text):
    """Return a sentence with likely values."""

    def value(found):
        if re.search(r"[a-z]$", found["form"] or ""):
            return "10" if found["form"].endswith((".0f", "d")) else "-112.345"
        if text in (OF_CELLS, OF_VARIABLES) and found["name"] in ("found", "requested", "expected"):
            return "C8-C901S"
        return LIKELY.get(found["name"], "needle-12")

    said = re.sub(r"(?<!{){(?P<name>\w+)(![rs])?(?P<form>:[^{}]*)?}", value, text)
    return said.replace("{{", "{").replace("}}", "}")


@pytest.fixture(scope="module")
def raised():
    """Return all calls that make an error: place, class, what happened, what to do."""
    found = []
    for folder in SHIPPED:
        for path in sorted((ROOT / folder).rglob("*.py")):
            place = path.relative_to(ROOT).as_posix()
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if not isinstance(node, ast.Call):
                    continue
                kind = getattr(node.func, "id", "")
                if kind in KINDS:
                    given = node.args[kind == "CalibrationError" :]
                    remedy = [one.value for one in node.keywords if one.arg == "remedy"]
                    found.append((f"{kind} at {place}", node.lineno, given, remedy))
    assert len(found) > 700, "the search finds nothing"
    return found


def test_an_error_takes_three_lines(raised):
    long = []
    for place, line, given, remedy in raised:
        what = sentence(given[0]) if given else None
        do = sentence(remedy[0]) if remedy else ""
        if what is not None and do is not None:
            told = f"robolink: {filled(what)}" + f"\n  {filled(do)}" * bool(do)
            shown = within(told, SCREEN)
            if shown.count("\n") >= MOST_LINES:
                long.append(f"{place}:{line}\n{shown}")
    assert not long, f"{len(long)} of {len(raised)} take more:\n" + "\n".join(long)


def test_an_error_says_what_to_do(raised):
    without = [
        f"{place}:{line}"
        for place, line, _, remedy in raised
        if not remedy
        and place not in SAID_ELSEWHERE
        and not place.partition(" at ")[2].startswith(TOLD_TO_PROGRAMS)
    ]
    assert without == []
