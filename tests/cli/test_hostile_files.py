"""A named file may contain anything: it is refused at once, with its name and the reason."""

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
from robolink.files.toml import MOST_BYTES as HOSTILE_MOST_BYTES
from robolink.files.toml import MOST_SHOWN

# A file that is not regular, or has no end, is refused at once by every command that reads one.

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
    """A pipe without a writer, a device without an end, a folder."""
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


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="POSIX pipes and devices")
@pytest.mark.parametrize("name", COMMANDS)
def test_it_is_refused_and_not_waited_for(name, no_file, capsys):
    words = [word.replace("{file}", str(no_file)) for word in COMMANDS[name]]
    code, what = run(words, capsys)
    assert code == 2, what
    assert str(no_file) in what, what


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="POSIX pipes and devices")
def test_a_cell_file_is_no_exception(no_file, capsys, monkeypatch):
    monkeypatch.setenv("ROBOLINK_CONFIG", str(no_file))
    code, what = run(["-c", "a", "status"], capsys)
    assert code == 2
    assert str(no_file) in what


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="POSIX pipes and devices")
def test_a_journal_is_no_exception(no_file, capsys, monkeypatch):
    monkeypatch.setenv("ROBOLINK_JOURNAL", str(no_file))
    code, what = run(["journal", "list"], capsys)
    assert code == 2
    assert f"{no_file} is not a regular file" in what


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="POSIX pipes and devices")
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


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="POSIX pipes and devices")
def test_a_stop_does_not_wait_for_a_password_file(no_file, capsys):
    with serve_tcp(EpsonSimulator(seed=4)) as host:
        began_s = time.monotonic()
        assert entry.run(["-c", host.url, "--password-file", str(no_file), "stop"]) == 0
        assert time.monotonic() - began_s < 10.0
    assert f"The password file {no_file} cannot be read" in capsys.readouterr().err


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="POSIX pipes and devices")
def test_a_recording_goes_on_where_it_ended(tmp_path):
    path = tmp_path / "morning"
    for line in ("first", "second"):
        with append_to_named(path) as file:
            file.write(line + "\n")
    assert path.read_bytes() == b"first\nsecond\n"
    assert holds(path, b"first\nsecond\n")
    assert not holds(path, b"first\n")
    assert not holds(tmp_path, b"")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="POSIX pipes and devices")
@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="this system lists no open files")
def test_a_folder_in_place_of_a_file_is_refused_in_our_words_and_left_closed(tmp_path):
    before = len(list(Path("/proc/self/fd").iterdir()))
    for _ in range(20):
        with pytest.raises(OSError, match="it is not a regular file"):
            read_named(tmp_path)
    assert len(list(Path("/proc/self/fd").iterdir())) < before + 20


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="POSIX pipes and devices")
def test_a_file_that_is_too_long_is_refused_and_a_link_is_followed(tmp_path):
    path, link = tmp_path / "long", tmp_path / "link"
    path.write_bytes(b"x" * MOST_BYTES)
    link.symlink_to(path)
    assert len(read_named(link)) == MOST_BYTES
    with path.open("ab") as file:
        file.write(b"x")
    with pytest.raises(OSError, match="longer than 4 MB"):
        read_named(path)


# A named file may hold anything: it is refused at once, with its name and the reason.
# Irregular files, pipes and devices: test_hostile_files.py.

READERS = {name: words for name, words in COMMANDS.items() if name not in ("password", "dialogue")}
"""A password file may contain anything, and a dialogue file is written."""

