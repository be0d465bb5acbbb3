"""A record that is looked for in another database than the one it is kept in."""

import pytest

from robolink.errors import OutcomeUnknownError
from robolink.journal import open_journal
from robolink.model import EntryKind, Marker, MarkerKind, NewEntry

NOW = "2026-01-01T00:00:00+00:00"
CHANGE = Marker("a", MarkerKind.CHANGE, "a change that is killed", NOW, {"tools": {}})
LOOKED = NewEntry(EntryKind.DECISION, verdict="a person looked and begins a new record")
MOVE = Marker("b", MarkerKind.MOVE, "Go P1", NOW)


@pytest.mark.parametrize("history", [False, True])
def test_an_unfinished_change_in_a_file_blocks_on_a_server_too(
    server, history, tmp_path, monkeypatch
):
    """A server that was used before has a history, and is not the record for that."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    place = server.empty_place()
    if history:
        before, after = (
            open_journal(where).log("cell-a") for where in (place, str(tmp_path / "journal.db"))
        )
        before.begin(MOVE)
        before.clear(MOVE.operation)
        (lost,) = after.open_markers()
        after.clear(lost.operation, LOOKED)
    open_journal(str(tmp_path / "journal.db")).log("cell-a").begin(CHANGE)
    for _ in range(2):
        log = open_journal(place).log("cell-a")
        (marker,) = log.open_markers()
        assert marker.kind is MarkerKind.HISTORY
        with pytest.raises(OutcomeUnknownError):
            log.begin(MOVE)
    assert open_journal(place).log("cell-b").open_markers() == ()
    log.clear(marker.operation, LOOKED)
    log.begin(MOVE)
    log.clear(MOVE.operation)
    assert open_journal(place).log("cell-a").open_markers() == ()
