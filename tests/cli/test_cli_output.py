"""The output of a command, for people and for programs."""

import json
import os
import subprocess
import sys

import click
import pytest
from robolink_cli import main
from robolink_cli.console import render
from robolink_cli.console.output import PLAINLY

from robolink import errors


@pytest.mark.parametrize("arguments", [["--json", "status"], ["status", "--json"]])
def test_json_is_one_document_and_text_goes_to_stderr(command, capsys, arguments):
    def act(context):
        render.say("for people")
        render.table("poses", ["x_mm"], [["1.000"]])
        render.emit("status", {"x_mm": 1.0, "word": "°"}, lambda: render.say("never"))

    command(act)
    assert main.run(arguments) == 0
    shown = capsys.readouterr()
    assert json.loads(shown.out) == {"schema": "robolink/status/1", "x_mm": 1.0, "word": "°"}
    assert shown.out.isascii()
    assert "for people" in shown.err
    assert "x_mm" in shown.err
    assert "never" not in shown.err


def test_a_column_of_numbers_stands_to_the_right_and_one_of_versions_to_the_left(capsys):
    render.table("seen", ["mm", "version"], [["1.5", "2.0.1"], ["*-12.25", "12.10.1"], ["1", "-"]])
    rows = capsys.readouterr().out.rstrip().splitlines()[-3:]
    assert [row.split() for row in rows] == [["1.5", "2.0.1"], ["*-12.25", "12.10.1"], ["1", "-"]]
    assert rows[0].index("1.5") + 3 == rows[1].index("12.25") + 5
    assert rows[0].index("2.0.1") == rows[1].index("12.10.1")


def test_without_json_text_goes_to_stdout(command, capsys):
    command(lambda _: render.emit("status", {}, lambda: render.say("for people")))
    assert main.run(["status"]) == 0
    assert capsys.readouterr().out == "for people\n"


def test_a_command_without_controller_takes_json_on_both_sides(command, capsys):
    command()
    for arguments in (["--json", "sim"], ["sim", "--json"]):
        assert main.run(arguments) == 0
        assert capsys.readouterr() == ("", "serving\n")


def test_a_dry_run_shows_the_requests(command, capsys):
    command(lambda _: render.show_requests(["$Stop", "$Reset"]))
    assert main.run(["status"]) == 0
    assert capsys.readouterr().out == "$Stop\n$Reset\n"
    assert main.run(["status", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document == {"schema": "robolink/dry-run/1", "requests": ["$Stop", "$Reset"]}


def test_an_error_after_the_result_replaces_it(command, capsys):
    def act(context):
        render.emit("status", {"state": "ready"}, lambda: None)
        raise errors.TransportBrokenError("The cable is cut.")

    command(act)
    assert main.run(["--json", "status"]) == 3
    assert json.loads(capsys.readouterr().out)["schema"] == "robolink/error/1"


def test_a_second_document_is_a_defect(command, capsys):
    def act(context):
        render.emit_json("robolink/status/1", {})
        render.emit_json("robolink/status/1", {})

    command(act)
    assert main.run(["--json", "status"]) == 70
    assert "RuntimeError" in json.loads(capsys.readouterr().out)["error"]["kind"]


def test_a_wide_table_is_not_cut_off_a_terminal(command, capsys):
    wide = "x" * 200
    command(lambda context: render.table("wide", ["a", "b"], [[wide, "end"]]))
    assert main.run(["status"]) == 0
    shown = capsys.readouterr().out
    assert wide in shown
    assert "end" in shown


def test_brackets_in_a_table_are_text(command, capsys):
    command(lambda context: render.table("[bold]", ["[a]"], [["[red]x"]]))
    assert main.run(["status"]) == 0
    shown = capsys.readouterr().out
    assert all(text in shown for text in ("[bold]", "[a]", "[red]x"))


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "cp936"])
def test_no_console_makes_a_sentence_fail(encoding):
    program = (
        "from robolink_cli.console import render, output\n"
        "output.tolerate_any_console()\n"
        "render.say('90° ✓ 机器人 µm')\n"
        "render.note('90° ✓ 机器人 µm')\n"
        "render.table('°', ['µ'], [['✓']])\n"
    )
    paths = os.pathsep.join(path for path in sys.path if path)
    done = subprocess.run(
        [sys.executable, "-m", "tests._program", program],
        env={**os.environ, "PYTHONIOENCODING": encoding, "PYTHONPATH": paths},
        capture_output=True,
        timeout=30,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(b"90")


def test_a_reader_that_leaves_early_causes_no_noise():
    program = (
        "import sys\n"
        "from robolink_cli import lazy_group, main\n"
        "from robolink_cli.console import render\n"
        "import click\n"
        "@click.command()\n"
        "def long():\n"
        "    for _ in range(100_000): render.say('line')\n"
        "lazy_group.LazyGroup.get_command = lambda *arguments: long\n"
        "sys.exit(main.run(['long']))\n"
    )
    paths = os.pathsep.join(path for path in sys.path if path)
    with subprocess.Popen(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": paths},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as child:
        assert child.stdout is not None
        assert child.stderr is not None
        child.stdout.readline()
        child.stdout.close()
        assert child.stderr.read() == b""
        assert child.wait(timeout=30) == 141


@pytest.mark.parametrize(("value", "expected"), [("1", False), ("", None)])
def test_no_color_is_honoured(command, monkeypatch, value, expected):
    monkeypatch.setenv("NO_COLOR", value)
    seen = []
    command(lambda context: seen.append(click.get_current_context().color))
    assert main.run(["status"]) == 0
    assert seen == [expected]


def test_a_sign_that_an_encoding_lacks_stands_in_letters_and_the_rest_as_escapes():
    assert "0.1 ± 0.02, ∞, 机".encode("ascii", PLAINLY) == b"0.1 +- 0.02, inf, \\u673a"
    assert "± 90°".encode("cp936", PLAINLY).decode("cp936") == "± 90°"
