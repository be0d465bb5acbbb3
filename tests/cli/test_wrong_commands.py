"""Wrong commands, drawn from a grammar, are run; each answer has one form and is in a table.

The form is: what happened, what stands, what to do, in at most three lines of 80 columns
(docs/contributing.md, "Adding a sentence, or a translation"). ``wrong_commands.txt`` is for people,
and shows in a review which sentences changed; ``python -m tests.cli.test_wrong_commands`` writes
it.
"""

import io
import os
import re
import sys
import tempfile
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import pytest
from babel.messages.pofile import read_po
from robolink_cli import main
from robolink_cli.console.tables import columns, within
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import register, unregister

from robolink import locale
from robolink.journal import close_files
from robolink.model import Secret
from tests._commands import run_command
from tests.cli._wrong_commands import CELL, CONTROLLERS, KINDS, Wrong, leaves, wrong_commands
from tests.cli.test_commands_bad_input import closed_port

SEED = 36
TABLE = Path(__file__).with_name("wrong_commands.txt")
COLUMNS, LINES = 80, 3
CLICK_IN_CHINESE = Path(locale.__file__).parent / "zh_CN" / "LC_MESSAGES" / "click.po"

CELLS = """
[cells.line3]
url = "epson+sim://wrong-line3"
remote_timeout_s = 60
remote_timeout_confirmed_by = "K. Sato, 2026-05-04, Remote Ethernet page"

[cells.line3.stations.PIN-07]
kind = "pin"

[cells.line4]
url = "epson+sim://wrong-line4"

[cells.locked]
url = "epson+sim://wrong-locked"
"""
GARBAGE = "\x00 {[ not a file of anything"
WRONG_KEY = {
    "toml": 'schema = "robolink/recipe/1"\nneedel = 1\n',
    "json": '{"schema": "robolink/tools/1", "tolls": {}}',
    "csv": "x;q;z\n1;2;3\n",
}


@dataclass(frozen=True)
class Answer:
    """The end of a wrong command, and its output on a terminal of 80 columns."""

    wrong: Wrong
    code: int
    out: str
    err: str

    @property
    def lines(self) -> list[str]:
        """The lines of a terminal."""
        return within(self.err.rstrip("\n"), COLUMNS).split("\n")


def furnish(folder: Path) -> None:
    """Write the files that the lines name into a folder, which becomes the working folder."""
    (folder / "robolink.toml").write_text(CELLS, encoding="utf-8")
    for ending in ("toml", "json", "csv", "prg", "pts", "log"):
        (folder / f"garbage.{ending}").write_text(GARBAGE, encoding="utf-8")
        (folder / f"there.{ending}").write_text("", encoding="utf-8")
    for ending, text in WRONG_KEY.items():
        (folder / f"wrong_key.{ending}").write_text(text, encoding="utf-8")
    (folder / "there.html").write_text("", encoding="utf-8")
    (folder / "main.prg").write_text("Function main\nFend\n", encoding="utf-8")
    (folder / "file").write_text("", encoding="utf-8")
    (folder / "folder").mkdir()
    (folder / "circle").symlink_to("circle")  # unreadable, even for root
    for name, mode in (("wrong", 0o600), ("open", 0o644)):
        (folder / name).write_text("n1chtd4s\n", encoding="utf-8")
        (folder / name).chmod(mode)


def answers(folder: Path, seed: int = SEED) -> list[Answer]:
    """Run every line in a folder of its own; return the answers."""
    furnish(folder)
    simulators = {
        "wrong-line3": EpsonSimulator(seed=4, serial="SIM00001"),
        "wrong-line4": EpsonSimulator(seed=5, serial="SIM00002"),
        "wrong-locked": EpsonSimulator(seed=6, serial="SIM00003", password=Secret("r1chtig")),
    }
    for name, simulator in simulators.items():
        register(name, simulator)
    port, before = str(closed_port()), Path.cwd()
    os.chdir(folder)
    try:
        typed(Wrong("", "", ("-c", CELL, "tool", "backup", "tools.json")), port, folder)
        return [typed(one, port, folder) for one in wrong_commands(seed)]
    finally:
        os.chdir(before)
        close_files()
        for name in simulators:
            unregister(name)


