"""Markers survive what a process does not, and a damaged record blocks."""

import json
import os

import pytest

from robolink.errors import ConfigError
from robolink.markers import FileOutcomeLog, MemoryOutcomeLog, new_operation, wall_label
from robolink.model import Marker, MarkerKind

IDENTITY = "epson+tcp://192.168.0.1:5000"


def marker(operation="a", kind=MarkerKind.SET, **details):
    return Marker(operation, kind, "TLSet 3, XY(1,2,3,0,0,0)", "2025-01-01T00:00:00+00:00", details)


@pytest.fixture
def log(tmp_path):
    return FileOutcomeLog(IDENTITY, tmp_path / "outcomes")


@pytest.fixture(params=["file", "memory"])
def any_log(request, log):
    return log if request.param == "file" else MemoryOutcomeLog()


def test_open_markers_are_listed_oldest_first(any_log):
    for operation in "cab":
        any_log.begin(marker(operation))
    assert [known.operation for known in any_log.open_markers()] == ["c", "a", "b"]


def test_a_cleared_marker_is_gone_and_unknown_ids_are_ignored(any_log):
    any_log.begin(marker("a"))
    any_log.begin(marker("b"))
    any_log.clear("a")
    any_log.clear("never begun")
    assert [known.operation for known in any_log.open_markers()] == ["b"]
    any_log.clear("b")
    assert any_log.open_markers() == ()


def test_a_marker_of_the_same_operation_is_replaced_in_its_place(any_log):
    any_log.begin(marker("a", now=3))
    any_log.begin(marker("b"))
    any_log.begin(marker("a", now=0))
    assert [known.operation for known in any_log.open_markers()] == ["a", "b"]
    assert any_log.open_markers()[0].details == {"now": 0}


def test_another_process_finds_every_field_again(log, tmp_path):
    begun = marker("a", MarkerKind.SELECTION, tool=3, speed_percent=[5, 5, 5], high=False, was=None)
    log.begin(begun)
    assert FileOutcomeLog(IDENTITY, tmp_path / "outcomes").open_markers() == (begun,)


def test_controllers_do_not_share_a_record(tmp_path):
    identities = [IDENTITY, "epson+tcp://192.168.0.1:5001", "epson-tcp-192.168.0.1-5000"]
    logs = [FileOutcomeLog(identity, tmp_path) for identity in identities]
    logs[0].begin(marker())
    assert [len(log.open_markers()) for log in logs] == [1, 0, 0]


@pytest.mark.parametrize(
    "identity", ["../../etc/passwd", "a/b\\c:d*e?f", "", "..", "x" * 500, "机器人", "a\nb", "CON"]
)
def test_any_identity_gives_a_file_name_inside_the_folder(tmp_path, identity):
    log = FileOutcomeLog(identity, tmp_path)
    log.begin(marker())
    assert log.path.parent == tmp_path
    assert [path.name for path in tmp_path.iterdir()] == [log.path.name]
    assert log.path.name.isascii()
    assert not set(log.path.name) & set('\\/:*?"<>|\n')
    assert len(log.path.name) < 100


def test_nothing_is_left_behind_when_all_is_settled(log):
    log.begin(marker())
    log.clear("a")
    assert list(log.path.parent.iterdir()) == []


def test_the_record_is_the_user_s_own(log):
    log.begin(marker())
    assert log.path.stat().st_mode & 0o077 == 0


DAMAGED = {
    "empty": b"",
    "cut short": b'{"schema": "robolink/outcomes/1", "controller": "epson+tcp',
    "not text": b"\xff\xfe\x00",
    "another document": b"[]",
    "no markers": json.dumps({"schema": "robolink/outcomes/1", "controller": IDENTITY}).encode(),
    "deep": b"[" * 100_000,
}


@pytest.mark.parametrize("content", DAMAGED.values(), ids=DAMAGED)
def test_a_damaged_record_blocks_and_is_not_written_over(log, content):
    log.path.parent.mkdir()
    log.path.write_bytes(content)
    for use in (log.open_markers, lambda: log.begin(marker()), lambda: log.clear("a")):
        with pytest.raises(ConfigError) as caught:
            use()
        assert str(log.path) in caught.value.what
        assert "move this file away" in caught.value.remedy
    assert log.path.read_bytes() == content


@pytest.mark.parametrize("field", ["operation", "kind", "request", "begun_at", "details"])
def test_a_marker_with_a_field_that_makes_no_sense_blocks(log, field):
    log.begin(marker())
    document = json.loads(log.path.read_text())
    document["markers"][0][field] = 7
    log.path.write_text(json.dumps(document))
    with pytest.raises(ConfigError, match="damaged"):
        log.open_markers()


@pytest.mark.parametrize(
    ("field", "value"), [("schema", "robolink/outcomes/2"), ("controller", "epson+tcp://else:1")]
)
def test_a_record_of_a_newer_form_or_another_controller_is_refused(log, field, value):
    log.begin(marker())
    document = json.loads(log.path.read_text())
    document[field] = value
    log.path.write_text(json.dumps(document))
    with pytest.raises(ConfigError, match=value.replace("+", r"\+")):
        log.open_markers()


@pytest.mark.parametrize("step", ["fsync", "replace", "open"])
def test_a_full_or_read_only_disk_is_told_and_the_old_record_stays(log, monkeypatch, step):
    log.begin(marker("a"))

    def fail(*arguments, **options):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as disk:
        disk.setattr(os, step, fail)
        with pytest.raises(ConfigError, match="No space left") as caught:
            log.begin(marker("b"))
    assert isinstance(caught.value.__cause__, OSError)
    assert [known.operation for known in log.open_markers()] == ["a"]
    assert [path.name for path in log.path.parent.iterdir()] == [log.path.name]


def test_a_folder_that_cannot_be_made_is_told_before_anything_is_sent(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(ConfigError, match="safety record"):
        FileOutcomeLog(IDENTITY, tmp_path / "file" / "outcomes").begin(marker())


def test_a_marker_is_on_disk_before_begin_returns(log, monkeypatch):
    steps: list[str] = []

    def noted(name, act):
        def act_and_note(*arguments):
            act(*arguments)
            steps.append(name)

        return act_and_note

    for name in ("fsync", "replace"):
        monkeypatch.setattr(os, name, noted(name, getattr(os, name)))
    log.path.parent.mkdir()
    log.begin(marker())
    expected = ["fsync", "replace", "fsync"] if hasattr(os, "O_DIRECTORY") else ["fsync", "replace"]
    assert steps == expected


def test_the_state_folder_can_be_named(monkeypatch, tmp_path):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    assert FileOutcomeLog(IDENTITY).path.parent == tmp_path / "outcomes"


def test_the_state_folder_is_the_user_s_own_otherwise(monkeypatch, tmp_path):
    monkeypatch.delenv("ROBOLINK_STATE_DIR", raising=False)
    monkeypatch.setattr("platformdirs.user_state_path", lambda name, appauthor: tmp_path / name)
    assert FileOutcomeLog(IDENTITY).path.parent == tmp_path / "robolink" / "outcomes"


def test_operations_are_unique_and_labels_are_utc():
    assert len({new_operation() for _ in range(100)}) == 100
    assert wall_label().endswith("+00:00")
