"""Characters that a console lacks, and words with a meaning to a spreadsheet or a controller."""

import csv
import io
import json
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_cli import main
from robolink_cli.commands.record.journal_export import csv_lines
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.errors import ConfigError, RobolinkError
from robolink.files.durable import file_name, write_whole
from robolink.files.named import save_named
from robolink.journal import open_journal
from robolink.model import EntryKind, NewEntry, Signature
from robolink.protocols.epson_text import VariableType

# Commands and their errors on consoles that lack most of the world's characters.

LONG = pytest.mark.soak

CELLS = """
[cells."三号线"]
url = "epson+sim://console?seed=1"
notes = "喷嘴 é 90° ✓ \\U0001F916"

[cells.wrong-robot]
url = "epson+sim://console?seed=1"
robot = "机器人 é"
"""

COMMANDS = {
    ("--help",): 0,
    ("calibrate", "two-pose", "--help"): 0,
    ("-c", "三号线", "status"): 0,
    ("-c", "三号线", "status", "--json"): 0,
    ("-c", "三号线", "where"): 0,
    ("-c", "三号线", "tool", "list"): 0,
    ("-c", "三号线", "calibrate", "two-pose", "--tool", "1", "--dry-run"): 0,
    ("-c", "三号线", "config", "show", "--origin"): 0,
    ("config", "show"): 0,
    ("config", "check"): 0,
    ("config", "path"): 0,
    ("ports",): 0,
    ("-c", "四号线", "status"): 2,
    ("-c", "四号线", "status", "--json"): 2,
    ("-c", "wrong-robot", "tool", "set", "3", "--x", "1"): 2,
    ("-c", "epson+é://机器人", "status"): 2,
    ("-c", "epson+sim://機?é=1", "status"): 2,
    ("-c", "三号线", "tool", "get", "é"): 2,
    ("-c", "三号线", "jog", "µ+1", "--yes"): 2,
    ("scan", "地址"): 2,
    ("机器人",): 2,
    ("config", "check", "没有.toml"): 2,
    ("config", "check", "not utf-8 \udcff.toml"): 2,
}

PROGRAM = """
import json, os, sys
from robolink_cli.main import run
lines = json.loads(os.environ["COMMAND_LINES"])
codes = [run(line) for line in lines]
with open(os.environ["CODES"], "w") as file:
    json.dump(codes, file)
"""


def environment(tmp_path, encoding):
    (tmp_path / "cells é.toml").write_text(CELLS, encoding="utf-8")
    return {
        **{name: value for name, value in os.environ.items() if not name.startswith("ROBOLINK")},
        "PYTHONPATH": os.pathsep.join(path for path in sys.path if path),
        "PYTHONIOENCODING": encoding,
        "PYTHON_KEYRING_BACKEND": "keyring.backends.null.Keyring",
        "ROBOLINK_CONFIG": str(tmp_path / "cells é.toml"),
        "ROBOLINK_STATE_DIR": str(tmp_path / "state 状态"),
    }


