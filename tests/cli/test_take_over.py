"""Who has a controller, where the record cannot be read, and where it has others, too."""

from pathlib import Path

import pytest
from robolink_cli.session.take_over import holder_of, name_holder

from robolink.errors import ConnectError, JournalError

URL = "epson+tcp://192.0.2.1:5000"


@pytest.fixture
def broken_record(tmp_path, monkeypatch):
    """A record that is none."""
    path = tmp_path / "journal.db"
    path.write_bytes(b"no database" * 500)
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    monkeypatch.setenv("ROBOLINK_JOURNAL", str(path))
    return Path(path)


@pytest.mark.usefixtures("broken_record")
def test_a_record_that_cannot_be_read_hides_no_error_of_the_connection():
    with pytest.raises(JournalError):
        holder_of(URL)
    error = ConnectError("No route to the controller.")
    assert name_holder(URL, error) is error
