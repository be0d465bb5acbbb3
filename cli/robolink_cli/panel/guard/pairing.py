"""Tablets: which are paired with this computer, and who is logged in on one.

A tablet carries a random secret in a cookie. Of a paired one a file stands in the state folder,
named by the digest of that secret, so pairing outlives the panel, and a thief of the folder gets
no secret. A login lives in the memory of the panel, under a second secret that is drawn anew each
time: whoever planted the first one in a browser does not share the login.
"""

import hmac
import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Final

from robolink import runtime
from robolink.errors import ConfigError
from robolink.files.durable import make_folder, state_folder, sync_folder, write_whole
from robolink.messages import tr
from robolink.timing import NS_PER_S, Clock, wall_label
from robolink_cli.panel.guard.people import Pins

PIN_S: Final = 900.0
"""How long after a PIN its person may move and write, in seconds."""

_SCHEMA: Final = "robolink/panel-tablet/1"
_SECRET_BYTES: Final = 32
_MOST_LOGINS: Final = 256
_SHOWN: Final = 12


@dataclass(frozen=True, slots=True)
class LoggedIn:
    """A login.

    Attributes:
        who: The person; empty for the panel's own PIN.
        role: ``operator`` or ``engineer``, the highest of any cell; empty for the panel's own
            PIN. What the person may do at one cell, ``Access.why_not`` says.
        pin_at_ns: When the PIN was given, by the clock of the panel.
    """

    who: str
    role: str
    pin_at_ns: int


@dataclass(frozen=True, slots=True)
class Tablet:
    """A browser, as the panel knows it.

    Attributes:
        id: What it is called on record; no secret.
        address: Where it is.
        paired: Whether it may stop, and see what the panel shows.
        session: Who is logged in on it; ``None`` for nobody, an onlooker.
    """

    id: str
    address: str
    paired: bool
    session: LoggedIn | None = None

    @property
    def who(self) -> str:
        """Who is logged in, for a person to read."""
        return self.session.who if self.session else ""


@dataclass(frozen=True, slots=True)
class PairedTablet:
    """What is on record about a paired tablet.

    Attributes:
        id: Its name.
        by: Who paired it; empty for the panel's own PIN.
        at: When, as a label.
        address: Where it was then.
    """

    id: str
    by: str
    at: str
    address: str


def new_secret() -> str:
    """Return a secret for a cookie, in hexadecimal digits."""
    return runtime.random_bytes(_SECRET_BYTES).hex()


def is_secret(text: str) -> bool:
    """Return whether a cookie may be one of ours."""
    return len(text) == 2 * _SECRET_BYTES and all(digit in "0123456789abcdef" for digit in text)


def tablet_id(secret: str) -> str:
    """Return the name of the tablet with this secret."""
    return sha256(secret.encode()).hexdigest()


class PairedTablets:
    """The tablets that are paired with this computer.

    Args:
        folder: Where they are; by default in the state folder.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder or state_folder("panel") / "tablets"

    def pair(self, by: str, address: str) -> str:
        """Pair a tablet; return its new secret.

        Raises:
            OSError: It cannot be stored.
        """
        secret = new_secret()
        document = {"schema": _SCHEMA, "by": by, "at": wall_label(), "address": address}
        make_folder(self._folder)
        write_whole(self._path(tablet_id(secret)), json.dumps(document).encode())
        sync_folder(self._folder)
        return secret

    def holds(self, tablet: str) -> bool:
        """Return whether a tablet is paired now: one that was removed is not, at once."""
        return self._path(tablet).is_file()

    def all(self) -> Iterator[PairedTablet]:
        """Yield the paired tablets, the latest first."""
        found = []
        for path in self._folder.glob("*.json") if self._folder.is_dir() else ():
            try:
                document = json.loads(path.read_bytes())
                texts = [str(document[key]) for key in ("by", "at", "address")]
            except (OSError, ValueError, KeyError, TypeError, RecursionError):
                texts = ["", "", ""]
            found.append(PairedTablet(path.stem[:_SHOWN], *texts))
        yield from sorted(found, key=lambda tablet: tablet.at, reverse=True)

    def forget(self, beginning: str) -> None:
        """Remove the pairing of the tablet whose id begins so.

        Raises:
            ConfigError: There is none, or more than one.
            OSError: It cannot be removed.
        """
        paths = [
            path
            for path in (self._folder.glob("*.json") if self._folder.is_dir() else ())
            if beginning and path.stem.startswith(beginning)
        ]
        if len(paths) != 1:
            raise ConfigError(
                tr("There is no paired tablet {tablet}.", tablet=beginning)
                if not paths
                else tr("Several tablets begin with {tablet}.", tablet=beginning),
                remedy=tr("'robolink panel tablets' lists them."),
            )
        paths[0].unlink()
        sync_folder(self._folder)

    def _path(self, tablet: str) -> Path:
        return self._folder / f"{tablet}.json"


@dataclass(slots=True)
class _Login:
    session: LoggedIn
    tablet: str
    mark: str
    """Of the PIN; another one ends the login."""


@dataclass(slots=True)
class Logins:
    """Who is logged in, in the memory of this panel.

    Args:
        pins: What makes a login end when its PIN is changed.
        clock: In which the age of a PIN counts.
    """

    pins: Pins
    clock: Clock
    _open: dict[str, _Login] = field(default_factory=dict)

    def begin(self, tablet: str, who: str, role: str) -> str:
        """Log a person in; what was logged in on this tablet ends. Return the secret.

        Args:
            tablet: Id of the tablet.
            who: The person.
            role: The highest role of any cell.
        """
        self.end(tablet)
        while len(self._open) >= _MOST_LOGINS:
            del self._open[next(iter(self._open))]
        secret = new_secret()
        session = LoggedIn(who, role, self.clock.now_ns())
        self._open[tablet_id(secret)] = _Login(session, tablet, self.pins.mark(who))
        return secret

    def end(self, tablet: str) -> bool:
        """Log out whoever is logged in on a tablet; return whether somebody was."""
        found = [key for key, login in self._open.items() if login.tablet == tablet]
        for key in found:
            del self._open[key]
        return bool(found)

    def session(self, tablet: str, secret: str) -> LoggedIn | None:
        """Return the login that a tablet has by this secret."""
        key = tablet_id(secret)
        login = self._open.get(key)
        if login is None or not hmac.compare_digest(login.tablet, tablet):
            return None
        if login.mark == "" or login.mark != self.pins.mark(login.session.who):
            del self._open[key]
            return None
        return login.session

    def is_fresh(self, session: LoggedIn) -> bool:
        """Return whether its PIN is young enough to move and write."""
        return self.clock.now_ns() - session.pin_at_ns <= PIN_S * NS_PER_S
