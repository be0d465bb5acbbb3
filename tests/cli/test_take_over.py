"""Who has a controller, where the record cannot be read, and where it has others, too."""

import time
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace

import pytest
from robolink_cli.session import take_over
from robolink_cli.session.take_over import _require_stopped, holder_of, name_holder
from robolink_cli.stopping.request import StopRequest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

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


def test_a_controller_that_is_not_free_yet_is_asked_to_stop_again_after_a_pause(
    monkeypatch, tmp_path, capsys
):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    with serve_tcp(EpsonSimulator()) as host:
        url = host.url
    pauses: list[float] = []
    with ExitStack() as stack:

        def sleep(pause_s):
            pauses.append(pause_s)
            stack.enter_context(serve_tcp(EpsonSimulator(), port=int(url.rpartition(":")[2])))

        clock = SimpleNamespace(monotonic=time.monotonic, sleep=sleep)
        monkeypatch.setattr(take_over, "time", clock)
        _require_stopped(StopRequest(url))
    assert pauses == [0.1]
    assert "the robot has stopped (confirmed)" in capsys.readouterr().err
