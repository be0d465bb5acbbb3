"""verify-controller, --record and sim epson --replay: evidence from a live controller."""

import json
import os
import subprocess
import sys
from contextlib import contextmanager

import pytest
from robolink_cli import main
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.hosting.in_process.epson import register, unregister

from robolink.model import Secret

PASSWORD = "hush-4711"


@pytest.fixture
def cell(tmp_path, monkeypatch):
    """A simulator with a password and odd habits, named by the environment."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("ROBOLINK_PASSWORD", PASSWORD)
    options = EpsonOptions(tool_listing="padded", comma_blank="always")
    simulator = EpsonSimulator(seed=4, options=options, password=Secret(PASSWORD))
    monkeypatch.setenv("ROBOLINK_CONTROLLER", register("cli-evidence", simulator))
    yield simulator
    unregister("cli-evidence")


@contextmanager
def command(*arguments):
    """Run ``robolink`` in a process of its own; give its first line, read, and the process."""
    process = subprocess.Popen(
        [sys.executable, "-m", "robolink_cli", *arguments, "--json"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        yield json.loads(process.stdout.readline()), process
    finally:
        process.terminate()
        process.communicate(timeout=20)


def test_verify_controller_writes_a_profile_and_a_transcript_without_secrets(
    cell, tmp_path, capsys
):
    profile, transcript = tmp_path / "cell.json", tmp_path / "said.jsonl"
    files = ["--profile", str(profile), "--transcript", str(transcript)]
    assert main.run(["verify-controller", *files, "--redact", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "robolink/verification/1"
    assert document["options"]["tool_listing"] == "padded"
    written = json.loads(profile.read_text())
    assert written["schema"] == "robolink/epson-profile/1"
    assert written["options"] == document["options"]
    assert "second_client" in written["unsettled"]
    said = transcript.read_text()
    for hidden in (PASSWORD, cell.machine.serial):
        assert hidden not in said + profile.read_text()


def test_people_see_what_is_settled_and_why_the_rest_is_not(cell, capsys):
    assert main.run(["verify-controller"]) == 0
    shown = capsys.readouterr().out
    assert "tool_listing=padded" in shown
    assert "it would leave the controller in error" in shown
    assert "Nothing was written, and nothing moved." in shown


def test_a_file_that_cannot_be_written_is_a_mistake_of_the_person(cell, tmp_path, capsys):
    target = str(tmp_path / "no such folder" / "file")
    assert main.run(["verify-controller", "--profile", target]) == 2
    assert main.run(["--record", target, "status"]) == 2
    assert "Nothing was sent" in capsys.readouterr().err


def test_a_recording_holds_the_dialogue_and_not_the_password(cell, tmp_path):
    recording = tmp_path / "day.jsonl"
    assert main.run(["--record", str(recording), "status"]) == 0
    assert main.run(["io", "get", "3", "--record", str(recording)]) == 0
    text = recording.read_text()
    assert PASSWORD not in text
    assert text.count('"schema": "robolink/dialogue/1"') == 2
    assert text.count('"secret": true') == 2
    assert "$GetIO,3" in text


def test_a_recording_is_replayed_as_a_test(cell, tmp_path, epson_replay, capsys, monkeypatch):
    recording = tmp_path / "day.jsonl"
    commands = [["status", "--json"], ["tool", "list", "--json"], ["var", "get", "VERSION$"]]
    live = []
    for arguments in commands:
        assert main.run(["--record", str(recording), *arguments]) == 0
        live.append(capsys.readouterr().out)
    url = epson_replay(recording)
    for arguments, shown in zip(commands, live, strict=True):
        # A controller on a network is asked who it is by those who never met it.
        monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / arguments[0]))
        assert main.run(["-c", url, *arguments]) == 0
        assert capsys.readouterr().out == shown.replace("epson+sim://cli-evidence", url)


def test_sim_serves_a_recording_and_names_what_differs(cell, tmp_path, capsys):
    recording = tmp_path / "day.jsonl"
    assert main.run(["--record", str(recording), "io", "get", "3"]) == 0
    serve = ["sim", "epson", "--tcp", "127.0.0.1:0", "--replay", str(recording)]
    with command(*serve) as (first, process):
        assert first["replay"] == str(recording)
        assert main.run(["-c", first["url"], "io", "get", "4"]) == 3
        process.terminate()
        _, errors = process.communicate(timeout=20)
    assert "$GetIO,4" in errors
    assert "$GetIO,3" in errors


def test_sim_takes_the_habits_of_a_profile(cell, tmp_path, capsys):
    profile = tmp_path / "cell.json"
    assert main.run(["verify-controller", "--profile", str(profile)]) == 0
    capsys.readouterr()
    habits = ["--profile", str(profile), "--option", "where_width=8"]
    habits += ["--password-env", "ROBOLINK_PASSWORD"]
    with command("sim", "epson", "--tcp", "127.0.0.1:0", *habits) as (first, _):
        assert main.run(["-c", first["url"], "verify-controller", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["options"]
    assert (found["tool_listing"], found["comma_blank"]) == ("padded", "always")
    assert found["where_width"] == 8


@pytest.mark.parametrize(
    ("content", "arguments"),
    [
        ("{}", ["--profile"]),
        ('{"schema": "robolink/epson-profile/1", "options": []}', ["--profile"]),
        ('{"schema": "robolink/epson-profile/1", "options": {"no": 1}}', ["--profile"]),
        ("no recording", ["--replay"]),
        ("", ["--seed", "3", "--replay"]),
        ("", ["--option", "terminator=cr", "--replay"]),
    ],
)
def test_sim_refuses_what_does_not_fit(tmp_path, content, arguments):
    path = tmp_path / "file"
    path.write_text(content)
    assert main.run(["sim", "epson", "--tcp", "127.0.0.1:0", *arguments, str(path)]) == 2
