"""What outlives a journal: signs that a controller was changed from here before.

A journal that was emptied, deleted or replaced knows nothing of what is unfinished, and looks
as a new one does. So the first change of each controller leaves a small file in the state
folder, and its first backup stands there too; a journal without history beside them is not one
in which nothing is unsettled.
"""

import json
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from robolink.files.durable import file_name, make_folder, state_folder, write_whole
from robolink.messages import tr
from robolink.model import Marker, MarkerKind
from robolink.timing import wall_label

_SCHEMA: Final = "robolink/known-controller/1"
_OPERATION: Final = "history"


@dataclass(frozen=True, slots=True)
class Traces:
    """Signs that a controller was changed from here before.

    Attributes:
        since: When it was changed first, as a label; empty where only the backup tells.
        journal: Where its record was then.
        backup: Its first backup, ``None`` where there is none.
    """

    since: str
    journal: str
    backup: Path | None

    def marker(self, journal: str) -> Marker:
        """Return what a person must settle who has another journal now, or an emptied one.

        Args:
            journal: Where the record is looked for now.
        """
        details: dict[str, object] = {"journal": journal, "before": self.journal}
        if self.backup is not None:
            details["backup"] = str(self.backup)
        request = tr("the record of this controller is missing")
        return Marker(_OPERATION, MarkerKind.HISTORY, request, self.since, details)


def leave_trace(identity: str, journal: str) -> None:
    """Note that a controller is changed from here; a state folder that is full is no matter."""
    path = _path(identity)
    if _is_there(path):
        return
    known = {"schema": _SCHEMA, "controller": identity, "journal": journal, "since": wall_label()}
    with suppress(OSError):
        make_folder(path.parent)
        write_whole(path, json.dumps(known).encode())


def traces_of(names: tuple[str, ...]) -> Traces | None:
    """Return the signs of a controller under any of its names, ``None`` for none."""
    backups = (state_folder("backups") / file_name(name) for name in names)
    backup = next((path for path in backups if _is_there(path)), None)
    for name in names:
        try:
            known = json.loads(_path(name).read_bytes())
            return Traces(str(known["since"]), str(known["journal"]), backup)
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            continue
    return None if backup is None else Traces("", "", backup)


def _is_there(path: Path) -> bool:
    """Tell whether a file is there; in a folder that may not be looked into nothing is."""
    try:
        return path.exists()
    except OSError:
        return False


def _path(identity: str) -> Path:
    return state_folder("controllers") / file_name(identity)
