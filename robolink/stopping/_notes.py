"""The note that a stop leaves, so that nothing moves again before somebody has looked.

It stands in the state folder, is written after the frame of the stop and never before, and is
taken away by ``reset``, by ``release``, or by the person who is shown it and goes on.
"""

import json
from collections.abc import Set
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from robolink.durable_files import (
    file_name,
    make_folder,
    state_folder,
    sync_folder,
    write_whole,
)
from robolink.messages import tr
from robolink.timing import wall_label

_KIND = "stops"


@dataclass(frozen=True, slots=True)
class StopNote:
    """Who stopped a controller, and when.

    Attributes:
        url: How the controller was named.
        who: Who did it, as a person is told; empty where the note cannot be read.
        when: Wall time as a label; empty where the note cannot be read.
        confirmed: Whether the controller was seen at rest.
    """

    url: str
    who: str
    when: str
    confirmed: bool

    @property
    def sentence(self) -> str:
        """What a person is told of it."""
        if not self.when:
            return tr("This controller was stopped; the note of who did it cannot be read.")
        if not self.confirmed:
            return tr(
                "{who} told {url} to stop on {when}, and did not see it come to rest.",
                who=self.who,
                url=self.url,
                when=self.when,
            )
        return tr("{who} stopped {url} on {when}.", who=self.who, url=self.url, when=self.when)


def leave_note(keys: Set[str], url: str, who: str, *, confirmed: bool) -> None:
    """Note that a controller was stopped.

    Args:
        keys: Its far end.
        url: How it was named; without password or options.
        who: Who did it.
        confirmed: Whether it was seen at rest.

    Raises:
        OSError: It cannot be kept.
    """
    data = json.dumps({"url": url, "who": who, "when": wall_label(), "confirmed": confirmed})
    folder = state_folder(_KIND)
    make_folder(folder)
    for path in _paths(keys):
        write_whole(path, data.encode())
    sync_folder(folder)


def find_note(keys: Set[str]) -> StopNote | None:
    """Return the note about a far end; one that cannot be read is a note all the same."""
    for path in _paths(keys):
        try:
            data = path.read_bytes()
        except FileNotFoundError:
            continue
        except OSError:
            return _unreadable()
        return _note(data)
    return None


def clear_note(keys: Set[str]) -> None:
    """Take the note about a far end away.

    Raises:
        OSError: It stays.
    """
    for path in _paths(keys):
        with suppress(FileNotFoundError):
            path.unlink()


def _paths(keys: Set[str]) -> list[Path]:
    folder = state_folder(_KIND)
    return [folder / file_name(key) for key in sorted(keys)]


def _note(data: bytes) -> StopNote:
    try:
        kept = json.loads(data)
        return StopNote(
            str(kept["url"]), str(kept["who"]), str(kept["when"]), kept["confirmed"] is True
        )
    except (ValueError, TypeError, KeyError):
        return _unreadable()


def _unreadable() -> StopNote:
    return StopNote("", "", "", confirmed=False)
