"""The note that a stop leaves, so that nothing moves before somebody has looked.

It stands in the state folder, is written after the frame of the stop and never before, and is
taken away by ``reset``, by ``release``, or by the person who is shown it and goes on.

It hangs on the controller: on its own name where it said that, so that it is found by whatever
address the next one comes, and on the far end of the URL besides. A note of another controller
that answered at the same address before is none of this one.
"""

import json
from collections.abc import Iterable, Set
from dataclasses import asdict, dataclass
from pathlib import Path

from robolink.files.durable import (
    file_name,
    make_folder,
    state_folder,
    sync_folder,
    write_whole,
)
from robolink.messages import tr
from robolink.timing import local_label, wall_label

_KIND = "stops"


@dataclass(frozen=True, slots=True)
class StopNote:
    """Who stopped a controller, and when.

    Attributes:
        url: How the controller was named.
        who: Who did it, as a person is told; empty where the note cannot be read.
        when: Wall time as a label; empty where the note cannot be read.
        confirmed: Whether the controller was seen at rest.
        controller: Which one it is, as it said itself after it was stopped; empty where nobody
            could ask.
        keys: Under which keys the note was left.
    """

    url: str
    who: str
    when: str
    confirmed: bool
    controller: str = ""
    keys: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """What a person is told about it."""
        if not self.when:
            return tr("This controller was stopped; the record of who did it cannot be read.")
        if not self.confirmed:
            return tr(
                "{who} stopped {url} on {when}; it was not confirmed that the robot stopped.",
                who=self.who,
                url=self.url,
                when=local_label(self.when),
            )
        return tr(
            "{who} stopped {url} on {when}.",
            who=self.who,
            url=self.url,
            when=local_label(self.when),
        )

    def is_about(self, name: str) -> bool:
        """Return whether it may be about the controller ``name``; true if in doubt."""
        return not (name and self.controller) or name == self.controller


def leave_note(
    keys: Set[str],
    url: str,
    who: str,
    *,
    confirmed: bool,
    controller: str = "",
    last_known: str = "",
) -> None:
    """Note that a controller was stopped.

    Args:
        keys: Its far end.
        url: How it was named; without password or options.
        who: Who did it.
        confirmed: Whether it was seen at rest.
        controller: Its own name, if it said that after it was stopped.
        last_known: The name of who was met there last, where it could not be asked.

    Raises:
        OSError: It cannot be kept.

    Example:
        >>> from robolink.stopping import find_note, leave_note
        >>> keys, url = {"192.168.0.1:5000"}, "epson+tcp://192.168.0.1:5000"
        >>> leave_note(keys, url, "mei", confirmed=True)
        >>> find_note(keys).who
        'mei'
    """
    all_keys = sorted({*keys, *filter(None, (controller, last_known))})
    note = StopNote(url, who, wall_label(), confirmed, controller, tuple(all_keys))
    data = json.dumps(asdict(note)).encode()
    folder = state_folder(_KIND)
    make_folder(folder)
    for path in _paths(all_keys):
        write_whole(path, data)
    sync_folder(folder)


def find_note(keys: Set[str], name: str = "") -> StopNote | None:
    """Return the note about a controller; an unreadable one still counts.

    Args:
        keys: Its far end.
        name: Its own name, where that is known.
    """
    for path in _paths(_with_name(keys, name)):
        data = _content(path)
        if data is not None and (found := _note(data)).is_about(name):
            return found
    return None


def clear_note(keys: Set[str], name: str = "") -> None:
    """Remove the notes about a controller, under whatever keys they were left.

    Args:
        keys: Its far end.
        name: Its own name, where that is known.

    Raises:
        OSError: One stays.
    """
    for path in _paths(_with_name(keys, name)):
        data = _content(path)
        if data is None or not (found := _note(data)).is_about(name):
            continue
        for other in (*_paths(found.keys), path):
            # Another key may hold the note of a later stop, of another controller.
            if other == path or _content(other) == data:
                other.unlink(missing_ok=True)


def _with_name(keys: Set[str], name: str) -> list[str]:
    return sorted({*keys, *([name] if name else [])})


def _paths(keys: Iterable[str]) -> list[Path]:
    folder = state_folder(_KIND)
    return [folder / file_name(key) for key in keys]


def _content(path: Path) -> bytes | None:
    """Return a note's content, nothing for an unreadable one, ``None`` without one."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError:
        return b""


def _note(data: bytes) -> StopNote:
    try:
        kept = json.loads(data)
        return StopNote(
            str(kept["url"]),
            str(kept["who"]),
            str(kept["when"]),
            kept["confirmed"] is True,
            str(kept.get("controller", "")),
            tuple(map(str, kept.get("keys", ()))),
        )
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return StopNote("", "", "", confirmed=False)
