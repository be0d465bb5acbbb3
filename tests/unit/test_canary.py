"""The watch over passwords finds one wherever it is put."""

import logging
import sqlite3
import subprocess
import sys

import pytest

from robolink.errors import ConfigError, RemoteProtocolError
from robolink.model import Secret
from tests.conftest import CANARIES

CANARY = "canary-5af1"


@pytest.fixture
def leaks(tmp_path, capsys):
    """Look for the canary, then forget it, so that the test itself does not fail for it."""

    def found():
        capsys.readouterr()
        places = CANARIES.leaks(tmp_path)
        CANARIES.begin()
        for file in tmp_path.iterdir():
            file.unlink()
        return places

    Secret(CANARY)
    return found


def test_a_password_that_is_kept_to_oneself_is_not_found(leaks, tmp_path):
    (tmp_path / "journal").write_text("Secret('***')")
    (tmp_path / "password").write_text(f"{CANARY}\n")  # where a person put it
    sys.stdout.write(f"{Secret(CANARY)} {Secret(CANARY)!r}")
    logging.getLogger("robolink").warning("%s", Secret(CANARY))
    assert leaks() == []


def test_it_is_found_in_a_file_of_any_kind(leaks, tmp_path):
    database = tmp_path / "journal.sqlite3"
    with sqlite3.connect(database) as journal:
        journal.execute("create table entry (details text)")
        journal.execute("insert into entry values (?)", (f'{{"request": "$Login,{CANARY}"}}',))
    journal.close()
    (tmp_path / "trace").write_text(f"sent $Login,{CANARY}\n")
    assert sorted(leaks()) == [str(database), str(tmp_path / "trace")]


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_it_is_found_in_what_is_printed(leaks, stream):
    getattr(sys, stream).write(f"logging in with {CANARY}")
    assert leaks() == ["shown"]


def test_it_is_found_in_what_another_process_prints(leaks):
    subprocess.run([sys.executable, "-c", f"print({CANARY!r})"], capture_output=True, check=True)
    assert leaks() == ["shown by another process"]


def test_it_is_found_in_what_is_logged(leaks):
    logging.getLogger("pymodbus").warning("sent %s", CANARY)
    assert leaks() == ["logged by pymodbus"]


def test_it_is_found_in_an_error_that_nobody_sees(leaks):
    ConfigError("wrong", remedy=f"use {CANARY}")
    RemoteProtocolError("wrong", raw=f"$Login,{CANARY}".encode())
    RemoteProtocolError(f"no answer to $Login,{CANARY}")
    assert leaks() == ["ConfigError", "RemoteProtocolError", "RemoteProtocolError"]
