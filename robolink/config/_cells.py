"""From the cell files to one cell, with the source of each of its values."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from robolink.config._files import CELL_FILE, config_files, read_document, whole_place
from robolink.config._reach import OPCUA_KEYS, Expected, address_with
from robolink.config._selection import GROUP_MARK, names_meant, unknown_cell
from robolink.errors import ConfigError
from robolink.files.key_problems import is_not_known, sentence
from robolink.files.toml import Problem
from robolink.journal import CellHome
from robolink.messages import tr
from robolink.model import ChangeLimits

if TYPE_CHECKING:
    from pydantic import ValidationError

    from robolink.config._settings import CellFile, CellSettings

_BARE_KEY = re.compile("[A-Za-z0-9_-]+")
_KIND = 4
"""Index of a station's kind in a path: cells, NAME, stations, ID, kind."""

_SECRET = re.compile("pass|pwd|secret|token|credential|^pin$", re.IGNORECASE)


def dotted(keys: Iterable[object]) -> str:
    """Return the path of a key as TOML writes it."""
    texts = (str(key) for key in keys)
    return ".".join(
        text if _BARE_KEY.fullmatch(text) else json.dumps(text, ensure_ascii=False)
        for text in texts
    )


def problems_of(
    error: "ValidationError",
    known: Mapping[int, Sequence[str]],
    kinds: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> list[Problem]:
    """Return everything that pydantic reports.

    Args:
        error: What it raised.
        known: The keys that are known at each depth, for a better guess at what was meant.
        kinds: The same for stations, by their kind.
    """
    details = error.errors(include_url=False, include_input=False)
    problems = []
    for detail in details:
        path, names = list(detail["loc"]), known.get(len(detail["loc"]), ())
        # After the name of a station, pydantic inserts its kind, which is in no file.
        if len(path) > _KIND and path[2] == "stations":
            names = kinds.get(str(path.pop(_KIND)), ())
        counted = [part + 1 if isinstance(part, int) else part for part in path]
        problems.append(Problem(dotted(counted), _sentence(detail, names, kinds)))
    return problems


def _sentence(
    detail: Any,  # noqa: ANN401 - pydantic's own form
    known: Sequence[str],
    kinds: Iterable[str],
) -> str:
    match detail["type"]:
        case "extra_forbidden":
            return _unknown(str(detail["loc"][-1]), known)
        case "union_tag_invalid" | "union_tag_not_found":
            return tr("needs a kind: {kinds}", kinds=", ".join(kinds))
        case "string_pattern_mismatch":
            return tr("must be the name of a variable that begins with ROBOLINK_PASSWORD")
    return sentence(detail)


def _unknown(key: str, known: Sequence[str]) -> str:
    if _SECRET.search(key):
        return tr(
            "looks like a password, which a cell file must not contain; name a "
            "password_file that only you can read, or a password_env"
        )
    return is_not_known(key, known)


_CELL_NAME = re.compile(r"[^\s+:/\\]+")


USUAL_CHANGE_MM: Final = 2.0
"""Default limit of a cell, in mm: more than a nozzle change explains."""


USUAL_CHECKS_DAYS: Final = 90
"""For how many days checks are kept where no cell file says it."""


class CellGlimpse(NamedTuple):
    """What the files say about a cell, unchecked.

    Attributes:
        url: The controller's URL; empty where none is said.
        stations: Ids of the stations that are declared.
    """

    url: str
    stations: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Cell:
    """One cell, as all files together describe it.

    Attributes:
        name: What ``-c`` calls it.
        url: The controller's URL, with the options that are keys of their own in a file.
        settings: Everything that is said about it.
        origins: For each key that is said, the file that said it.
    """

    name: str
    url: str
    settings: "CellSettings"
    origins: Mapping[str, Path] = field(hash=False)

    @property
    def expected(self) -> Expected:
        """What even a read-only look has to obey."""
        return Expected(
            self.name,
            tool=self.settings.tool,
            robot=self.settings.robot,
            robot_file=str(self.origins.get("robot", "")),
            people=self.settings.people,
        )

    @property
    def home(self) -> CellHome:
        """The computer where alone it is changed; without a name, whichever this is."""
        return CellHome(self.name, self.settings.home or "")

    def limits(self, *, usual_mm: float = USUAL_CHANGE_MM) -> ChangeLimits:
        """Return how far a write may move a tip; more takes an engineer.

        Args:
            usual_mm: What holds where the cell names no limit of its own.
        """
        settings = self.settings
        length_mm = usual_mm if settings.max_change_mm is None else settings.max_change_mm
        return ChangeLimits(length_mm, settings.max_change_deg)


def find_cell(name: str) -> Cell:
    """Return the cell called ``name``.

    Raises:
        ConfigError: There is none, or a file is wrong.
    """
    cells = load_cells()
    if name not in cells:
        raise unknown_cell(name, cells)
    return cells[name]


@dataclass(frozen=True, slots=True)
class CellFiles:
    """What all cell files say together.

    Attributes:
        cells: Every cell by name, those of the file with precedence first.
        groups: The names and patterns of each group of cells.
        keep_checks_days: For how many days checks are kept.
        journal: Where the journal is of cells that name none of their own; empty where no file
            says it.
    """

    cells: Mapping[str, Cell] = field(hash=False)
    groups: Mapping[str, tuple[str, ...]] = field(hash=False)
    keep_checks_days: int = USUAL_CHECKS_DAYS
    journal: str = ""

    @property
    def homes(self) -> dict[str, str]:
        """The home of each cell that names one."""
        named = {name: cell.home.computer for name, cell in self.cells.items()}
        return {name: home for name, home in named.items() if home}

    def select(self, words: Iterable[str] = ()) -> tuple[Cell, ...]:
        """Return the cells that words name; see :func:`select_cells`.

        Raises:
            ConfigError: A word names no cell.
        """
        chosen = tuple(words)
        names = names_meant(chosen, tuple(self.cells), self.groups) if chosen else self.cells
        return tuple(self.cells[name] for name in names)


def load_cells() -> dict[str, Cell]:
    """Return all cells of all files, those of the file with precedence first.

    A file adds to what farther ones say about a cell, and wins where both say something. One
    that gives a URL starts the cell anew: limits and confirmations were given for the robot
    at the other address.

    Raises:
        ConfigError: A file is wrong, or a cell has no URL in any of them.
    """
    return dict(load_cell_files().cells)


def load_cell_files() -> CellFiles:
    """Return what all cell files say; see :func:`load_cells`. Of two groups the nearer one counts.

    Raises:
        ConfigError: A file is wrong, or a cell has no URL in any of them.
    """
    said: dict[str, list[tuple[Path, CellSettings]]] = {}
    groups: dict[str, tuple[str, ...]] = {}
    keep_days: int | None = None
    journal: tuple[str, Path] | None = None
    home: tuple[str, Path] | None = None
    for file in config_files():
        if file.present:
            content = _checked(file.path)
            groups = dict(content.groups) | groups
            keep_days = content.keep_checks_days if keep_days is None else keep_days
            if journal is None and content.journal is not None:
                journal = whole_place(content.journal, file.path), file.path
            if home is None and content.home is not None:
                home = content.home, file.path
            for name, settings in content.cells.items():
                known = said.setdefault(name, [])
                if not known or known[-1][1].url is None:
                    known.append((file.path, settings))
    otherwise = {"journal": journal, "home": home}
    cells = {name: _cell(name, parts, otherwise) for name, parts in said.items()}
    days = USUAL_CHECKS_DAYS if keep_days is None else keep_days
    return CellFiles(cells, groups, days, journal[0] if journal else "")


def select_cells(words: Iterable[str] = ()) -> tuple[Cell, ...]:
    """Return the cells that words name, each once, in the order of the words.

    What one pattern names comes in the order of the cell files.

    Args:
        words: Names, patterns and ``@GROUP``; none for all cells.

    Raises:
        ConfigError: A word names no cell, or a cell file is wrong.

    Example:
        >>> from pathlib import Path
        >>> from robolink.config import add_cell, select_cells
        >>> for name in ("line3-1", "line3-2", "glue"):
        ...     add_cell(Path("robolink.toml"), name, {"url": f"epson+sim://{name}"})
        >>> [cell.name for cell in select_cells(["glue", "line3-*"])]
        ['glue', 'line3-1', 'line3-2']
    """
    return load_cell_files().select(words)


def check_file(path: Path) -> tuple[Problem, ...]:
    """Return all errors in one cell file; none if it is right.

    Raises:
        ConfigError: It cannot be read, or is no TOML.
    """
    return problems_in(read_document(path))


def problems_in(document: dict[str, object]) -> tuple[Problem, ...]:
    """Return all errors in the content of a cell file.

    Args:
        document: All of the file.
    """
    return _validated(document)[1]


def _validated(document: dict[str, object]) -> "tuple[CellFile | None, tuple[Problem, ...]]":
    """Return what a cell file says, and all errors in it; nothing where there is one."""
    from pydantic import ValidationError

    from robolink.config._settings import AccuracySettings, CellFile, CellSettings, station_keys

    wrong: list[Problem] = []
    for table, called in (("cells", _cell_name_problem), ("groups", _group_name_problem)):
        names = document.get(table)
        for name in names if isinstance(names, dict) else ():
            if not _CELL_NAME.fullmatch(name) or (table == "groups" and name[0] == GROUP_MARK):
                wrong.append(Problem(dotted([table, name]), called()))
    try:
        content = CellFile.model_validate(document)
    except ValidationError as error:
        known = {
            1: list(CellFile.model_fields),
            3: list(CellSettings.model_fields),
            4: list(AccuracySettings.model_fields),
        }
        return None, (*wrong, *problems_of(error, known, station_keys()))
    return (None if wrong else content), tuple(wrong)


def _cell_name_problem() -> str:
    return tr("cannot be the name of a cell: it must not contain blanks or + : / \\")


def _group_name_problem() -> str:
    return tr(
        "cannot be the name of a group: it must not contain blanks or + : / \\ or begin with @"
    )


def settings_of_file(path: Path) -> "Mapping[str, CellSettings]":
    """Return the cells of one file by itself; none if it is wrong.

    Raises:
        ConfigError: It cannot be read, or is no TOML.
    """
    content, _ = _validated(read_document(path))
    return {} if content is None else content.cells


def cell_names() -> list[str]:
    """Return the names of all cells, for TAB; files with errors are skipped."""
    return _names_in("cells")


def group_names() -> list[str]:
    """Return the names of all groups of cells, for TAB; files with errors are skipped."""
    return _names_in("groups")


def _names_in(table: str) -> list[str]:
    names: dict[str, None] = {}
    for named in _unchecked(table):
        names |= dict.fromkeys(named)
    return list(names)


def glimpse_of_cell(name: str) -> CellGlimpse:
    """Return what files say about a cell, unchecked, for TAB; errors are skipped."""
    url, stations = "", dict[str, None]()
    for cells in _unchecked("cells"):
        said = cells.get(name)
        if isinstance(said, dict):
            named = said.get("stations")
            stations |= dict.fromkeys(named if isinstance(named, dict) else ())
            url = url or str(said.get("url", ""))
    return CellGlimpse(url, tuple(stations))


def _unchecked(table: str) -> Iterator[dict[str, object]]:
    """Yield a table of each readable file, of the one with precedence first."""
    for file in config_files():
        if file.present:
            try:
                found = read_document(file.path).get(table)
            except ConfigError:
                continue
            if isinstance(found, dict):
                yield found


def _checked(path: Path) -> "CellFile":
    """Return what a correct file says.

    Raises:
        ConfigError: It cannot be read, or is wrong.
    """
    content, problems = _validated(read_document(path))
    if content is None:
        raise CELL_FILE.refusal(path, problems)
    return content


def _cell(
    name: str,
    parts: "Sequence[tuple[Path, CellSettings]]",
    otherwise: Mapping[str, tuple[str, Path] | None],
) -> Cell:
    """Return a cell from what the files say of it, the nearest first.

    Args:
        name: Its name.
        parts: What each file says of it.
        otherwise: What a file says of all cells without such a key of their own, and that file.

    Raises:
        ConfigError: Together they are wrong, or none has a URL.
    """
    if len(parts) == 1:
        path, settings = parts[0]
        settings = _with_whole_paths(settings, path)
        origins = dict.fromkeys(settings.model_fields_set, path)
    else:
        settings, origins = _together(name, parts)
    for key, default in otherwise.items():
        if default is not None and getattr(settings, key) is None:
            settings = settings.model_copy(update={key: default[0]})
            origins = {**origins, key: default[1]}
    if settings.url is None:
        missing = Problem(dotted(["cells", name, "url"]), tr("is missing in every file"))
        raise CELL_FILE.refusal(parts[0][0], [missing])
    url = address_with(settings.url, settings.model_dump(include=set(OPCUA_KEYS)))
    return Cell(name, url, settings, origins)


def _with_whole_paths(settings: "CellSettings", path: Path) -> "CellSettings":
    """Return the same with its paths as seen from everywhere."""
    whole = {
        key: whole_place(place, path)
        for key in ("password_file", "journal")
        if (place := getattr(settings, key)) is not None
    }
    return settings.model_copy(update=whole) if whole else settings


def _together(
    name: str, parts: "Sequence[tuple[Path, CellSettings]]"
) -> "tuple[CellSettings, dict[str, Path]]":
    """Return several files merged: the nearer one wins, station by station, row by row."""
    from pydantic import ValidationError

    from robolink.config._settings import CellSettings

    values: dict[str, object] = {}
    origins: dict[str, Path] = {}
    for path, settings in reversed(parts):
        for key, value in _with_whole_paths(settings, path).model_dump(exclude_unset=True).items():
            before = values.get(key)
            if key in ("stations", "accuracy") and isinstance(before, dict) and value is not None:
                value = before | value
            values[key], origins[key] = value, path
    try:
        return CellSettings.model_validate(values), origins
    except ValidationError as error:
        # Each file was valid on its own, so the error is in their combination.
        cell = dotted(["cells", name])
        problems = [
            Problem(f"{cell}.{problem.where}", problem.what) for problem in problems_of(error, {})
        ]
        raise CELL_FILE.refusal(parts[0][0], problems) from error
