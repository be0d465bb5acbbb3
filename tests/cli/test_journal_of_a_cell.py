"""A journal that a cell file names: for one cell, for all, under the environment."""

import json

import pytest
from robolink_cli import main
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

import robolink
from robolink.config import connect_cell, find_cell, load_cell_files, reach_cell
from robolink.errors import ConfigError
from robolink.journal import name_journals, open_journal
from robolink.model import EntryKind, Marker, MarkerKind, ToolOffset


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A cell file in a folder of its own, without a journal in the environment."""
    for name in ("ROBOLINK_JOURNAL", "ROBOLINK_STATE_DIR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("platformdirs.user_data_path", lambda *_, **__: tmp_path / "data")
    monkeypatch.setattr(
        "robolink.files.durable.state_folder", lambda kind: tmp_path / "state" / kind
    )
    monkeypatch.setenv("ROBOLINK_CONFIG", str(tmp_path / "cells" / "robolink.toml"))
    (tmp_path / "cells").mkdir()
    yield tmp_path
    name_journals({}, afresh=True)


@pytest.fixture
def url():
    with serve_tcp(EpsonSimulator(seed=5)) as host:
        yield host.url


def written(place, text):
    (place / "cells" / "robolink.toml").write_text(text)


def numbers(location):
    return [entry.number for entry in open_journal(str(location), read_only=True).entries()]


def test_a_cell_is_on_record_where_its_file_says_and_read_from_there(place, url, capsys):
    written(place, f'[cells.line3]\nurl = "{url}"\njournal = "line3.db"\n')
    assert main.run(["-c", "line3", "tool", "set", "1", "--x", "12.5"]) == 0
    assert numbers(place / "cells" / "line3.db")
    assert not (place / "data").exists()
    capsys.readouterr()
    for line in (["-c", "line3", "journal", "list"], ["journal", "list", "-c", "line3"]):
        assert main.run(["--json", *line]) == 0
        kinds = [one["kind"] for one in json.loads(capsys.readouterr().out)["entries"]]
        assert "done" in kinds
    assert main.run(["--json", "journal", "list"]) == 0
    assert json.loads(capsys.readouterr().out)["entries"] == []  # the journal of no cell
    assert main.run(["-c", "line3", "journal", "verify"]) == 0
    assert main.run(["-c", "line3", "undo", "--yes"]) == 0
    assert main.run(["-c", "line3", "check"]) == 0
    assert [one.cell for one in open_journal(str(place / "cells" / "line3.db")).checks()] == [
        "line3"
    ]


def test_what_the_file_says_of_all_counts_for_a_cell_that_says_nothing(place, url, capsys):
    other = "epson+tcp://127.0.0.1:1"
    written(
        place,
        f'journal = "all.db"\n[cells.line3]\nurl = "{url}"\n'
        f'[cells.line4]\nurl = "{other}"\njournal = "line4.db"\n',
    )
    assert main.run(["check"]) == 3
    for name in ("line3", "line4"):
        journal = place / "cells" / ("all.db" if name == "line3" else "line4.db")
        assert [one.cell for one in open_journal(str(journal)).checks()] == [name]
    capsys.readouterr()
    assert main.run(["--json", "journal", "checks"]) == 0
    assert [one["cell"] for one in json.loads(capsys.readouterr().out)["checks"]] == ["line3"]
    assert main.run(["--json", "journal", "checks", "-c", "line4"]) == 0
    assert [one["cell"] for one in json.loads(capsys.readouterr().out)["checks"]] == ["line4"]


@pytest.mark.parametrize("variable", ["ROBOLINK_JOURNAL", "ROBOLINK_STATE_DIR"])
def test_the_environment_goes_before(place, url, monkeypatch, capsys, variable):
    written(place, f'[cells.line3]\nurl = "{url}"\njournal = "line3.db"\n')
    folder = place / "given"
    folder.mkdir()
    own = folder / "journal.db"
    monkeypatch.setenv(variable, str(own if variable == "ROBOLINK_JOURNAL" else folder))
    assert main.run(["-c", "line3", "tool", "set", "1", "--x", "12.5"]) == 0
    assert numbers(own)
    assert not (place / "cells" / "line3.db").exists()
    capsys.readouterr()
    assert main.run(["--json", "cell", "show", "line3", "--origin"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert (shown["values"]["journal"], shown["origins"]["journal"]) == (str(own), variable)


def test_it_is_shown_with_its_source_and_without_what_is_secret(place, url, capsys):
    database = "postgresql://cells@db.plant/journal"
    written(place, f'journal = "{database}"\n[cells.line3]\nurl = "{url}"\n')
    assert main.run(["--json", "cell", "show", "line3", "--origin"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["values"]["journal"] == database
    assert shown["origins"]["journal"] == str(place / "cells" / "robolink.toml")
    written(place, f'[cells.line3]\nurl = "{url}"\n')
    assert main.run(["--json", "cell", "show", "line3", "--origin"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["values"]["journal"] == str(place / "data" / "journal.db")
    assert shown["origins"]["journal"] == "default"


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("postgresql://cells:S3cret9@db/journal", "must not contain a password"),
        ("postgresql://db/journal?user=cells&password=S3cret9", "must not contain a password"),
        ("mysql://db/journal", "must be a path, or postgresql://user@host/database"),
    ],
)
def test_what_is_no_place_is_refused_by_its_key_and_not_repeated(place, url, said, told, capsys):
    written(place, f'journal = "{said}"\n[cells.line3]\nurl = "{url}"\njournal = "{said}"\n')
    with pytest.raises(ConfigError) as caught:
        find_cell("line3")
    assert caught.value.what.count(told) == 2
    assert "S3cret9" not in str(caught.value)
    assert main.run(["journal", "list"]) == 2
    assert "S3cret9" not in capsys.readouterr().err


def test_a_folder_is_no_journal_and_a_share_is_refused_as_ever(place, url, capsys, monkeypatch):
    mounts = place / "mounts"
    mounts.write_text(f"1 1 0:1 / / rw - ext4 a rw\n2 1 0:2 / {place}/cells rw - nfs4 b rw\n")
    monkeypatch.setattr("robolink.journal._places.MOUNT_TABLE", mounts)
    written(place, f'[cells.line3]\nurl = "{url}"\njournal = "line3.db"\n')
    assert main.run(["-c", "line3", "tool", "set", "1", "--x", "12.5"]) == 2
    assert "on a network share (nfs4)" in capsys.readouterr().err
    assert not (place / "cells" / "line3.db").exists()
    assert main.run(["-c", "line3", "status"]) == 0  # looking goes on


def test_an_interrupted_job_shows_from_there_however_the_cell_is_looked_at(place, url, capsys):
    written(place, f'journal = "all.db"\n[cells.line3]\nurl = "{url}"\n')
    assert main.run(["-c", "line3", "tool", "set", "1", "--x", "12.5"]) == 0
    log = open_journal(str(place / "cells" / "all.db")).log(url)
    log.begin(Marker("a" * 32, MarkerKind.MOVE, "Go P1", "2026-01-01T00:00:00+00:00", {}))
    log.close()
    for _ in range(2):  # the second look does not check the files anew
        capsys.readouterr()
        assert main.run(["-c", "line3", "status"]) == 0
        assert "Sent 2026-01-01" in capsys.readouterr().err
    assert reach_cell("line3").journal == str(place / "cells" / "all.db")
    written(place, f'journal = "all.db"\n[cells.line3]\nurl = "{url}"\nspeed_mm_s = "x"\n')
    assert main.run(["-c", "line3", "status"]) == 0  # wrong beside the address and the journal
    assert "Sent 2026-01-01" in capsys.readouterr().err
    assert main.run(["-c", "line3", "stop"]) == 0
    assert "Sent 2026-01-01" in capsys.readouterr().err


def test_a_program_that_connects_to_the_cell_keeps_the_same_record(place, url):
    written(place, f'[cells.line3]\nurl = "{url}"\njournal = "line3.db"\n')
    with connect_cell("line3") as controller:
        controller.tools.write(2, ToolOffset(5, 6, -70), expected=robolink.ANY)
    kinds = [e.kind for e in open_journal(str(place / "cells" / "line3.db")).entries()]
    assert EntryKind.DONE in kinds or EntryKind.READ_BACK in kinds
    assert load_cell_files().journal == ""
