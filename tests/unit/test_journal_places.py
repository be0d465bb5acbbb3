"""The place of a journal: named by a variable, a path or a URL, and not on a network share."""

import subprocess
import sys
from pathlib import Path

import pytest

from robolink.errors import JournalError
from robolink.journal import _places, default_location
from robolink.journal._outbox import home_of
from robolink.journal._places import place_of, without_user
from robolink.journal.store.connection import parameters_of
from tests._rows import each_row

# The place of a journal: named by a variable, a path or a URL, and shown without passwords.


@pytest.fixture(autouse=True)
def no_variables(monkeypatch):
    for name in ("ROBOLINK_JOURNAL", "ROBOLINK_STATE_DIR"):
        monkeypatch.delenv(name, raising=False)


def test_the_journal_is_in_the_user_s_data_folder(monkeypatch, tmp_path):
    monkeypatch.setattr("platformdirs.user_data_path", lambda name, appauthor: tmp_path / name)
    assert default_location() == f"sqlite:///{tmp_path}/robolink/journal.db"


def test_the_state_folder_goes_before_the_user_s_data_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    assert default_location() == f"sqlite:///{tmp_path}/journal.db"


def test_a_path_in_the_variable_goes_before_all(monkeypatch, tmp_path):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", "/elsewhere")
    monkeypatch.setenv("ROBOLINK_JOURNAL", str(tmp_path / "cell.db"))
    assert default_location() == f"sqlite:///{tmp_path}/cell.db"


def test_a_url_in_the_variable_is_taken_as_it_is(monkeypatch):
    monkeypatch.setenv("ROBOLINK_JOURNAL", "postgresql+psycopg://cells@db/journal")
    assert default_location() == "postgresql+psycopg://cells@db/journal"


@pytest.mark.parametrize("name", ["journal.db", "with blank.db", "per%20cent?#.db", "机器人.db"])
def test_a_path_and_its_url_are_the_same_place(tmp_path, name):
    path = tmp_path / name
    place = place_of(str(path))
    assert place.path == path
    assert place_of(place.location) == place
    assert place.name == str(path)


def test_a_relative_path_is_made_absolute(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert place_of("journal.db").path == tmp_path / "journal.db"
    assert place_of("sqlite:///journal.db").path == tmp_path / "journal.db"


@each_row(
    ("url", "shown"),
    [
        ("postgresql://u:geheim@db:5432/j", "postgresql+psycopg://u:***@db:5432/j"),
        ("postgresql+psycopg://u:ge@heim@db/j", "postgresql+psycopg://u:***@db/j"),
        ("postgresql://u:ge/heim@db/j", "postgresql+psycopg://u:***@db/j"),
        ("postgresql://u:geheim:@db/j", "postgresql+psycopg://u:***@db/j"),
        ("postgresql://db/j?password=geheim&x=1", "postgresql+psycopg://db/j?password=***&x=1"),
        ("postgresql://db/j?PassWord=geheim", "postgresql+psycopg://db/j?PassWord=***"),
        ("postgresql://u@db/j", "postgresql+psycopg://u@db/j"),
        ("postgresql:///j?host=/run/postgresql", "postgresql+psycopg:///j?host=/run/postgresql"),
    ],
)
def test_a_password_is_not_shown(url, shown):
    place = place_of(url)
    assert place.location == place.name == shown
    assert place.url.partition("://")[2] == url.partition("://")[2]
    assert "heim" not in repr(place)


@each_row("url", ["sqlite://", "sqlite:///", "mysql://db/j", "postgresql://", "x://"])
def test_a_database_that_cannot_keep_a_journal_is_refused(url):
    with pytest.raises(JournalError) as caught:
        place_of(url)
    assert "ROBOLINK_JOURNAL" in caught.value.remedy


def test_no_database_code_is_loaded_before_a_journal_is_opened():
    program = (
        "import sys, robolink.journal\n"
        "robolink.journal.default_location\n"
        "print([name for name in sys.modules if name.startswith(('sqlite3', 'psycopg'))])"
    )
    shown = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[2],
    )
    assert shown.stdout.strip() == "[]"


