"""Durable markers: what was begun on a controller and is not proved finished.

A marker is on disk before the command that it stands for leaves (design part 4), because a
killed process raises no exception. One JSON file per controller holds its open markers; the
file is read anew for every question, replaced as a whole, and removed with its last marker.
A file that cannot be understood blocks its controller: it may hold the one warning that
matters, so it is neither ignored nor written over.
"""

import json
import threading
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

from robolink.durable_files import file_name, make_folder, state_folder, sync_folder, write_whole
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Marker, MarkerKind

_SCHEMA = "robolink/outcomes/1"


def new_operation() -> str:
    """Return a unique id for a command."""
    import uuid

    return uuid.uuid4().hex


def wall_label() -> str:
    """Return the wall-clock time, ISO 8601 UTC, as a label for people."""
    from datetime import UTC, datetime

    return datetime.now(UTC).isoformat(timespec="seconds")


class MemoryOutcomeLog:
    """Markers of a far end that dies with this process, such as a simulator inside it."""

    def __init__(self) -> None:
        self._markers: dict[str, Marker] = {}

    def begin(self, marker: Marker) -> None:
        """Keep ``marker``, in place of an earlier one of the same operation."""
        self._markers[marker.operation] = marker

    def clear(self, operation: str) -> None:
        """Forget the marker; unknown ids are ignored."""
        self._markers.pop(operation, None)

    def open_markers(self) -> tuple[Marker, ...]:
        """Return what is unsettled, oldest first."""
        return tuple(self._markers.values())


_in_memory: dict[str, MemoryOutcomeLog] = {}


def memory_log(identity: str) -> MemoryOutcomeLog:
    """Return the log that all connections of this process to one far end share."""
    return _in_memory.setdefault(identity, MemoryOutcomeLog())


class FileOutcomeLog:
    """Markers of one controller in one file.

    Two processes do not write it at once: the controller serves one logged-in client
    (epson.md 1.1), and only such a client begins or clears markers.

    Args:
        identity: Which controller; any text.
        directory: Where the file stands; by default ``outcomes`` in ROBOLINK_STATE_DIR or,
            without that, in the user's state folder for robolink.
    """

    def __init__(self, identity: str, directory: Path | None = None) -> None:
        self._identity = identity
        self._directory = state_folder("outcomes") if directory is None else directory
        self._lock = threading.Lock()
        self.path = self._directory / file_name(identity)

    def begin(self, marker: Marker) -> None:
        """Store ``marker``, in place of an earlier one of the same operation.

        Raises:
            ConfigError: It cannot be stored; the command must not be sent.
        """
        with self._lock:
            markers = {known.operation: known for known in self._read()}
            markers[marker.operation] = marker
            self._replace(markers.values())

    def clear(self, operation: str) -> None:
        """Forget the marker; unknown ids are ignored.

        Raises:
            ConfigError: The file cannot be changed; the marker stays.
        """
        with self._lock:
            markers = self._read()
            left = [marker for marker in markers if marker.operation != operation]
            if len(left) != len(markers):
                self._replace(left)

    def open_markers(self) -> tuple[Marker, ...]:
        """Return what is unsettled, oldest first.

        Raises:
            ConfigError: The file cannot be read or understood.
        """
        with self._lock:
            return self._read()

    def _read(self) -> tuple[Marker, ...]:
        try:
            text = self.path.read_text(encoding="utf-8")
        except FileNotFoundError:
            return ()
        except (OSError, UnicodeError) as error:
            raise self._unreadable(str(error)) from error
        try:
            return self._parse(json.loads(text))
        except ConfigError:
            raise
        except (ValueError, TypeError, KeyError, RecursionError) as error:
            raise self._unreadable(tr("it is damaged")) from error

    def _parse(self, document: dict[str, object]) -> tuple[Marker, ...]:
        if document["schema"] != _SCHEMA:
            raise self._unreadable(
                tr("its form is {schema!r}, not {own!r}", schema=document["schema"], own=_SCHEMA)
            )
        if document["controller"] != self._identity:
            raise self._unreadable(tr("it is about {other!r}", other=document["controller"]))
        entries = document["markers"]
        if not isinstance(entries, list):
            raise TypeError
        return tuple(_marker(entry) for entry in entries)

    def _replace(self, markers: Iterable[Marker]) -> None:
        entries = [asdict(marker) for marker in markers]
        document = {"schema": _SCHEMA, "controller": self._identity, "markers": entries}
        text = json.dumps(document, indent=1, allow_nan=False)
        try:
            if entries:
                make_folder(self._directory)
                write_whole(self.path, text.encode())
            else:
                self.path.unlink()
            sync_folder(self._directory)
        except OSError as error:
            raise ConfigError(
                tr(
                    "The safety record {path} cannot be written: {cause}.",
                    path=self.path,
                    cause=error,
                ),
                remedy=tr(
                    "Free space there or make the folder writable; ROBOLINK_STATE_DIR names "
                    "another folder. Without this record nothing is sent that could move or "
                    "change the robot."
                ),
                controller=self._identity,
            ) from error

    def _unreadable(self, cause: str) -> ConfigError:
        return ConfigError(
            tr("The safety record {path} cannot be read: {cause}.", path=self.path, cause=cause),
            remedy=tr(
                "It says what was left unfinished on {identity}. Check the robot's selected tool "
                "and its tool offsets by hand, then move this file away.",
                identity=self._identity,
            ),
            controller=self._identity,
        )


def _marker(entry: dict[str, object]) -> Marker:
    operation, request, begun_at, details = (
        entry[name] for name in ("operation", "request", "begun_at", "details")
    )
    texts_are_texts = all(isinstance(text, str) for text in (operation, request, begun_at))
    if not texts_are_texts or not isinstance(details, dict):
        raise TypeError
    return Marker(
        str(operation), MarkerKind(str(entry["kind"])), str(request), str(begun_at), details
    )
