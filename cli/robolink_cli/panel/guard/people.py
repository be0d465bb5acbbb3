"""PINs of the people who may command from a page, and how often a wrong one may be tried.

Both are files of the state folder, so they outlive the panel and hold for every panel of this
computer. A PIN is kept as scrypt makes it (RFC 7914), never as it was typed.
"""

import hashlib
import hmac
import json
import os
import re
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Final

from robolink import runtime
from robolink.errors import ConfigError
from robolink.files.durable import file_name, make_folder, state_folder, sync_folder, write_whole
from robolink.messages import tr
from robolink.model import Secret
from robolink_cli.panel.guard.connections import network_of

NOBODY: Final = ""
"""Whose PIN counts at cells that name no people: the panel's own."""

FREE_TRIES: Final = 5
"""Number of wrong PINs, one after the other, before the first pause."""

FIRST_PAUSE_S: Final = 60.0
LONGEST_PAUSE_S: Final = 3600.0
"""Pauses double from the first to the longest."""

FORGIVEN_S: Final = 86_400.0
"""After so long without a try, wrong PINs are forgotten."""

_PIN: Final = re.compile(r"[0-9]{6,12}")
_SCHEMA: Final = "robolink/panel-pin/1"
COST: Final = 1 << 14
"""N of scrypt for a new PIN, with r = 8 and p = 1: 16 MB, and about 50 ms."""

_MOST_COST: Final = 1 << 17
_MOST_ADDRESSES: Final = 1000


@dataclass(frozen=True, slots=True)
class _Kept:
    """A PIN as it is stored."""

    salt: bytes
    made: bytes
    cost: int


