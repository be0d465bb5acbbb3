"""Tokens of line computers: what one may ask for, and until when.

A token is drawn at random and shown once. On disk stands its SHA-256 alone, in a file of the state
folder that is named by it: 256 random bits need no slow hash, and a lookup compares no secret. What
is removed there counts no more at once, also on a panel that runs.
"""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from hashlib import sha256
from pathlib import Path
from typing import Final

from robolink import runtime
from robolink.config import GROUP_MARK
from robolink.errors import ConfigError
from robolink.files.durable import make_folder, state_folder, sync_folder, write_whole
from robolink.fleet import PlanKind
from robolink.messages import known_names, tr
from robolink.model import Secret
from robolink.timing import wall_label

_SCHEMA: Final = "robolink/line-token/1"
_MARK: Final = "rlt_"
"""What a token begins with, so that a search for lost secrets finds it."""

_FORM: Final = re.compile(rf"{_MARK}[0-9a-f]{{64}}")
_TIME: Final = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\+00:00")
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,39}")


@dataclass(frozen=True, slots=True)
class LineToken:
    """A line computer, and what it may ask for.

    Attributes:
        name: What it is called.
        kinds: The kinds of jobs.
        cells: Names, patterns, and groups such as ``@line3``.
        until: When it ends, as a label: ISO 8601, UTC.
        plant: The plant whose agent carries its jobs out.
        by: Who made it.
        at: When.
        permit: The group of permits that its jobs wait for; empty for none, and then only a permit
            without a group lets them begin.
    """

    name: str
    kinds: tuple[str, ...]
    cells: tuple[str, ...]
    until: str
    plant: str
    by: str
    at: str
    permit: str = ""

    def ended(self) -> bool:
        """Return whether its time is over."""
        return wall_label() >= self.until

    def allows(self, cell: str, groups: Mapping[str, Sequence[str]]) -> bool:
        """Return whether it may ask for something at a cell.

        Args:
            cell: Name of the cell.
            groups: The words of each group of the cell files.
        """
        words: list[str] = []
        for word in self.cells:
            words += groups.get(word[1:], ()) if word.startswith(GROUP_MARK) else (word,)
        return any(word == cell or fnmatchcase(cell, word) for word in words)


class LineTokens:
    """The tokens of this computer.

    Args:
        folder: Where they are; by default in the state folder.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder or state_folder("panel") / "line-tokens"

    def give(self, token: LineToken, *, replace: bool = False) -> Secret:
        """Keep a token; return its secret, which is nowhere else.

        Args:
            token: What it may ask for.
            replace: Whether the former ones of this name end with that.

        Raises:
            ConfigError: It has no name, one of this name is there, or it cannot be stored.
        """
        if not _NAME.fullmatch(token.name):
            raise ConfigError(
                tr("{name!r} cannot be the name of a line computer.", name=token.name[:60]),
                remedy=tr("Give letters, digits, '.', '_' and '-', 40 at most."),
            )
        before = [path for path, one in self._files() if one.name == token.name]
        if before and not replace:
            raise ConfigError(
                tr("{name} has a token already.", name=token.name),
                remedy=tr("Nothing was changed. A new one in its place: --replace"),
            )
        secret = _MARK + runtime.random_bytes(32).hex()
        document = {
            "schema": _SCHEMA,
            "name": token.name,
            "kinds": list(token.kinds),
            "cells": list(token.cells),
            "until": token.until,
            "plant": token.plant,
            "by": token.by,
            "at": token.at,
            "permit": token.permit,
        }
        try:
            make_folder(self._folder)
            write_whole(self._path(secret), json.dumps(document).encode())
            for path in before:
                path.unlink(missing_ok=True)
            sync_folder(self._folder)
        except OSError as error:
            raise ConfigError(
                tr("{path} cannot be written: {cause}.", path=self._folder, cause=error),
                remedy=tr("Use no token that was shown. List them: robolink panel token list"),
            ) from error
        return Secret(secret)

    def revoke(self, name: str) -> None:
        """End a token now.

        Raises:
            ConfigError: There is none of that name, or it cannot be removed.
        """
        found = [path for path, one in self._files() if one.name == name]
        if not found:
            names = [one.name for one in self.all()]
            raise ConfigError(
                tr("No line computer {name!r} has a token here.", name=name),
                remedy=known_names(names, name) if names else tr("There are no tokens here."),
            )
        try:
            for path in found:
                path.unlink(missing_ok=True)
            sync_folder(self._folder)
        except OSError as error:
            raise ConfigError(
                tr("{path} cannot be written: {cause}.", path=self._folder, cause=error),
                remedy=tr("The token may still count. Remove its file, then list them."),
            ) from error

    def all(self) -> tuple[LineToken, ...]:
        """Return the tokens, by name."""
        return tuple(sorted((one for _, one in self._files()), key=lambda one: one.name))

    def of(self, secret: str) -> LineToken | None:
        """Return the token of a secret; ``None`` for what is none."""
        return _read(self._path(secret)) if _FORM.fullmatch(secret) else None

    def _files(self) -> Iterator[tuple[Path, LineToken]]:
        for path in sorted(self._folder.glob("*.json")) if self._folder.is_dir() else ():
            if (token := _read(path)) is not None:
                yield path, token

    def _path(self, secret: str) -> Path:
        return self._folder / f"{sha256(secret.encode()).hexdigest()}.json"


def _read(path: Path) -> LineToken | None:
    """Return the token of a file; a file that cannot be read is none."""
    try:
        said = json.loads(path.read_bytes())
        if said["schema"] != _SCHEMA:
            return None
        kinds = tuple(str(PlanKind(kind)) for kind in said["kinds"])
        cells = tuple(map(str, said["cells"]))
        said = {"permit": "", **said}  # none of an older robolink has one
        texts = (str(said[key]) for key in ("until", "plant", "by", "at", "permit"))
        token = LineToken(str(said["name"]), kinds, cells, *texts)
        # Times are compared as texts: what is no time must not count for ever.
        return token if _TIME.fullmatch(token.until) else None
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
