"""Whether a file lies on a network share, from a table of mounts."""

import pytest

from robolink.journal import _places

ROOT = "27 1 254:0 / / rw,relatime - ext4 /dev/vda rw\n"


def mount(point, kind, *, optional=""):
    return f"90 27 0:50 / {point} rw,relatime {optional}- {kind} server:/export rw,vers=4.2\n"


@pytest.mark.parametrize(
    "kind",
    ["nfs", "nfs4", "cifs", "smb3", "9p", "afs", "ceph", "fuse.sshfs", "fuse.glusterfs", "vboxsf"],
)
def test_each_kind_of_share_is_known_by_its_name(kind):
    table = ROOT + mount("/srv/cells", kind, optional="shared:7 master:2 ")
    assert _places.share_in(table, "/srv/cells/5/journal.db") == kind
    assert _places.share_in(table, "/srv/cells2/journal.db") is None


@pytest.mark.parametrize("kind", ["ext4", "xfs", "btrfs", "tmpfs", "overlay", "fuseblk", "zfs"])
def test_a_file_system_of_this_computer_is_none(kind):
    assert _places.share_in(ROOT + mount("/srv", kind), "/srv/journal.db") is None


@pytest.mark.parametrize(
    ("table", "found"),
    [
        (mount("/srv", "nfs") + mount("/srv/local", "ext4"), None),
        (mount("/srv", "ext4") + mount("/srv/local", "nfs"), "nfs"),
        (mount("/srv/local", "ext4") + mount("/srv/local", "cifs"), "cifs"),  # the last one covers
        (mount("/srv/local", "cifs") + mount("/srv/local", "ext4"), None),
        # What is mounted at / is this computer's own: a diskless PC, a container.
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


@pytest.mark.parametrize(
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