@pytest.mark.parametrize(
    "encoding", ["ascii", *(pytest.param(other, marks=LONG) for other in ("cp1252", "cp936"))]
)
def test_no_command_and_no_error_fails_for_want_of_a_character(tmp_path, encoding):
    codes = tmp_path / "codes.json"
    done = subprocess.run(
        [sys.executable, "-m", "tests._program", PROGRAM],
        env=environment(tmp_path, encoding)
        | {"COMMAND_LINES": json.dumps([*COMMANDS]), "CODES": str(codes)},
        cwd=tmp_path,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=50,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    ended = dict(zip(COMMANDS, json.loads(codes.read_text()), strict=True))
    assert ended == COMMANDS
    shown = (done.stdout + done.stderr).decode(encoding)  # raises if it is something else
    assert "Traceback" not in shown
    known = "三号线" if encoding == "cp936" else r"\u4e09\u53f7\u7ebf"
    assert f"Choose one of these: {known}, wrong-robot." in shown
    assert r"\U0001f916" in shown


@pytest.mark.parametrize("encoding", [pytest.param("ascii", marks=LONG), "cp936"])
def test_keys_that_the_console_does_not_know_are_a_slip_and_no_end(tmp_path, encoding):
    done = subprocess.run(
        [sys.executable, "-m", "robolink_cli", "-c", "epson+sim://console", "jog", "--yes"],
        env=environment(tmp_path, encoding),
        input=b"x\xff+1\n",
        capture_output=True,
        timeout=30,
        check=False,
    )
    shown = done.stdout.decode(encoding) + done.stderr.decode(encoding)
    # Input typed before the question does not answer it, and is shown all the same.
    assert r"Typed too early and ignored: 'x\\xff+1'" in shown
    assert done.returncode == 9
    assert "Traceback" not in shown


# Words with a meaning to a spreadsheet, a database, a controller or a file system.

# ---- a spreadsheet

FORMULAS = ("=cmd|' /C calc'!A0", "+1+1", "-2+3", "@SUM(A1)", "\t=1", "\r=1", " =1", "\uff1d1+1")
HIDDEN = tuple(f"a{cut}{formula}" for cut in ";\t\n" for formula in ("=1+1", " +1", "@x"))


def test_no_cell_of_an_export_is_calculated_wherever_it_is_cut(state_folder):
    journal = open_journal()
    entries = []
    for text in FORMULAS + HIDDEN:
        log = journal.log("epson+tcp://a:1", signature=Signature(operator=text, lot=text))
        details = {"rms_mm": text, "note": text}
        log.append(NewEntry(EntryKind.DECISION, verdict=text, details=details))
    entries = list(log.recorded())
    assert len(entries) == len(FORMULAS + HIDDEN)
    data = b"".join(csv_lines(entries)).decode("utf-8-sig")
    for delimiter in ",;\t":
        for row in csv.reader(io.StringIO(data, newline=""), delimiter=delimiter):
            for cell in row:
                assert cell.strip()[:1] not in tuple("=+@\uff1d"), (delimiter, cell)


def test_what_only_looks_a_little_like_a_formula_is_left_as_it_is(state_folder):
    plain = "a=b, c@d; e-f + 3 = 5"
    log = open_journal().log("epson+tcp://a:1", signature=Signature(operator=plain))
    log.append(NewEntry(EntryKind.DECISION, details={"offset_mm": [-1.5, 2.5]}))
    data = b"".join(csv_lines(log.recorded())).decode("utf-8-sig")
    (row,) = csv.DictReader(io.StringIO(data, newline=""))
    assert row["operator"] == plain
    assert row["details"] == '{"offset_mm": [-1.5, 2.5]}'


# ---- a database

SQL = ("'; DROP TABLE entries; --", '" OR 1=1 --', "%", "_", "\\", "x' UNION SELECT 1 --")


@pytest.mark.parametrize("text", SQL)
def test_words_are_no_sql(state_folder, text):
    journal = open_journal()
    named = journal.log("epson+tcp://a:1", signature=Signature(operator=text, nozzle=text))
    named.append(NewEntry(EntryKind.DECISION, verdict=text, change=text, details={text: text}))
    other = journal.log("epson+tcp://b:1", signature=Signature(operator="Ann"))
    other.append(NewEntry(EntryKind.DECISION, verdict="kept"))
    (entry,) = named.recorded()
    assert (entry.verdict, entry.signature.operator, entry.details) == (text, text, {text: text})
    assert [found.verdict for found in other.recorded()] == ["kept"]
    journal.verify()


@pytest.mark.parametrize("text", SQL)
def test_what_is_asked_for_is_no_sql(state_folder, capsys, text):
    log = open_journal().log("epson+tcp://a:1", signature=Signature(operator="Ann"))
    log.append(NewEntry(EntryKind.DECISION, verdict="kept", change="abcd" * 8))
    for words in (["journal", "list", "--change", text], ["journal", "show", text]):
        main.run(words)
        assert "kept" not in capsys.readouterr().out
    assert [entry.verdict for entry in log.recorded()] == ["kept"]


# ---- a controller

SPEL = ('x";Motor On;"', "x)+Reset", "x\r\n$Stop", "a b")
MORE_SPEL = ("x;Go P1", "x,1", "x'", "$Execute", "é")


@pytest.mark.parametrize(
    "text", [*SPEL, *(pytest.param(text, marks=pytest.mark.soak) for text in MORE_SPEL)]
)
@pytest.mark.fault("F72")
def test_f72_a_name_or_value_says_nothing_else_to_a_controller(run, simulator, text):
    simulator.variables.declare("g_text$", VariableType.STRING, value="old")
    before = len(simulator.log)
    for words in (
        ["var", "get", text],
        ["var", "set", text, "1", "--type", "long"],
        ["var", "set", "g_text$", text, "--type", "string"],
        ["var", "set", "g_text$", "1", "--type", text],
        ["tool", "set", text, "--x", "1"],
        ["tool", "set", "1", "--x", text],
        ["io", "get", text],
        ["io", "set", text, "on"],
        ["where", text],
    ):
        run(*words)
    asked = [line for _, direction, line in list(simulator.log)[before:] if line.startswith("$")]
    known = ("Login", "Logout", "Execute", "Get")
    sent = "\n".join(asked)
    if text != "a b":  # a text that may be stored unchanged
        assert text not in sent
        assert "SetVariable" not in sent
    assert "Motor On" not in sent
    assert "Go P1" not in sent
    assert all(line[1:].startswith((*known, "SetVariable,g_text$")) for line in asked), sent


# ---- a file system

NAMES = (
    *("../../etc/passwd", "..", ".", "", "/", "a/b", "a\\b", "CON", "nul.txt", "~", "a\0b", "-rf"),
    *("a" * 300, "\u9488" * 120, ".\u00e4\U0001f9be" * 90, "/" * 300, "\ud800", "\t\n\x1b[2J"),
)


def test_no_identity_leads_out_of_its_folder():
    for identity in NAMES:
        require_in_its_folder(identity)


@pytest.mark.soak
@settings(max_examples=2000, deadline=None)
@given(st.text(max_size=300))
def test_no_identity_of_many_leads_out_of_its_folder(identity):
    require_in_its_folder(identity)


def require_in_its_folder(identity):
    try:
        name = file_name(identity)
    except UnicodeEncodeError:
        return  # half a character, which no URL has
    path = Path("/state/backups") / name
    assert os.path.normpath(path) == str(path)
    assert path.parent == Path("/state/backups")
    assert len(name) < 100
    assert name.isascii()
    assert not name.startswith(("-", "."))


@pytest.mark.skipif(os.name != "posix", reason="links and modes of POSIX")
def test_what_is_written_never_goes_through_a_link(tmp_path):
    victim, link, dangling = tmp_path / "victim", tmp_path / "link", tmp_path / "dangling"
    victim.write_text("mine")
    link.symlink_to(victim)
    dangling.symlink_to(tmp_path / "nowhere")
    for path in (link, dangling):
        with pytest.raises(ConfigError):
            save_named(path, b"theirs")
        with pytest.raises(FileExistsError):
            write_whole(path, b"theirs", replace=False)
    save_named(link, b"theirs", replace=True)
    save_named(dangling, b"theirs", replace=True)
    assert victim.read_text() == "mine"
    assert not (tmp_path / "nowhere").exists()
    assert not link.is_symlink()


@pytest.mark.skipif(os.name != "posix", reason="links and modes of POSIX")
@pytest.mark.parametrize("words", [["plc", "export"], ["spel", "export"]])
def test_an_export_does_not_go_through_links_that_wait_in_its_folder(tmp_path, words, capsys):
    victim, folder = tmp_path / "victim", tmp_path / "out"
    assert main.run([*words, str(folder)]) == 0
    names = sorted(path.name for path in folder.iterdir())
    victim.write_text("mine")
    for name in names:
        (folder / name).unlink()
        (folder / name).symlink_to(victim)
    assert main.run([*words, str(folder)]) == 2
    assert main.run([*words, str(folder), "--force"]) == 0
    assert victim.read_text() == "mine"
    assert not any((folder / name).is_symlink() for name in names)
    capsys.readouterr()


@pytest.mark.skipif(os.name != "posix", reason="links and modes of POSIX")
def test_nobody_else_can_read_what_is_kept_even_without_a_umask(state_folder, tmp_path, capsys):
    simulator = EpsonSimulator(seed=4, state_path=tmp_path / "flash.json")
    before = os.umask(0)
    try:
        with serve_tcp(simulator) as host:
            for words in (["tool", "set", "1", "--x", "12.5"], ["tool", "list"], ["stop"]):
                assert main.run(["-c", host.url, *words]) == 0
    finally:
        os.umask(before)
    capsys.readouterr()
    kept = [state_folder, *state_folder.rglob("*")]
    assert {path.name for path in kept} >= {"journal.db", "backups"}
    open_to_others = [path for path in kept if stat.S_IMODE(path.stat().st_mode) & 0o077]
    # Files in a folder that only its owner can open are out of reach of others.
    assert not [path for path in open_to_others if path.is_dir() or path.suffix == ".db"]


# ---- a terminal

EVIL = "ok\x1b[2J\x1b]0;x\x07\x9b31m"


@pytest.mark.parametrize(
    ("words", "content"),
    [
        (["recalibrate", "{file}", "--yes"], f'name = "{EVIL}"\n'),
        (["recalibrate", "{file}", "--yes"], '"ok\\u001b[2J" = 1\n'),
        (["restore", "{file}", "--yes"], '{"schema": "ok\\u001b[2J"}'),
        (["solve", "{file}"], '{"method": "ok\\u001b[2J"}'),
        (["plc", "check-map", "{file}"], '"ok\\u001b[2J" = 1\n'),
        (["plc", "check-map", "--from-csv", "{file}"], f"name,address\nTool1_X{EVIL},1\n"),
    ],
)
def test_no_word_of_a_file_or_of_its_name_is_obeyed(run, tmp_path, words, content):
    file = tmp_path / f"{EVIL.replace('/', '')}.x"
    file.write_text(content)
    _, out, err = run(*(word.replace("{file}", str(file)) for word in words))
    assert "\\x1b[2J" in out + err
    for obeyed in "\x1b\x07\x9b":
        assert obeyed not in out + err


def test_no_word_of_a_journal_is_obeyed(run, simulator, state_folder):
    log = open_journal().log(simulator.url, signature=Signature(operator=EVIL, nozzle=EVIL))
    log.append(NewEntry(EntryKind.DECISION, verdict=EVIL, tool=1, change="abcd" * 8))
    for words in (["journal", "list"], ["journal", "show", "1"], ["journal", "drift", "1"]):
        _, out, err = run(*words)
        for obeyed in "\x1b\x07\x9b":
            assert obeyed not in out + err


def test_an_error_names_a_controller_that_has_a_hostile_name_in_escapes():
    error = RobolinkError("no answer", controller=EVIL)
    assert "\x1b" not in str(error)
