"""A file that a person names may hold anything: it is refused at once, by its name and the reason.

No regular file, a pipe, a device: test_no_regular_files.py.
"""

import json
import time
from pathlib import Path

import pytest
from robolink_cli import main

from robolink.files.toml import MOST_BYTES, MOST_SHOWN
from tests.cli.test_no_regular_files import COMMANDS

READERS = {name: words for name, words in COMMANDS.items() if name not in ("password", "dialogue")}
"""A password may be anything, and a dialogue is written."""

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


@pytest.fixture(autouse=True)
def _own_state_folder(state_folder):
    return state_folder


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
    """Yield each content with every fourth reader, beginning with another one each time."""
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
        # A case of solve is one document: its places are named, not its file.
        assert "hostile" in what or name in ("case", "table"), (name, what)
    monkeypatch.setenv("ROBOLINK_CONFIG", str(file))
    refused(["-c", "a", "status"], capsys)


@pytest.mark.parametrize("kind", ["recipe", "map", "cell"])
def test_a_toml_file_above_its_limit_is_refused_with_the_limit(kind, tmp_path, capsys, monkeypatch):
    file = tmp_path / "long.toml"
    file.write_bytes(b"#" * (MOST_BYTES + 1))
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
    # Dots in texts and comments, however many, are none of a key.
    text = f'# {"a." * 100}\n{dots} = "{"a." * 100}"\nb = ["{"a." * 100}", 1.5, 2.5]\n'
    file.write_text(text)
    what = refused(["-c", "epson+sim://many", "recalibrate", str(file), "--yes"], capsys)
    assert "more than 32 parts" not in what
