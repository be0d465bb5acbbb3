"""Two of the programs of examples/programs, in this process; ``make peers`` runs all of them."""

import json
import subprocess
import sys
from pathlib import Path
from runpy import run_path

import pytest
from robolink_cli import main as command_line

import robolink
from robolink.model import new_operation
from tests._mail_server import REFUSED, mail_server

EXAMPLES = Path(__file__).parents[2] / "examples"
FOLDERS = ("ci", "programs", "services")
PROGRAMS = [
    path
    for folder in FOLDERS
    for path in sorted((EXAMPLES / folder).glob("*"))
    if path.suffix in {".py", ".mjs", ".sh", ".yml"}
]
GOOD = [sys.executable, "-c", ""]
BAD = [sys.executable, "-c", "raise SystemExit(3)"]
OFFSETS = {"1": {"x_mm": 12.3, "y_mm": -3.7, "z_mm": -20.0}, "2": {"x_mm": 40.0}}


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.name)
def test_each_can_be_read_at_once_and_is_named(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 80
    assert path.name in (EXAMPLES / "README.md").read_text(encoding="utf-8")


@pytest.fixture
def cells(tmp_path, monkeypatch):
    """A cell file in the working folder, with one cell of each kind; returns URLs by name."""
    found = {kind: f"{kind}+sim://{new_operation()}" for kind in ("epson", "softmotion")}
    text = "".join(f'[cells.{name}]\nurl = "{url}"\n' for name, url in found.items())
    (tmp_path / "robolink.toml").write_text(text)
    monkeypatch.chdir(tmp_path)
    return found


# change_and_try.py


@pytest.fixture
def change_and_try(tmp_path, cells, capsys):
    """Runs the program on a cell with a file of this text; returns exit code and output."""
    program = run_path(str(EXAMPLES / "programs/change_and_try.py"))["main"]

    def run(cell, text, command):
        (tmp_path / "offsets.json").write_text(text)
        code = program([cell, "offsets.json", "--", *command])
        return code, capsys.readouterr()

    return run


def held(url):
    with robolink.connect(url) as controller:
        return [controller.tools.read(tool) for tool in (1, 2)]


@pytest.mark.parametrize("kind", ["epson", "softmotion"])
def test_only_a_good_part_keeps_the_offsets(change_and_try, cells, kind):
    before = held(cells[kind])
    code, shown = change_and_try(kind, json.dumps(OFFSETS), BAD)
    assert (code, held(cells[kind])) == (1, before)
    assert "old value" in shown.out
    assert change_and_try(kind, json.dumps(OFFSETS), GOOD)[0] == 0
    assert [tool.x_mm for tool in held(cells[kind])] == [12.3, 40.0]


@pytest.mark.parametrize(
    ("text", "command", "said"),
    [
        ("{", GOOD, "offsets.json"),
        ("[1]", GOOD, "offsets.json"),
        ("{}", GOOD, "names no tool"),
        ('{"1": {"x": 12.3}}', GOOD, "'x'"),
        ('{"1": {"x_mm": "far"}}', GOOD, "'far'"),
        ('{"99": {"x_mm": 1}}', GOOD, "no tool 99"),
        (json.dumps(OFFSETS), ["/no/such/program"], "/no/such/program"),
    ],
)
def test_what_cannot_be_done_is_said_and_changes_nothing(
    change_and_try, cells, text, command, said
):
    before = held(cells["epson"])
    code, shown = change_and_try("epson", text, command)
    assert (code, held(cells["epson"])) == (2, before)
    assert said in shown.err
    assert "Traceback" not in shown.err


def test_a_cell_that_is_not_there_is_said(change_and_try):
    code, shown = change_and_try("line9", json.dumps(OFFSETS), GOOD)
    assert (code, "line9" in shown.err) == (2, True)


def test_a_link_that_is_cut_while_the_part_is_made_leaves_it_to_recover(
    change_and_try, cells, monkeypatch
):
    def cut(controller, command):
        controller.close()
        return controller.status()

    program = run_path(str(EXAMPLES / "programs/change_and_try.py"))
    program["main"].__globals__["part_is_good"] = cut
    Path("offsets.json").write_text(json.dumps(OFFSETS))
    assert program["main"](["epson", "offsets.json", "--", *GOOD]) == 6
    assert change_and_try("epson", json.dumps(OFFSETS), GOOD)[0] == 6  # 'robolink recover' first


# nightly_check.py


@pytest.fixture
def nightly(monkeypatch, capsys):
    """Runs the program with a mail server and cells; its command runs in this process."""
    program = run_path(str(EXAMPLES / "programs/nightly_check.py"))["main"]

    def robolink_check(command, **_options):
        code = command_line.run(command[3:])
        return subprocess.CompletedProcess(command, code, capsys.readouterr().out.encode())

    monkeypatch.setattr(program.__globals__["subprocess"], "run", robolink_check)

    def run(server, *cells, to="shift@plant"):
        code = program(["--smtp", server, "--sender", "cells@plant", "--to", to, *cells])
        return code, capsys.readouterr().out

    return run


def test_a_night_in_order_is_mailed_too(nightly, cells):
    with mail_server() as (server, mails):
        assert nightly(server) == (0, "")
    (mail,) = mails
    assert (mail["From"], mail["To"]) == ("cells@plant", "shift@plant")
    assert mail["Subject"] == "0 of 2 cells need attention"
    assert "epson: in order" in mail.get_content()


def test_what_needs_attention_is_the_subject_and_comes_first(nightly, cells):
    with Path("robolink.toml").open("a") as file:
        file.write('[cells.gone]\nurl = "epson+tcp://127.0.0.1:1"\n')
    with mail_server() as (server, mails):
        assert nightly(server)[0] == 3
    assert mails[0]["Subject"] == "1 of 3 cells need attention: gone"
    first, said, *_ = mails[0].get_content().splitlines()
    assert (first, said[:4]) == ("gone: SEE TO THIS", "    ")


def test_cells_that_could_not_be_checked_are_not_told_as_in_order(nightly, cells):
    with mail_server() as (server, mails):
        assert nightly(server, "line9")[0] == 2
    assert mails[0]["Subject"] == "cells NOT checked"
    assert "line9" in mails[0].get_content()


def test_a_report_that_cannot_be_mailed_is_printed(nightly, cells):
    with mail_server() as (server, mails):
        ends = [nightly(server, "epson", to=REFUSED)]
    ends.append(nightly(server, "epson"))  # no server listens there any more
    ends.append(nightly("mail.plant:smtp", "epson"))
    assert [code for code, _ in ends] == [69, 69, 69]
    assert all("epson: in order" in shown for _, shown in ends)
    assert mails == []
