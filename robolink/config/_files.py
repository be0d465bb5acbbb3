"""Which cell files there are, and how one is read."""

import os
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Final

from robolink.files.toml import FileKind
from robolink.messages import tr

_NAME = "robolink.toml"


class Source(StrEnum):
    """Why a file is read; in the order of precedence."""

    NAMED = "named"
    FOLDER = "folder"
    USER = "user"
    SITE = "site"


@dataclass(frozen=True, slots=True)
class ConfigFile:
    """A place where a cell file may be."""

    source: Source
    path: Path

    @property
    def present(self) -> bool:
        """Whether to read it: it exists, or a person named it."""
        return self.source is Source.NAMED or self.path.is_file()


def config_files() -> tuple[ConfigFile, ...]:
    """Return the places searched, the one with precedence first.

    The file that ROBOLINK_CONFIG names, ``robolink.toml`` in the working folder, the user's,
    the site's (docs/cell-files.md, "Where they are").
    """
    from platformdirs import site_config_path, user_config_path

    files = [
        ConfigFile(Source.FOLDER, Path.cwd() / _NAME),
        ConfigFile(Source.USER, user_config_path("robolink", appauthor=False) / _NAME),
        ConfigFile(Source.SITE, site_config_path("robolink", appauthor=False) / _NAME),
    ]
    named = os.environ.get("ROBOLINK_CONFIG")
    if named:
        files.insert(0, ConfigFile(Source.NAMED, Path(named).expanduser().absolute()))
    return tuple(files)


CELL_FILE: Final = FileKind(
    named=lambda path: tr("The cell file {path}", path=path),
    unreadable_remedy=lambda: tr("'robolink cell files' shows the files that robolink reads."),
    wrong_remedy=lambda: tr("Nothing was sent. Correct it, then run 'robolink cell validate'."),
)


def whole_place(place: str, file: Path) -> str:
    """Return a path that a file names, seen from that file, as seen from everywhere; a URL as is.

    Args:
        place: What the file names.
        file: The file.
    """
    return place if "://" in place else str(file.parent / Path(place).expanduser())


def read_document(path: Path) -> dict[str, object]:
    """Return the content of a cell file.

    Raises:
        ConfigError: It cannot be read, or is no TOML.
    """
    return CELL_FILE.parse(path, CELL_FILE.read(path))
