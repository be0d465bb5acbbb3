"""``--log-file``: its contents; a faulty one ends no command, and no stop waits for it."""

import errno
import logging
import os
import re
from pathlib import Path

import click
import pytest
from robolink_cli import entry, main
from robolink_cli.options import log_handler
from robolink_cli.stopping.request import StopRequest, read_stop
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import (
    register,
    simulator_named,
    unregister,
)

from robolink import package_log
from robolink.model import Secret

PASSWORD = "canary-log-file"
LINE = re.compile(
    r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}\+00:00 (DEBUG|INFO|WARNING) \d+ MainThread \S+ \S+: "
)
SET = ("tool", "set", "5", "--x", "1", "--y", "2", "--z", "-3", "--yes")


@pytest.fixture
def cell(state_folder, monkeypatch):
    """The URL of a simulated controller with a password."""
    monkeypatch.setenv("ROBOLINK_PASSWORD", PASSWORD)
    package_log._told.clear()
    yield register("log-file", EpsonSimulator(seed=1, password=Secret(PASSWORD)))
    unregister("log-file")
    assert logging.getLogger("robolink").level == logging.NOTSET
    assert not any(
        isinstance(one, log_handler.LogFile) for one in logging.getLogger("robolink").handlers
    )


def test_a_write_stands_in_the_log_with_its_decisions_and_without_the_password(cell):
    assert main.run(["-c", cell, "--log-file", "day.log", "--log-level", "debug", *SET]) == 0
    assert main.run(["-c", cell, "status", "--log-file", "day.log"]) == 0
    text = Path("day.log").read_text(encoding="utf-8")
    assert all(LINE.match(line) for line in text.splitlines()), text
    assert PASSWORD not in text
    at = 0
    for sentence in (
        "INFO",
        "robolink_cli robolink: began: robolink tool set",
        f"robolink.transport {cell}: sent <secret>",
        f"robolink.controllers {cell}: connected",
        f'robolink.transport {cell}: sent $Execute,"TLSet 5',
        f"robolink.controllers {cell}: verified: tool 5 reads back as written",
        "ended: exit code 0",
        "began: robolink status",
        "ended: exit code 0",
    ):
        at = text.index(sentence, at)
    assert "DEBUG" not in text.partition("began: robolink status")[2]


def test_what_is_refused_stands_in_the_log_with_its_exit_code(cell, tmp_path):
    assert main.run(["-c", cell, "tool", "get", "99", "--log-file", "day.log"]) == 2
    assert Path("day.log").read_text(encoding="utf-8").endswith("ended: exit code 2\n")


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--log-file", "no/such/folder"], "cannot be written"),
        (["--log-file", "."], "cannot be written"),
        (["--log-level", "debug"], "Give --log-file FILE too"),
        (
            ["--log-file", "day.log", "--log-level", "loud"],
            "Choose one of these: debug, info, warning, error",
        ),
    ],
)
def test_a_log_that_cannot_be_refuses_a_command_before_anything_is_sent(
    cell, capsys, options, told
):
    assert main.run(["-c", cell, *options, *SET]) == 2
    assert told in " ".join(capsys.readouterr().err.split())
    assert simulator_named("log-file").machine.tools.get(5) is None
    # A stop goes out all the same, and faults are reported afterwards.
    for line in (["-c", cell, *options, "stop"], [f"-c{cell}", *options, "stop"]):
        assert entry.run(line) == 0
        said = " ".join(capsys.readouterr().err.split())
        assert "log" in said
        assert "The stop went out anyway." in said


@pytest.mark.parametrize("joined", [False, True])
def test_a_stop_is_logged_once_it_is_over(cell, joined, monkeypatch):
    """click reads the command line if ``-cURL`` is one word."""
    where = [f"-c{cell}"] if joined else ["-c", cell]
    assert entry.run([*where, "stop", "--log-file", "day.log", "--log-level", "debug"]) == 0
    text = Path("day.log").read_text(encoding="utf-8")
    assert all(LINE.match(line) for line in text.splitlines()), text
    assert text.index("sent $Abort") < text.index("sent $Stop") < text.index("has stopped")
    assert PASSWORD not in text


def test_a_stop_s_line_is_read_with_the_options_of_a_log():
    read = read_stop(["stop", "--log-file", "a", "--log-level=loud"])
    assert read == StopRequest(log_file="a", log_level="loud")


class Filling:
    """A file on a disk with room for ``lines`` lines."""

    name = "full"

    def __init__(self, lines):
        self.left = lines

    def write(self, text):
        self.left -= 1
        if self.left < 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def flush(self):
        if self.left < 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    close = flush

    def fileno(self):
        raise OSError(errno.EBADF, os.strerror(errno.EBADF))


@pytest.mark.parametrize("lines", [0, 3])
def test_a_disk_that_is_full_ends_no_change_and_is_told_once(cell, capsys, monkeypatch, lines):
    monkeypatch.setattr(log_handler.LogFile, "_open", lambda _: Filling(lines))
    monkeypatch.setattr(log_handler.LogFile, "reopenIfNeeded", lambda _: None)
    monkeypatch.setattr(log_handler.LogFile, "_statstream", lambda _: None)
    assert main.run(["-c", cell, "--log-file", "day.log", "--log-level", "debug", *SET]) == 0
    out, err = capsys.readouterr()
    assert "written, read back" in out
    assert err.count("No space left on device") == 1, err


@pytest.mark.parametrize(("lines", "code"), [(0, 2), (3, 0)])
def test_a_recording_that_fills_the_disk_ends_no_change_and_is_told_once(
    cell, capsys, monkeypatch, lines, code
):
    monkeypatch.setattr("robolink.files.named.append_to_named", lambda _: Filling(lines))
    assert main.run(["-c", cell, "--record", "day.jsonl", *SET]) == code
    assert capsys.readouterr().err.count("No space left on device") == 1
    written = simulator_named("log-file").machine.tools.get(5)
    assert (written is not None) == (code == 0)


@pytest.mark.parametrize(
    "path", ["", "status", "stop", "tool set", "cell ports", "calibrate two-pose"]
)
def test_every_kind_of_command_has_the_options_of_a_log(path):
    command: click.Command | None = main.cli
    for name in path.split():
        assert isinstance(command, click.Group)
        command = command.get_command(click.Context(command), name)
    assert command is not None
    options = {name for parameter in command.params for name in parameter.opts}
    assert {"--log-file", "--log-level"} <= options


def record_of(text):
    return logging.LogRecord("robolink", logging.INFO, "", 0, text, None, None)


def test_a_file_that_is_moved_away_is_begun_anew(tmp_path):
    path = tmp_path / "day.log"
    handler = log_handler.LogFile(str(path))
    handler.emit(record_of("before"))
    path.rename(tmp_path / "day.log.1")
    handler.emit(record_of("behind"))
    handler.close()
    assert (tmp_path / "day.log.1").read_text(encoding="utf-8").endswith("before\n")
    assert path.read_text(encoding="utf-8").endswith("behind\n")


def test_lines_of_two_programs_are_not_mixed(tmp_path):
    """Each handler has its own file, as each process does."""
    from concurrent.futures import ThreadPoolExecutor

    path = tmp_path / "day.log"
    handlers = [log_handler.LogFile(str(path)) for _ in range(2)]

    def write(which):
        for _ in range(60):
            handlers[which].emit(record_of(f"{which}" * 9000))

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(write, range(2)))
    for handler in handlers:
        handler.close()
    lines = path.read_text(encoding="utf-8").splitlines()
    assert len(lines) == 120
    assert {line.rpartition(" ")[2] for line in lines} == {"0" * 9000, "1" * 9000}