class Pins:
    """The PINs of this computer.

    Args:
        folder: Where they are; by default in the state folder.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder or state_folder("panel") / "pins"
        self._nobodys = _Kept(runtime.random_bytes(16), runtime.random_bytes(32), COST)

    def set(self, name: str, pin: Secret) -> None:
        """Store a PIN; what was logged in with the former one is logged out.

        Args:
            name: Whose; :data:`NOBODY` for the panel's own.
            pin: The digits.

        Raises:
            ConfigError: It is no PIN, too easy to guess, or cannot be stored.
        """
        require_pin(pin)
        salt = runtime.random_bytes(16)
        made = _made(pin.reveal(), salt, COST).hex()
        document = {"schema": _SCHEMA, "name": name, "n": COST, "salt": salt.hex(), "made": made}
        path = self._path(name)
        try:
            make_folder(path.parent)
            write_whole(path, json.dumps(document).encode())
            sync_folder(path.parent)
        except OSError as error:
            raise ConfigError(
                tr("{path} cannot be written: {cause}.", path=path, cause=error.strerror or error),
                remedy=tr("The PIN was not set."),
            ) from error

    def remove(self, name: str) -> bool:
        """Remove a PIN; return whether there was one.

        Raises:
            OSError: It cannot be removed.
        """
        try:
            self._path(name).unlink()
        except FileNotFoundError:
            return False
        return True

    def mark(self, name: str) -> str:
        """Return what changes with every new PIN of this person; empty where there is none.

        A file that cannot be read is no PIN: nobody gets in by it.
        """
        kept = self._kept(name)
        return "" if kept is None else kept.salt.hex()

    def matches(self, name: str, pin: str) -> bool:
        """Return whether this is the person's PIN; takes as long for a person without one.

        It blocks for about 50 ms, without the interpreter's lock.
        """
        kept = self._kept(name)
        there = kept or self._nobodys
        typed = pin if _PIN.fullmatch(pin) else "-"
        right = hmac.compare_digest(_made(typed, there.salt, there.cost), there.made)
        return right and kept is not None

    def _path(self, name: str) -> Path:
        return self._folder / file_name(f"pin of {name}" if name else "pin")

    def _kept(self, name: str) -> _Kept | None:
        try:
            document = json.loads(self._path(name).read_bytes())
            cost = int(document["n"])
            if document["schema"] != _SCHEMA or document["name"] != name or cost > _MOST_COST:
                return None
            return _Kept(bytes.fromhex(document["salt"]), bytes.fromhex(document["made"]), cost)
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None


def require_pin(pin: Secret) -> None:
    """Refuse what is no PIN, or one of those that are tried first.

    Raises:
        ConfigError: It is.
    """
    digits = pin.reveal()
    if not _PIN.fullmatch(digits):
        raise ConfigError(
            tr("A PIN has 6 to 12 digits, and nothing else."),
            remedy=tr("The PIN was not set."),
        )
    steps = {(int(after) - int(before)) % 10 for before, after in pairwise(digits)}
    if len(steps) == 1 and steps <= {0, 1, 9}:
        raise ConfigError(
            tr("This PIN is among the first that anybody tries."),
            remedy=tr("The PIN was not set. Choose digits that are no series."),
        )


@dataclass(slots=True)
class Tries:
    """Wrong PINs, counted for each name and for each address, also over a restart.

    A try is a line in a file. It is there, durably, before the PIN is looked at, so a panel that is
    killed in between gives nobody another try. Lines are appended: two panels of one computer
    lose none of each other's.

    Args:
        folder: Where they are; by default in the state folder.
    """

    folder: Path = field(default_factory=lambda: state_folder("panel") / "tries")

    def pause_s(self, *keys: str) -> float:
        """Return how many seconds remain before the next try; 0 where it may be now."""
        return max((self._pause_s(key) for key in keys), default=0.0)

    def count(self, *keys: str) -> None:
        """Count a try, before anybody knows how it ends.

        Raises:
            OSError: It cannot be stored; then the PIN must not be looked at.
        """
        make_folder(self.folder)
        self._make_room()
        for key in keys:
            new = not self._path(key).exists()
            flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT
            descriptor = os.open(self._path(key), flags, 0o600)
            try:
                os.write(descriptor, f"{runtime.wall_s():.0f}\n".encode())
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
            if new:
                sync_folder(self.folder)

    def forgive(self, *keys: str) -> None:
        """Forget wrong PINs: the right one came."""
        for key in keys:
            with suppress(OSError):
                self._path(key).unlink(missing_ok=True)

    def _pause_s(self, key: str) -> float:
        try:
            lines = self._path(key).read_bytes().splitlines()
        except FileNotFoundError:
            return 0.0
        except OSError:
            return FIRST_PAUSE_S  # what cannot be counted is not allowed
        beyond = len(lines) - FREE_TRIES
        last = float(lines[-1]) if lines and lines[-1].isdigit() else runtime.wall_s()
        # A clock that was set back prolongs no pause beyond its length.
        since_s = max(0.0, runtime.wall_s() - last)
        if since_s > FORGIVEN_S:
            self.forgive(key)
            return 0.0
        if beyond < 0:
            return 0.0
        return max(0.0, min(FIRST_PAUSE_S * 2.0 ** min(beyond, 10), LONGEST_PAUSE_S) - since_s)

    def _make_room(self) -> None:
        """Forget the longest silent of too many, so that no sender of addresses fills the disk."""
        files = list(self.folder.iterdir())
        if len(files) < _MOST_ADDRESSES:
            return
        ages = []
        for path in files:
            with suppress(OSError):
                ages.append((path.stat().st_mtime, path))
        for _, path in sorted(ages)[: len(ages) // 2]:
            with suppress(OSError):
                path.unlink()

    def _path(self, key: str) -> Path:
        return self.folder / file_name(key)


def name_key(name: str, *, outside: bool = False) -> str:
    """Return the key of a person for :class:`Tries`.

    Args:
        name: The person.
        outside: Whether it is tried on a tablet that is not paired.
    """
    return f"name {name}, outside" if outside else f"name {name}"


def address_key(address: str) -> str:
    """Return the key of an address for :class:`Tries`; of IPv6, that of its network."""
    return f"address {network_of(address)}"


def _made(pin: str, salt: bytes, cost: int) -> bytes:
    return hashlib.scrypt(
        pin.encode(), salt=salt, n=cost, r=8, p=1, maxmem=2048 * cost + (1 << 20), dklen=32
    )
