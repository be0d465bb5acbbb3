"""Every error that is raised, in the sources: three lines at its likely fill, and what to do.

``tests/cli/test_wrong_commands.py`` holds the answers to wrong commands; this holds all others, as
far as their sentences stand where they are raised.
"""

import ast
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from robolink_cli.console.shell_words import SHELL_WAYS
from robolink_cli.console.tables import SCREEN, within

from robolink import errors
from robolink.controllers.softmotion.answers import motion_failure, refused
from robolink.protocols.mailbox import Command, ErrorClass, Opcode, Response
from robolink.remedy_words import RemedyWord
from robolink.transport.modbus.errors import refused as refused_by_modbus
from robolink.transport.modbus.frames import Area, ModbusRequest
from tests.packaging._raised_sentences import Said, Sentences
from tests.packaging._source_modules import called, together

pytestmark = pytest.mark.soak

ROOT = Path(__file__).parents[2]
SHIPPED = ("robolink", "cli", "simulators")
KINDS = {name for name in errors.__all__ if name.endswith("Error")}
MOST_LINES = 3

SHORT = 42
"""So much of an expression names an error in the list of those that differ."""

LIST = Path(__file__).with_name("error_sentences.txt")


def listed(head, end=""):
    """Return the errors of one part of the list, each with why it stands there."""
    part = LIST.read_text(encoding="utf-8").partition(f"\n{head}\n")[2]
    lines = (part.partition(f"\n\n{end}\n")[0] if end else part).splitlines()
    return {name: why.strip() for name, why in zip(lines[::2], lines[1::2], strict=True)}


LONGER = listed("LONGER", end="NOT FOLLOWED")
NOT_FOLLOWED = listed("NOT FOLLOWED")

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
    "station": "PIN-07",
    "turn": 180,
    "sign": "3 s ago",
    "since": "14:58",
    "unit": "255",
    "wait": "--wait SECONDS",
    "what": "it has no line that names its 3 columns",
    "when": "2026-11-29 14:58 (UTC+1)",
    "why": "the disk is full",
}
"""What fills a sentence, as long as it is likely to be; all else is a name or a number."""

OTHERWISE = {
    "{request} was accepted, but reads back as {found!r}, not {requested!r}.": "1.5",
    "Cell {cell} needs robot {expected}; at {url} there is {found}.": "C8-C901S",
    "Between touch {before} and {after} something moved by {shift:.2f} mm.": "3",
    "Station {id}: {what} must be known first.": "where it is",
    "{reference} (address {address}) of unit {unit}": "412290",
    "The journal {name} has form {found}; this robolink knows forms up to {own}.": "7",
}
"""Sentences whose names stand for something else than those of all others."""

OTHER_NAMES = {"address", "after", "before", "expected", "found", "own", "reference", "requested"}
OTHER_NAMES |= {"what"}

TOLD_TO_PROGRAMS = ("robolink/serving/", "robolink/protocols/", "robolink/testing/")
"""What is raised there is a line for a robot program, or a report: nobody reads what to do."""

SAID_ELSEWHERE = {
    "LeaseHeldError at robolink/controllers/softmotion/ownership.py",  # set when it is known
    "ControllerFaultError at robolink/controllers/epson/vision_looks.py",  # the cause of another
}


def filled(text, sentences):
    """Return a sentence with likely values, and with sentences where those are known."""

    def value(found):
        if found["name"] in sentences:
            return sentences[found["name"]]
        if re.search(r"[a-z]$", found["form"] or ""):
            return "10" if found["form"].endswith((".0f", "d")) else "-112.345"
        if text in OTHERWISE and found["name"] in OTHER_NAMES:
            return OTHERWISE[text]
        if found["name"] in RemedyWord.__dict__:
            return SHELL_WAYS[getattr(RemedyWord, found["name"])].format_map(LIKELY)
        return LIKELY.get(found["name"], "needle-12")

    said = re.sub(r"(?<!{){(?P<name>\w+)(![rs])?(?P<form>:[^{}]*)?}", value, text)
    return said.replace("{{", "{").replace("}}", "}")


LISTED = re.compile(r"(?<=:)(\n    .*)+")
"""What is wrong with a file, a line each; ``tests/cli/test_wrong_commands.py`` limits it."""

STANDS = re.compile(r"[.;] ?[Nn]othing (was|is|moved|has)\b|, and nothing (was|moved)")
"""What stands, after what to do."""