CONTENTS = {
    "nothing": b"",
    "no UTF-8": b"\xff\xfe\xe4\0\n" * 100,
    "one long line": b"x" * 200_000,
    "open quote": b'name,address\n"' + b"x" * 200_000,
    "deep JSON objects": b'{"schema":' * 50_000,
    "deep TOML": b"a = " + b"{ a = " * 20_000,
    "long key": b".".join([b"a"] * 60_000) + b" = 1\n",
    "long key in a table": b"b = { " + b".".join([b"a"] * 60_000) + b" = 1 }\n",
    "long header": b"[" + b".".join([b"a"] * 60_000) + b"]\n",
    "many keys": b"".join(b"a%d = 1\n" % number for number in range(400)),
    "many digits": b'{"schema": ' + b"1" * 100_000 + b"}",
    "digits of a register": b"name,address\nTool1_X," + b"1" * 5000 + b"\n",
    "digits of a name": b"name,address\nTool" + b"1" * 5000 + b"_X,1\n",
    "numbers that are none": b'{"schema": "robolink/backup/1", "tools": NaN, "tools": 1e999}',
    "control characters": b"\x1b]0;hostile\x07\x1b[2J = 1\n",
    "too long": b"# comment\n" * (1 + 4_000_000 // 10),
}
LONGEST_S = 5.0
TURNS = 4


def refused(words, capsys):
    began_s = time.process_time()
    code = main.run(["--json", *words])
    out = capsys.readouterr()
    document = json.loads(out.out)
    assert time.process_time() - began_s < LONGEST_S
    assert code == 2, document
    said = document["error"]["what"] + document["error"]["remedy"] + out.err
    assert "\x1b" not in said
    assert len(said) < 20_000
    return document["error"]["what"]


def turns():
    """Yield each content with every fourth reader, each time starting at another one."""
    for number, content in enumerate(CONTENTS):
        for turn in range(TURNS):
            now = turn == number % TURNS and content != "too long"
            yield pytest.param(content, turn, marks=() if now else pytest.mark.soak)


@pytest.mark.parametrize(("content", "turn"), list(turns()))
def test_whatever_a_file_holds_it_is_refused_by_name(content, turn, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "hostile"
    file.write_bytes(CONTENTS[content])
    for name, words in list(READERS.items())[turn::TURNS]:
        what = refused([word.replace("{file}", str(file)) for word in words], capsys)
        # A case of solve is one document: errors name its places, not its file.
        assert "hostile" in what or name in ("case", "table"), (name, what)
    monkeypatch.setenv("ROBOLINK_CONFIG", str(file))
    refused(["-c", "a", "status"], capsys)


@pytest.mark.parametrize("kind", ["recipe", "map", "cell"])
def test_a_toml_file_above_its_limit_is_refused_with_the_limit(kind, tmp_path, capsys, monkeypatch):
    file = tmp_path / "long.toml"
    file.write_bytes(b"#" * (HOSTILE_MOST_BYTES + 1))
    words = {
        "recipe": READERS["recipe"],
        "map": READERS["map check"],
        "cell": ["-c", "a", "status"],
    }[kind]
    monkeypatch.setenv("ROBOLINK_CONFIG", str(file if kind == "cell" else ""))
    what = refused([word.replace("{file}", str(file)) for word in words], capsys)
    assert "it is longer than 0.25 MB" in what


def test_of_very_many_problems_the_first_are_told_and_the_rest_counted(tmp_path, capsys):
    file = tmp_path / "many.toml"
    file.write_text("".join(f"key_{number} = 1\n" for number in range(3 * MOST_SHOWN)))
    what = refused(["-c", "epson+sim://many", "recalibrate", str(file), "--yes"], capsys)
    assert len(what.splitlines()) == 1 + MOST_SHOWN + 1
    assert " more" in what.splitlines()[-1]


def test_a_key_of_as_many_parts_as_any_that_we_know_is_no_long_key(tmp_path, capsys):
    file = Path(tmp_path / "dots.toml")
    dots = ".".join(["a"] * 8)
    # Dots in texts and comments, however many, do not belong to a key.
    text = f'# {"a." * 100}\n{dots} = "{"a." * 100}"\nb = ["{"a." * 100}", 1.5, 2.5]\n'
    file.write_text(text)
    what = refused(["-c", "epson+sim://many", "recalibrate", str(file), "--yes"], capsys)
    assert "more than 32 parts" not in what
