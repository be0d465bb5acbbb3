"""With an unusable journal, status and stop still work."""

import shutil
import sqlite3
import tempfile
from pathlib import Path

import pytest
from robolink_cli.console.exit_codes import USAGE

import robolink
from robolink.errors import JournalError
from robolink.journal import open_journal
from robolink.model import Marker, MarkerKind, ToolOffset
from tests.faults._nozzle_cell import OLD_TIP, served_cell
from tests.faults._requests import changes

UNREACHABLE = "postgresql+psycopg://nobody@127.0.0.1:1/journal"
SAID = {
    "damaged": "it is damaged",
    "newer": "is newer: form ",
    "garbage": "it is not a journal",
    "unreachable": "the database cannot be reached",
}
LOOKS = {
    "status": ["status"],
    "where": ["where"],
    "tool list": ["tool", "list"],
    "tool get": ["tool", "get", "1"],
    "reset": ["reset", "--yes"],
    "motors off": ["motors", "off"],
}


def spoil(how, path, monkeypatch):
    """Make the journal unusable."""
    if how == "unreachable":
        monkeypatch.setenv("ROBOLINK_JOURNAL", UNREACHABLE)
    elif how == "newer":
        with sqlite3.connect(path) as connection:
            connection.execute("UPDATE schema_version SET version = version + 1")
        connection.close()
    else:
        content = bytearray(path.read_bytes())
        content[0 if how == "garbage" else 100 : 8192] = b"\xff" * (
            8192 if how == "garbage" else 8092
        )
        path.write_bytes(content)


@pytest.fixture(scope="module", params=SAID)
def spoiled(request):
    """A cell whose journal held an open marker when it became unusable."""
    folder = Path(tempfile.mkdtemp(prefix="robolink-looking-"))
    with pytest.MonkeyPatch.context() as monkeypatch:
        with served_cell(folder / "cell", monkeypatch) as cell:
            path = folder / "journal.db"
            monkeypatch.setenv("ROBOLINK_JOURNAL", str(path))
            assert cell.run("status").code == 0
            log = open_journal().log(cell.url)
            log.begin(Marker("a", MarkerKind.MOVE, "Move XY(1,2,3)", "then", {"target": [1]}))
            log.close()
            open_journal().close()
            for beside in folder.glob("journal.db-*"):
                beside.unlink()
            spoil(request.param, path, monkeypatch)
            yield cell, request.param
    shutil.rmtree(folder)


@pytest.mark.parametrize("command", LOOKS)
def test_looking_and_calming_go_on_and_say_it_when_they_are_done(spoiled, command):
    cell, how = spoiled
    shown = cell.run(*LOOKS[command])
    assert shown.code == 0, shown.err
    assert SAID[how] in shown.err.splitlines()[-1]
    assert "was not sent" not in shown.err
    # The readable part of it is shown.
    assert ("a movement" in shown.err) == (how == "newer")


@pytest.mark.parametrize(
    "arguments", [["tool", "set", "1", "--x", "12.5", "--yes"], ["jog", "x+1", "--yes"]]
)
def test_changing_does_not(spoiled, arguments):
    cell, how = spoiled
    asked = len(cell.requests)
    refused = cell.run(*arguments)
    assert refused.code == USAGE
    assert SAID[how] in refused.err
    assert changes(cell.requests[asked:]) == []
    assert cell.tool_1 == OLD_TIP


def test_the_library_connects_looks_stops_and_refuses_the_rest(spoiled):
    cell, how = spoiled
    with robolink.connect(cell.url) as controller:
        assert controller.status().state
        assert controller.tools.read(1) == OLD_TIP
        assert SAID[how] in str(controller.outcomes.trouble)
        controller.stop()
        controller.release_stop()
        with pytest.raises(JournalError, match=SAID[how]):
            controller.tools.write(1, ToolOffset(1), expected=OLD_TIP)
        with pytest.raises(JournalError), controller.preserved("a calibration"):
            pass
    assert cell.tool_1 == OLD_TIP