@dataclass(frozen=True)
class Raised:
    """A call that makes an error."""

    kind: str
    place: str
    line: int
    what: Any
    remedy: Any
    pairs: list[tuple[str, str]] | None
    """What it can say: what happened, what to do; ``None`` where that is not followed."""

    @property
    def named(self):
        """The place without a line, which changes with each change above."""
        return f"{self.kind} at {self.place}: {ast.unparse(self.what)[:SHORT].strip()}"

    @property
    def is_passed_on(self):
        """Whether it says what another error says, and nothing of its own."""
        texts = [self.what, *([self.remedy] if self.remedy else [])]
        if not all(isinstance(one, ast.Attribute) for one in texts):
            return False
        return [one.attr for one in texts] == ["what", "remedy"][: len(texts)] and len(
            {ast.unparse(one.value) for one in texts}
        ) == 1


@pytest.fixture(scope="module")
def raised():
    """All calls that make an error, with all that each can say."""
    sources = Sentences(ROOT, SHIPPED, filled)
    kinds = KINDS | heirs(sources)
    found = []
    for module in sources.modules.values():
        for call, function, owner in module.calls if module.name != "robolink.errors" else ():
            kind = called(call)
            if kind in kinds:
                scope = sources.scope(module, function, owner)
                given: list[Any] = call.args[kind == "CalibrationError" :] or [None]
                remedy = next((one.value for one in call.keywords if one.arg == "remedy"), None)
                whats = sources.said(given[0], scope)
                does = sources.said(remedy, scope) if remedy else [Said("")]
                pairs = None
                if whats and does:
                    here = scope.chosen.get(call, {})
                    pairs = [
                        (what.text, do.text)
                        for what in whats
                        for do in does
                        if together(what.chosen, do.chosen, here) is not None
                    ]
                at = (module.place, call.lineno)
                found.append(Raised(kind, *at, given[0], remedy, pairs))
    assert len(found) > 800, "the search finds nothing"
    return found


def heirs(sources):
    """Return the errors that are declared elsewhere and take what happened as they are."""
    return {
        name
        for module in sources.modules.values()
        for name, kind in module.classes.items()
        if module.name != "robolink.errors"
        and any(getattr(base, "id", "") in KINDS for base in kind.bases)
        and (name, "__init__") not in module.functions
    }


def shown(what, do):
    """Return what a terminal shows of an error."""
    return within(f"robolink: {LISTED.sub('', what)}" + f"\n  {do}" * bool(do), SCREEN)


def test_an_error_takes_three_lines(raised):
    long = {}
    for one in raised:
        for what, do in one.pairs or ():
            if shown(what, do).count("\n") >= MOST_LINES:
                long[one.named] = f"{one.place}:{one.line}\n{shown(what, do)}"
    assert not [text for name, text in long.items() if name not in LONGER], "\n".join(
        text for name, text in long.items() if name not in LONGER
    )
    assert sorted(LONGER) == sorted(long), "some are short by now: take them out"


def test_each_error_is_followed_to_its_sentences(raised):
    """None is left out but what only passes on another error, or is listed with its reason."""
    lost = {one.named for one in raised if not one.pairs and not one.is_passed_on}
    assert sorted(lost) == sorted(NOT_FOLLOWED)


def test_what_stands_comes_before_what_to_do(raised):
    wrong = {
        f"{one.place}:{one.line}: {do}"
        for one in raised
        for _, do in one.pairs or ()
        if STANDS.search(do)
    }
    assert sorted(wrong) == []


def test_an_error_says_what_to_do(raised):
    without = [
        f"{one.place}:{one.line}"
        for one in raised
        if one.remedy is None
        and f"{one.kind} at {one.place}" not in SAID_ELSEWHERE
        and not one.place.startswith(TOLD_TO_PROGRAMS)
    ]
    assert without == []


# Sentences whose two halves are chosen by one number: each number is tried.

WRITE = Command(7, Opcode.WRITE_TOOL, operands=(1, 0, 0, 0), pose=(12.324, -3.729, -20.0, 0, 0, 0))


@pytest.mark.parametrize("code", ErrorClass)
def test_each_refusal_of_a_plc_takes_three_lines(code):
    now = Response(error_class=code, raw_error=12108)
    for error in (refused(WRITE, now, code), motion_failure("11 MOVE_LINEAR", now, code)):
        assert shown(error.what, error.remedy).count("\n") < MOST_LINES, str(error)


@pytest.mark.parametrize("code", [*range(1, 9), 10, 11, 99])
def test_each_modbus_exception_takes_three_lines(code):
    for values in ((), (1, 2, 3)):
        request = ModbusRequest(255, 3, Area.HOLDING, 12289, 64, values)
        error = refused_by_modbus("modbus+tcp://192.168.0.10:502", request, code)
        assert shown(error.what, error.remedy).count("\n") < MOST_LINES, str(error)
