"""Every error that is raised, in the sources: three lines at its likely fill, and what to do.

Only what happened may have a list below it: findings, what another error says, what stands. All
else is counted. A path or URL of more than 32 columns stands whole below its sentence.

``tests/cli/test_wrong_commands.py`` holds the answers to wrong commands; this holds all others, as
far as their sentences stand where they are raised.
"""

import ast
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from babel.messages.pofile import read_po
from robolink_cli.console.error_lines import LONGEST_NAME, MOST_LINES, error_lines
from robolink_cli.console.shell_words import SHELL_WAYS
from robolink_cli.console.tables import SCREEN

from robolink import errors, locale
from robolink.controllers.softmotion.answers import motion_failure, refused
from robolink.messages import LIST_LINE, listed
from robolink.protocols.mailbox import Command, ErrorClass, Opcode, Response
from robolink.remedy_words import RemedyWord
from robolink.transport.modbus.errors import refused as refused_by_modbus
from robolink.transport.modbus.frames import Area, ModbusRequest
from tests.packaging._raised_sentences import OF_ANOTHER, Said, Sentences
from tests.packaging._source_modules import called, together

pytestmark = pytest.mark.soak

ROOT = Path(__file__).parents[2]
SHIPPED = ("robolink", "cli", "simulators")
KINDS = {name for name in errors.__all__ if name.endswith("Error")}
OFFSET = "X 12.324 Y -3.729 Z -20.000 U 0.000"
URL = "epson+tcp://192.168.100.100:5000"
PATH = "/home/kowalski/needle-line3.toml"
assert len(URL) == len(PATH) == LONGEST_NAME, "they are to be as long as a sentence may hold"

LIKELY = {
    **dict.fromkeys(("before", "expected", "found", "now", "offset", "requested"), OFFSET),
    **dict.fromkeys(("controller", "identity", "url"), URL),
    **dict.fromkeys(("cause", "error"), "Connection reset by peer"),
    **dict.fromkeys(("count", "line", "most", "number", "read", "slot", "tool", "written"), "64"),
    "axes": "4",
    "code": "2004",
    "axis": "X",
    "better": "12",
    "baud": "9600",
    "file": PATH,
    "folder": PATH,
    "holder": "K. Sato at cell-pc-3, process 4711",
    "names": "line3, line4, north, locked",
    "option": "--accept-jump",
    "parity": "even",
    "password": "keyring, --password-file or ROBOLINK_PASSWORD",
    "path": PATH,
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
    "The journal {path} is newer: form {found}, not {own}.": "7",
    "{reference} (address {address}) of unit {unit}": "412290",
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


CHINESE = Path(locale.__file__).parent / "zh_CN" / "LC_MESSAGES" / "robolink.po"


def in_chinese():
    """Return all sentences in Chinese, by the English ones."""
    with CHINESE.open("rb") as file:
        return {one.id: one.string for one in read_po(file) if one.id}


def filled(english, sentences, translated):
    """Return a sentence with likely values, and with sentences where those are known."""
    text = re.sub("(journal|操作记录) {name}", r"\1 {path}", translated.get(english, english))
    english = english.replace("journal {name}", "journal {path}")

    def value(found):
        if found["name"] in sentences:
            return sentences[found["name"]]
        if found["name"] == "seconds":
            return LIKELY["seconds"]
        if (found["form"] or "").endswith("X"):
            return "1A2B3C4D"
        if re.search(r"[a-z]$", found["form"] or ""):
            return "10" if found["form"].endswith((".0f", "d")) else "-112.345"
        if found["name"] in OTHER_NAMES and english in OTHERWISE:
            return OTHERWISE[english]
        if found["name"] in RemedyWord.__dict__:
            return SHELL_WAYS[getattr(RemedyWord, found["name"])].format_map(LIKELY)
        return LIKELY.get(found["name"], "needle-12")

    said = re.sub(r"(?<!{){(?P<name>\w+)(![rs])?(?P<form>:[^{}]*)?}", value, text)
    return said.replace("{{", "{").replace("}}", "}")


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
    def is_passed_on(self):
        """Whether it says what another error says, and nothing of its own."""
        texts = [self.what, *([self.remedy] if self.remedy else [])]
        if not all(isinstance(one, ast.Attribute) for one in texts):
            return False
        return [one.attr for one in texts] == ["what", "remedy"][: len(texts)] and len(
            {ast.unparse(one.value) for one in texts}
        ) == 1


@pytest.fixture(scope="module", params=["en", "zh"])
def sources(request):
    """The sources, in which sentences are followed, in either language."""
    translated = in_chinese() if request.param == "zh" else {}
    return Sentences(ROOT, SHIPPED, lambda text, known: filled(text, known, translated))


@pytest.fixture(scope="module")
def raised(sources):
    """All calls that make an error, with all that each can say."""
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
    """Return what a terminal shows of an error, without what is listed below what happened."""
    assert "\n" not in do, f"what to do is listed: {do}"
    lines = error_lines(what.partition(f"\n{LIST_LINE}")[0], do, width=SCREEN).split("\n")
    return "\n".join(line for line in lines if not line.startswith(LIST_LINE))  # a whole name


def test_an_error_takes_three_lines(raised):
    long = {
        f"{one.place}:{one.line}\n{shown(what, do)}"
        for one in raised
        if not one.is_passed_on
        for what, do in one.pairs or ()
        if shown(what, do).count("\n") >= MOST_LINES
    }
    assert not long, "\n".join(sorted(long))


def test_each_error_is_followed_to_its_sentences(raised):
    """None is left out but what only passes on another error."""
    lost = [f"{one.place}:{one.line}" for one in raised if not one.pairs and not one.is_passed_on]
    assert lost == []


def test_what_is_added_to_an_error_later_is_listed_or_takes_a_line(sources):
    """So an error of three lines stays one, whatever is added on its way up."""
    found, long = 0, []
    for module in sources.modules.values():
        for function in module.functions.values() if module.name != "robolink.errors" else ():
            scope = sources.scope(module, function, "")
            for node in scope.chosen:
                match node:
                    case ast.Assign(targets=[ast.Attribute(attr="what")], value=ast.Call() as made):
                        found += 1  # its list is not counted, so it may only grow by that
                        assert called(made) == "listed", f"{module.place}:{node.lineno}"
                        continue
                    case ast.Assign(targets=[ast.Attribute(attr="remedy")]):
                        found += 1
                        texts = sources.said(node.value, scope)
                    case ast.Call(func=ast.Attribute(attr="advise"), args=[added]):
                        found += 1
                        texts = sources.said(added, scope)
                    case _:
                        continue
                if not texts or any(map(adds_lines, texts)):
                    long.append(f"{module.place}:{node.lineno}: {ast.unparse(node)}")
    assert found >= 10, "the search finds nothing"
    assert long == []


def adds_lines(said):
    """Return whether a text takes more than one line besides what was said before."""
    lines = shown("", said.text.replace(OF_ANOTHER, "")).split("\n")[1:]
    return sum(line.strip() != "" for line in lines) > 1


def test_what_to_do_is_found_where_it_is_listed_or_takes_two_lines():
    with pytest.raises(AssertionError, match="is listed"):
        adds_lines(Said(listed("Do this:", ["that"])))
    assert adds_lines(Said("Do this and that. " * 6))
    assert not adds_lines(Said(f"{OF_ANOTHER} Do this."))


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
