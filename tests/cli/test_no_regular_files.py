"""What is not a regular file, or has no end, is refused at once by every command that reads one."""

import json
import os
import resource
import time
from pathlib import Path

import pytest
from robolink_cli import entry, main
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.files.named import MOST_BYTES, append_to_named, holds, read_named

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="POSIX pipes and devices")

URL = "epson+sim://no-regular-files"
MAP_URL = "plc+modbus-tcp://127.0.0.1:1?map={file}"
COMMANDS = {
    "backup": ["-c", URL, "restore", "{file}", "--yes"],
    "compare": ["-c", URL, "compare", "{file}"],
    "recipe": ["-c", URL, "recalibrate", "{file}", "--yes"],
    "poses": ["-c", URL, "calibrate", "two-pose", "--tool", "1", "--poses", "{file}", "--yes"],
    "points": ["-c", URL, "impact", "--tool", "1", "--x", "1", "--pts", "{file}"],
    "map": ["-c", MAP_URL, "status"],
    "map check": ["plc", "check-map", "{file}"],
    "register list": ["plc", "check-map", "--from-csv", "{file}"],
    "case": ["solve", "{file}"],
    "table": ["solve", "{file}", "--method", "pivot"],
    "password": ["-c", "epson+tcp://127.0.0.1:1", "--password-file", "{file}", "status"],
    "dialogue": ["-c", URL, "--record", "{file}", "status"],
    "recording": ["sim", "epson", "--tcp", "127.0.0.1:0", "--replay", "{file}"],
    "profile": ["sim", "epson", "--tcp", "127.0.0.1:0", "--profile", "{file}"],
    "state": ["sim", "epson", "--tcp", "127.0.0.1:0", "--state", "{file}"],
    "PLC state": ["sim", "softmotion", "--modbus-tcp", "127.0.0.1:0", "--state", "{file}"],
}


@pytest.fixture(params=["pipe", "endless", "folder"])
def no_file(request, tmp_path):
    """A pipe that nobody writes to, a device that never ends, a folder."""
    if request.param == "endless":
        return Path("/dev/zero")
    path = tmp_path / request.param
    if request.param == "pipe":
        os.mkfifo(path)
    else:
        path.mkdir()
    return path


@pytest.fixture(autouse=True)
def _own_state_folder(state_folder):
    return state_folder


def run(words, capsys):
    began_s, before_kb = time.monotonic(), _memory_kb()
    code = main.run(["--json", *words])
    document = json.loads(capsys.readouterr().out)
    assert time.monotonic() - began_s < 10.0
    assert _memory_kb() - before_kb < 200_000
    return code, document["error"]["what"]


def _memory_kb():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


@pytest.mark.parametrize("name", COMMANDS)
def test_it_is_refused_and_not_waited_for(name, no_file, capsys):
    words = [word.replace("{file}", str(no_file)) for word in COMMANDS[name]]
    code, what = run(words, capsys)
    assert code == 2, what
    assert str(no_file) in what, what


def test_a_cell_file_is_no_exception(no_file, capsys, monkeypatch):
    monkeypatch.setenv("ROBOLINK_CONFIG", str(no_file))
    code, what = run(["-c", "a", "status"], capsys)
    assert code == 2
    assert str(no_file) in what


def test_a_journal_is_no_exception(no_file, capsys, monkeypatch):
    monkeypatch.setenv("ROBOLINK_JOURNAL", str(no_file))
    code, what = run(["journal", "list"], capsys)
    assert code == 2
    assert f"{no_file} is not a regular file" in what


@pytest.mark.parametrize("where", ["environment", "cell file"])
def test_a_password_file_that_nobody_typed_is_no_exception(where, no_file, capsys, monkeypatch):
    cell = '[cells.a]\nurl = "epson+tcp://127.0.0.1:1"\n'
    if where == "environment":
        monkeypatch.setenv("ROBOLINK_PASSWORD_FILE", str(no_file))
    else:
        cell += f'password_file = "{no_file}"\n'
    Path("robolink.toml").write_text(cell)
    code, what = run(["-c", "a", "status"], capsys)
    assert code == 2
    assert str(no_file) in what


def test_a_stop_does_not_wait_for_a_password_file(no_file, capsys):
    with serve_tcp(EpsonSimulator(seed=4)) as host:
        began_s = time.monotonic()
        assert entry.run(["-c", host.url, "--password-file", str(no_file), "stop"]) == 0
        assert time.monotonic() - began_s < 10.0
    assert f"The password file {no_file} cannot be read" in capsys.readouterr().err


def test_a_recording_goes_on_where_it_ended(tmp_path):
    path = tmp_path / "morning"
    for line in ("first", "second"):
        with append_to_named(path) as file:
            file.write(line + "\n")
    assert path.read_bytes() == b"first\nsecond\n"
    assert holds(path, b"first\nsecond\n")
    assert not holds(path, b"first\n")
    assert not holds(tmp_path, b"")


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="this system lists no open files")
def test_a_folder_in_place_of_a_file_is_refused_in_our_words_and_left_closed(tmp_path):
    before = len(list(Path("/proc/self/fd").iterdir()))
    for _ in range(20):
        with pytest.raises(OSError, match="it is not a regular file"):
            read_named(tmp_path)
    assert len(list(Path("/proc/self/fd").iterdir())) < before + 20


def test_a_file_that_is_too_long_is_refused_and_a_link_is_followed(tmp_path):
    path, link = tmp_path / "long", tmp_path / "link"
    path.write_bytes(b"x" * MOST_BYTES)
    link.symlink_to(path)
    assert len(read_named(link)) == MOST_BYTES
    with path.open("ab") as file:
        file.write(b"x")
    with pytest.raises(OSError, match="longer than 4 MB"):
        read_named(path)