@each_row(
    ("url", "told"),
    [
        ("cells@db.plant/journal", {"user": "cells", "host": "db.plant", "dbname": "journal"}),
        (
            "u%40x:p%2F@[::1]:5433/j%20k",
            {"user": "u@x", "password": "p/", "host": "::1", "port": "5433", "dbname": "j k"},
        ),
        ("u:ge/heim@db/j", {"user": "u", "password": "ge/heim", "host": "db", "dbname": "j"}),
        ("/j?host=/run/postgresql", {"dbname": "j", "host": "/run/postgresql"}),
        ("/j?host=a:1&host=b", {"dbname": "j", "host": "a,b", "port": "1,"}),
        ("/j?host=a,b&port=1,2", {"dbname": "j", "host": "a,b", "port": "1,2"}),
        (
            "db/j?options=-c+search_path%3Dx&sslmode=require",
            {"host": "db", "dbname": "j", "options": "-c search_path=x", "sslmode": "require"},
        ),
    ],
)
def test_a_server_is_told_what_its_url_says(url, told):
    assert parameters_of(f"postgresql+psycopg://{url}") == told


# Whether a file lies on a network share, from a table of mounts.

ROOT = "27 1 254:0 / / rw,relatime - ext4 /dev/vda rw\n"


def mount(point, kind, *, optional=""):
    return f"90 27 0:50 / {point} rw,relatime {optional}- {kind} server:/export rw,vers=4.2\n"


@each_row(
    "kind",
    ["nfs", "nfs4", "cifs", "smb3", "9p", "afs", "ceph", "fuse.sshfs", "fuse.glusterfs", "vboxsf"],
)
def test_each_kind_of_share_is_known_by_its_name(kind):
    table = ROOT + mount("/srv/cells", kind, optional="shared:7 master:2 ")
    assert _places.share_in(table, "/srv/cells/5/journal.db") == kind
    assert _places.share_in(table, "/srv/cells2/journal.db") is None


@each_row("kind", ["ext4", "xfs", "btrfs", "tmpfs", "overlay", "fuseblk", "zfs"])
def test_a_file_system_of_this_computer_is_none(kind):
    assert _places.share_in(ROOT + mount("/srv", kind), "/srv/journal.db") is None


@each_row(
    ("table", "found"),
    [
        (mount("/srv", "nfs") + mount("/srv/local", "ext4"), None),
        (mount("/srv", "ext4") + mount("/srv/local", "nfs"), "nfs"),
        (mount("/srv/local", "ext4") + mount("/srv/local", "cifs"), "cifs"),  # the last one counts
        (mount("/srv/local", "cifs") + mount("/srv/local", "ext4"), None),
        # A file system mounted at / is this computer's own: a diskless PC, a container.
        (mount("/", "9p"), None),
        ("nonsense\n90 27 0:50 / /srv\n" + mount("/srv/local", "nfs"), "nfs"),
        ("", None),
    ],
)
def test_the_mount_that_holds_the_file_counts(table, found):
    assert _places.share_in(table, "/srv/local/journal.db") == found


@pytest.mark.parametrize(
    ("point", "folder"),
    [(r"/srv/line\0403\134x", "/srv/line 3\\x"), ("/srv/线\u30003\u2028", "/srv/线\u30003\u2028")],
)
def test_blanks_in_the_name_of_a_mount_are_understood(point, folder):
    assert _places.share_in(ROOT + mount(point, "cifs"), f"{folder}/journal.db") == "cifs"


@each_row(
    ("path", "kind", "found"),
    [
        (r"\\server\cells\journal.db", 0, "UNC"),
        (r"\\?\UNC\server\cells\journal.db", 0, "UNC"),
        (r"\\?\C:\cells\journal.db", 3, None),
        (r"C:\cells\journal.db", 3, None),
        (r"Z:\cells\journal.db", 4, "Z:"),
    ],
)
def test_on_windows_the_path_or_its_drive_tells(path, kind, found):
    assert _places.share_of_windows(path, lambda _: kind) == found


@each_row(
    ("location", "shared"),
    [
        ("postgresql+psycopg://owner@h:5/d?options=a@b", "postgresql+psycopg://h:5/d?options=a@b"),
        ("postgresql://cells:***@h/d", "postgresql://h/d"),
        ("postgresql+psycopg://h/d", "postgresql+psycopg://h/d"),
        ("sqlite:////a/b@c/d.db", "sqlite:////a/b@c/d.db"),
        ("/a://b@c/d.db", "/a://b@c/d.db"),
        ("", ""),
    ],
)
def test_a_journal_on_a_server_is_the_same_one_for_each_of_its_users(location, shared):
    assert without_user(location) == shared
    assert location.startswith(("/", "sqlite")) or home_of(location) == shared