def typed(wrong: Wrong, port: str, folder: Path) -> Answer:
    """Run a line; return its answer without the parts that differ between runs."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = main.run([word.replace("PORT", port) for word in wrong.words])
    told = [out.getvalue(), err.getvalue()]
    kept = {os.environ["ROBOLINK_STATE_DIR"]: "/STATE", str(folder): "/FOLDER", port: "PORT"}
    for changing, name in kept.items():
        told = [text.replace(changing, name) for text in told]
    return Answer(wrong, code, *told)


def table(found: list[Answer]) -> str:
    """Return all answers as a readable table."""
    parts = []
    for one in found:
        words = " ".join(map(_shown, one.wrong.words))
        parts.append("\n".join([f"{one.code}  $ robolink {words}", *one.lines, ""]))
    return "\n".join(parts)


def _shown(word: str) -> str:
    shown = word.encode("unicode_escape").decode() if not word.isprintable() else word
    shown = shown if len(shown) <= 40 else f"{shown[:20]}...{shown[-5:]}"
    return f"'{shown}'" if not shown or set(shown) & set(" \\;") else shown


VERBS = (
    "Add|Ask|Check|Choose|Close|Connect|Correct|Give|Install|Name|Press|Put|Read|Remove|Run|See|Set|"
    "Switch|Turn|Type|Use|Wait|Write"
)
DOES = re.compile(rf"\b({VERBS})\b|Did you mean|(: |[Nn]ext: )robolink |docs/")
"""Ways to say what to do: a verb, a command to type, or a page to read."""

UNPLAIN = re.compile(
    r"\b(was|were) not \w+ed\b|\b(who|what|which)ever\b|sure to\b|Traceback|^(Usage|Error):"
    r"|\b(None|True|False)\b|\w+Error\b|: : |%[YmdHM]",
    re.MULTILINE,
)
"""No answer contains these: passive without an actor, words of Python, signs of broken text."""

LONGEST_SENTENCE = 24
"""The most words in a sentence, without the typed ones."""

CODES = {2, 3, 5}


LISTED = re.compile(r"(?<=:)(\n    .*)+|\n    [^ ]+(?=\n)")
"""Findings, a line each, below what announces them; or one whole path or URL."""

MOST_LISTED = 11


def faults(one: Answer) -> list[str]:
    """Return the faults in the form of an answer."""
    listed = [line[1:] for line in re.findall(r"\n    .*", one.err)]
    told = Answer(one.wrong, one.code, one.out, LISTED.sub("", one.err))
    what, *rest = told.err.rstrip("\n").split("\n  ")
    do = rest[-1] if rest else ""
    sentences = re.split(r"(?<=[.?:;])\s", f"{what} {' '.join(rest)}")
    found = {
        f"ends with {one.code}": one.code not in CODES,
        "shows something on stdout": one.out != "",
        "does not begin with what happened": not what.startswith("robolink: "),
        "does not end a sentence": not what.endswith((".", "?", ":"))
        or (what.endswith(":") and f"{what}\n    " not in one.err),
        "does not say what to do": not DOES.search(do),
        "is in parts that stand": not 1 <= len(rest) <= 2,
        f"takes {len(told.lines)} lines": len(told.lines) > LINES,
        "lists too much": len(listed) > MOST_LISTED
        or any(within(line, COLUMNS).count("\n") > 3 for line in listed),
        "is wider than the terminal": max(map(columns, one.lines)) > COLUMNS,
        "is not plain": UNPLAIN.search(one.err) is not None,
        "has a long sentence": max(len(s.split()) for s in sentences) > LONGEST_SENTENCE,
    }
    return [fault for fault, holds in found.items() if holds]


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """The answers to all lines."""
    state, folder = tmp_path_factory.mktemp("state"), tmp_path_factory.mktemp("wrong")
    with pytest.MonkeyPatch.context() as patch:
        for name in [name for name in os.environ if name.startswith("ROBOLINK")]:
            patch.delenv(name)
        patch.setenv("ROBOLINK_STATE_DIR", str(state))
        patch.setitem(sys.modules, "keyring", None)
        return answers(folder)


def test_two_hundred_lines_are_typed_of_every_command_and_every_kind():
    lines = wrong_commands(SEED)
    assert len({one.words for one in lines}) == len(lines) >= 200
    kinds = Counter(one.kind for one in lines)
    assert set(kinds) == {*KINDS, *CONTROLLERS}
    assert min(kinds.values()) >= 2, kinds
    assert max(kinds.values()) <= len(lines) / 10, kinds
    typed = {one.command for one in lines}
    assert typed == {leaf.name for leaf in leaves(main.cli)}


def test_each_answer_says_what_happened_what_stands_and_what_to_do(found):
    wrong = [
        f"{' '.join(one.wrong.words)}: {faults(one)}\n{one.err}" for one in found if faults(one)
    ]
    assert not wrong, f"{len(wrong)} answers:\n" + "\n".join(wrong)


@pytest.mark.parametrize(
    ("err", "fault"),
    [
        ("Usage: robolink x\n\nError: No.\n", "does not begin with what happened"),
        ("robolink: No.\n", "does not say what to do"),
        ("robolink: No.\n  These are known: a, b.\n", "does not say what to do"),
        ("robolink: The file was not opened.\n  Name another.\n", "is not plain"),
        ("robolink: " + "No file. " * 30 + "\n  Name another.\n", "takes 5 lines"),
        ("robolink: No\n  Name another.\n", "does not end a sentence"),
        ("robolink: No file:\n  Name another.\n", "does not end a sentence"),
        ("robolink: KeyError: 1.\n  Name another.\n", "is not plain"),
        ("robolink: No.\n  Nothing moved.\n  Wait.\n  Name it.\n", "is in parts that stand"),
        ("robolink: 2 errors:\n" + "    a: bad\n" * 12 + "  Correct it.\n", "lists too much"),
    ],
)
def test_an_answer_of_another_form_is_found(err, fault):
    assert fault in faults(Answer(Wrong("", "", ()), 2, "", err))
    right = "robolink: No file a.\n  Nothing moved.\n  Name another: robolink status\n"
    assert faults(Answer(Wrong("", "", ()), 2, "", right)) == []
    assert faults(Answer(Wrong("", "", ()), 70, "", right)) == ["ends with 70"]
    listed = "robolink: a has 2 errors:\n    line 1, b: is missing\n    c: is 0\n  Correct it.\n"
    assert faults(Answer(Wrong("", "", ()), 2, "", listed)) == []


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(60))
def test_each_answer_to_other_lines_has_that_form(tmp_path, state_folder, seed):
    folder = tmp_path / "work"
    folder.mkdir()
    wrong = [f"{one.wrong.words}: {faults(one)}" for one in answers(folder, seed) if faults(one)]
    assert not wrong, f"{len(wrong)} answers:\n" + "\n".join(wrong)


def test_the_table_of_answers_is_the_one_that_was_looked_over(found):
    assert table(found) == TABLE.read_text(encoding="utf-8"), (
        "read what changed: python -m tests.cli.test_wrong_commands"
    )


def test_an_option_of_a_former_name_has_no_line_of_help_and_needs_its_value(state_folder):
    ended = run_command("sim", "plc", "--modbus-tcp")
    assert ended.code == 2
    assert ended.err.startswith("robolink: --modbus-tcp needs a value.\n")


@pytest.mark.parametrize(
    ("words", "template"),
    [
        (("tool", "get", "ten"), "{value!r} is not a valid {number_type}."),
        (("robot", "io", "set", "70000", "on"), "{value} is not in the range {range}."),
        (("tool", "list", "now"), "Got unexpected extra argument ({args})"),
        (("robot", "motors", "onx"), "{value!r} is not one of {choices}."),
        (("tool", "list", "--published=1"), "Option {name!r} does not take a value."),
        (("tool", "compare", "."), "{name} {filename!r} is a directory."),
    ],
)
def test_click_s_own_words_are_not_shown_in_chinese_either(state_folder, words, template):
    with CLICK_IN_CHINESE.open("rb") as file:
        messages = [one for one in read_po(file) if template in one.id]
    said = messages[0].string
    said = said if isinstance(said, str) else str((said or [""])[0])
    longest = max(re.split(r"{[^}]*}", said), key=len).strip()
    assert not longest.isascii(), "click's sentence is not translated"
    ended = run_command("--lang", "zh", *words)
    assert ended.code == 2
    assert longest not in ended.err


def _made_anew() -> None:
    for name in [name for name in os.environ if name.startswith("ROBOLINK")]:
        del os.environ[name]
    with tempfile.TemporaryDirectory() as folder:
        os.environ["ROBOLINK_STATE_DIR"] = str(Path(folder) / "state")
        work = Path(folder) / "work"
        work.mkdir()
        found = answers(work)
    TABLE.write_text(table(found), encoding="utf-8")


if __name__ == "__main__":
    _made_anew()
