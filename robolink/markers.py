"""Durable markers: what was begun on a controller and is not proved finished.

A marker is on disk before the command that it stands for leaves (design part 4), because a
killed process raises no exception. One JSON file per controller holds its open markers; the
file is read anew for every question, replaced as a whole, and removed with its last marker.
A file that cannot be understood blocks its controller: it may hold the one warning that
matters, so it is neither ignored nor written over.
"""

import json
import os
import re
import threading
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

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
        self._directory = _state_directory() if directory is None else directory
        self._lock = threading.Lock()
        self.path = self._directory / _file_name(identity)

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
                _make_directory(self._directory)
                _write_atomically(self.path, text.encode())
            else:
                self.path.unlink()
            _sync_directory(self._directory)
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


def _file_name(identity: str) -> str:
    from hashlib import sha256

    readable = re.sub(r"[^A-Za-z0-9.]+", "-", identity).strip("-.")[:60]
    return f"{readable or 'controller'}-{sha256(identity.encode()).hexdigest()[:16]}.json"


def _state_directory() -> Path:
    base = os.environ.get("ROBOLINK_STATE_DIR")
    if base:
        return Path(base) / "outcomes"
    from platformdirs import user_state_path

    return user_state_path("robolink", appauthor=False) / "outcomes"


def _write_atomically(path: Path, data: bytes) -> None:
    """Put ``data`` in place of the file, whole and durable, or leave the file as it was."""
    draft = path.with_name(f".{new_operation()}.new")
    try:
        descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with open(descriptor, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(descriptor)
        os.replace(draft, path)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise


def _make_directory(directory: Path) -> None:
    if not directory.is_dir():
        directory.mkdir(mode=0o700, parents=True, exist_ok=True)
        _sync_directory(directory.parent)


def _sync_directory(directory: Path) -> None:
    """Make a rename in ``directory`` durable; Windows cannot open folders and needs not."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
