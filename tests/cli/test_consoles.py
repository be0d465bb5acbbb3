"""Commands and their errors on consoles that lack most of the world's characters."""

import json
import os
import subprocess
import sys

import pytest

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


@pytest.mark.parametrize("encoding", ["ascii", pytest.param("cp1252", marks=LONG), "cp936"])
def test_no_command_and_no_error_fails_for_want_of_a_character(tmp_path, encoding):
    codes = tmp_path / "codes.json"
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
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
    assert f"These are known: {known}, wrong-robot." in shown
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
    # What lies there before the question is no answer to it, and is shown all the same.
    assert r"Typed too early, so it was not taken: 'x\\xff+1'" in shown
    assert done.returncode == 9
    assert "Traceback" not in shown
