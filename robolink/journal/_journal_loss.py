"""Signs outside a journal that a controller was changed from here before.

A journal that was emptied, deleted or replaced knows nothing of what is unfinished, and looks
as a new one does; so does an older one that is named again. So the first change of each controller
leaves a small file in the state folder, which says where its record is kept and which entry was the
newest then, and its first backup stands there too. A journal without history beside them, or one
without that entry, is not one in which nothing is unsettled.
"""

import json
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from robolink.files.durable import file_name, make_folder, state_folder, write_whole
from robolink.journal._places import without_user
from robolink.messages import tr
from robolink.model import Marker, MarkerKind
from robolink.timing import wall_label

_SCHEMA: Final = "robolink/known-controller/1"

LOST: Final = "history"
"""Operation of the marker that stands for a missing record."""


@dataclass(frozen=True, slots=True)
class Traces:
    """Signs that a controller was changed from here before.

    Attributes:
        since: When it was changed first, as a label; empty where only the backup tells.
        journal: Where its record is kept; empty where only the backup tells.
        newest: Number and hash of the newest entry there when that was noted, ``None`` where it was
            not.
        backup: Its first backup, ``None`` where there is none.
    """

    since: str
    journal: str
    newest: tuple[int, str] | None
    backup: Path | None

    def marker(self, journal: str) -> Marker:
        """Return what a person must recover who has another journal now, or an emptied one.

        Args:
            journal: Where the record is looked for now.
        """
        details: dict[str, object] = {"journal": journal, "before": self.journal}
        if self.backup is not None:
            details["backup"] = str(self.backup)
        request = tr("the record of this controller is missing")
        return Marker(LOST, MarkerKind.HISTORY, request, self.since, details)


def leave_trace(identity: str, journal: str, newest: tuple[int, str] | None) -> None:
    """Note that a controller is changed from here, and where that is recorded.

    Args:
        identity: Which controller.
        journal: Where its record is kept from now on.
        newest: Number and hash of the newest entry there.

    Raises:
        OSError: It cannot be noted.
    """
    path = _path(identity)
    before = _noted(identity)
    if before is not None and without_user(before.journal) == without_user(journal):
        return
    known = {
        "schema": _SCHEMA,
        "controller": identity,
        "journal": journal,
        "since": before.since if before is not None else wall_label(),
        "newest": newest,
    }
    make_folder(path.parent)
    write_whole(path, json.dumps(known).encode())


def carry_traces(
    identities: Iterable[str], before: str, journal: str, newest: tuple[int, str] | None
) -> None:
    """Note where a record was moved, for the controllers whose record was where it was moved from.

    Args:
        identities: Of the controllers.
        before: Where the record was kept.
        journal: Where it is kept now.
        newest: Number and hash of the newest entry there.
    """
    for identity in identities:
        noted = _noted(identity)
        if noted is not None and without_user(noted.journal) == without_user(before):
            with suppress(OSError):  # a record that was moved is found to go on all the same
                leave_trace(identity, journal, newest)


def traces_of(names: tuple[str, ...]) -> Traces | None:
    """Return the signs of a controller under any of its names, ``None`` for none."""
    backups = (state_folder("backups") / file_name(name) for name in names)
    backup = next((path for path in backups if _is_there(path)), None)
    noted = next(filter(None, map(_noted, names)), None)
    if noted is not None:
        return replace(noted, backup=backup)
    return None if backup is None else Traces("", "", None, backup)


def _noted(name: str) -> Traces | None:
    """Return what was noted of a controller under one name; what is unreadable is ignored."""
    try:
        known = json.loads(_path(name).read_bytes())
        newest = known.get("newest")
        entry = None if newest is None else (int(newest[0]), str(newest[1]))
        return Traces(str(known["since"]), str(known["journal"]), entry, None)
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return None


def _is_there(path: Path) -> bool:
    """Return whether a file is there; in a folder without access nothing is."""
    try:
        return path.exists()
    except OSError:
        return False


def _path(identity: str) -> Path:
    return state_folder("controllers") / file_name(identity)
