"""From the cell files to one cell, with the source of each of its values."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from robolink.config._files import CELL_FILE, config_files, read_document
from robolink.config._reach import Expected
from robolink.errors import ConfigError
from robolink.files.durable import write_whole
from robolink.files.key_problems import is_not_known, sentence
from robolink.files.toml import Problem
from robolink.messages import known_names, tr
from robolink.model import ChangeLimits

if TYPE_CHECKING:
    from pydantic import ValidationError

    from robolink.config._settings import CellSettings

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


_Said = dict[str, tuple[Path, object]]
"""Values that files give for a cell, each with the file that gives it."""

_CELL_NAME = re.compile(r"[^\s+:/\\]+")


USUAL_CHANGE_MM: Final = 2.0
"""Default limit of a cell, in mm: more than a nozzle change explains."""


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
        url: The controller's URL.
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
    if name in cells:
        return cells[name]
    if cells:
        remedy = known_names(cells, name)
    else:
        remedy = tr(
            "No cell file was found; 'robolink cell files' shows where robolink looks for "
            "one. A URL such as epson+tcp://192.168.0.1:5000 needs none."
        )
    raise ConfigError(tr("There is no cell {name!r}.", name=name), remedy=remedy)


def load_cells() -> dict[str, Cell]:
    """Return all cells of all files, those of the file with precedence first.

    A file adds to what farther ones say about a cell, and wins where both say something. One
    that gives a URL starts the cell anew: limits and confirmations were given for the robot
    at the other address.

    Raises:
        ConfigError: A file is wrong, or a cell has no URL in any of them.
    """
    said: dict[str, _Said] = {}
    for file in config_files():
        if file.present:
            for name, values in _checked(file.path).items():
                nearer = said.setdefault(name, {})
                if "url" not in nearer:
                    said[name] = _together(
                        {key: (file.path, value) for key, value in values.items()}, nearer
                    )
    return {name: _cell(name, values) for name, values in said.items()}


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
    from pydantic import ValidationError

    from robolink.config._settings import AccuracySettings, CellFile, CellSettings, station_keys

    cells = document.get("cells")
    names = [
        Problem(
            dotted(["cells", name]),
            tr("cannot be the name of a cell: it must not contain blanks or + : / \\"),
        )
        for name in (cells if isinstance(cells, dict) else ())
        if not _CELL_NAME.fullmatch(name)
    ]
    try:
        CellFile.model_validate(document)
    except ValidationError as error:
        known = {
            1: ["cells"],
            3: list(CellSettings.model_fields),
            4: list(AccuracySettings.model_fields),
        }
        return (*names, *problems_of(error, known, station_keys()))
    return tuple(names)


def settings_of_file(path: Path) -> "Mapping[str, CellSettings]":
    """Return the cells of one file by itself; none if it is wrong.

    Raises:
        ConfigError: It cannot be read, or is no TOML.
    """
    from robolink.config._settings import CellFile

    if check_file(path):
        return {}
    return CellFile.model_validate(read_document(path)).cells


def cell_names() -> list[str]:
    """Return the names of all cells, for TAB; files with errors are skipped."""
    names: dict[str, None] = {}
    for cells in _unchecked():
        names |= dict.fromkeys(cells)
    return list(names)


def glimpse_of_cell(name: str) -> CellGlimpse:
    """Return what files say about a cell, unchecked, for TAB; errors are skipped."""
    url, stations = "", dict[str, None]()
    for cells in _unchecked():
        said = cells.get(name)
        if isinstance(said, dict):
            named = said.get("stations")
            stations |= dict.fromkeys(named if isinstance(named, dict) else ())
            url = url or str(said.get("url", ""))
    return CellGlimpse(url, tuple(stations))


def _unchecked() -> Iterator[dict[str, object]]:
    """Yield the cells of each readable file, the one with precedence first."""
    for file in config_files():
        if file.present:
            try:
                cells = read_document(file.path).get("cells")
            except ConfigError:
                continue
            if isinstance(cells, dict):
                yield cells


def _together(farther: _Said, nearer: _Said) -> _Said:
    """Return two files merged: the nearer one wins, station by station, row by row."""
    both = farther | nearer
    for table in ("stations", "accuracy"):
        if table in farther and table in nearer:
            (_, old), (path, new) = farther[table], nearer[table]
            assert isinstance(old, dict) and isinstance(new, dict)  # noqa: S101, PT018 - both were checked
            both[table] = (path, old | new)
    return both


def _checked(path: Path) -> dict[str, dict[str, object]]:
    """Return each cell of a correct file, with absolute paths."""
    from robolink.config._settings import CellFile

    problems = check_file(path)
    if problems:
        raise CELL_FILE.refusal(path, problems)
    tables = {}
    for name, settings in CellFile.model_validate(read_document(path)).cells.items():
        values = settings.model_dump(exclude_unset=True)
        if "password_file" in values:
            hinted = Path(values["password_file"]).expanduser()
            values["password_file"] = str(path.parent / hinted)
        tables[name] = values
    return tables


def _cell(name: str, said: Mapping[str, tuple[Path, object]]) -> Cell:
    from pydantic import ValidationError

    from robolink.config._settings import CellSettings

    values = {key: value for key, (_, value) in said.items()}
    origins = {key: path for key, (path, _) in said.items()}
    try:
        settings = CellSettings.model_validate(values)
    except ValidationError as error:
        # Each file was valid on its own, so the error is in their combination.
        cell = dotted(["cells", name])
        problems = [
            Problem(f"{cell}.{problem.where}", problem.what) for problem in problems_of(error, {})
        ]
        raise CELL_FILE.refusal(next(iter(origins.values())), problems) from error
    if settings.url is None:
        missing = Problem(dotted(["cells", name, "url"]), tr("is missing in every file"))
        raise CELL_FILE.refusal(next(iter(origins.values())), [missing])
    return Cell(name, settings.url, settings, origins)


def add_cell(path: Path, name: str, said: Mapping[str, str | float]) -> None:
    """Add a cell to a cell file; the rest of the file stays as it is, to the byte.

    Args:
        path: The file; it is made where there is none.
        name: The cell's name.
        said: Its keys, in this order.

    Raises:
        ConfigError: The file has a cell of that name, is wrong, or would be; nothing is written.

    Example:
        >>> from pathlib import Path
        >>> from robolink.config import add_cell, cell_names
        >>> add_cell(Path("robolink.toml"), "line3", {"url": "epson+tcp://192.168.0.1:5000"})
        >>> cell_names()
        ['line3']
    """
    content = content_with_cell(path, name, said)
    try:
        write_whole(path, content, mode=0o666)
    except OSError as error:
        raise ConfigError(
            tr("{path} cannot be written: {cause}.", path=path, cause=error.strerror or error),
            remedy=tr("Nothing was written."),
        ) from error


def content_with_cell(path: Path, name: str, said: Mapping[str, str | float]) -> bytes:
    r"""Return a cell file's content with one more cell, as far as its keys are known by now.

    Args:
        path: The file; it is read where there is one.
        name: The cell's name.
        said: Its keys, in this order.

    Raises:
        ConfigError: The file has a cell of that name, is wrong, or would be.

    Example:
        >>> from pathlib import Path
        >>> from robolink.config import content_with_cell
        >>> content_with_cell(Path("new-cell-example.toml"), "line3", {})
        b'[cells."line3"]\n'
    """
    before = CELL_FILE.read(path) if path.exists() else b""
    cells = CELL_FILE.parse(path, before).get("cells")
    if isinstance(cells, dict) and name in cells:
        raise ConfigError(
            tr("{path} has a cell {name} already.", path=path, name=name),
            remedy=tr(
                "Nothing was written. Choose another name, or change that cell in an editor."
            ),
        )
    rows = [f"[cells.{_quoted(name)}]", *(f"{key} = {_quoted(one)}" for key, one in said.items())]
    gap = b"" if not before else b"\n" if before.endswith(b"\n") else b"\n\n"
    content = before + gap + "\n".join([*rows, ""]).encode()
    problems = problems_in(CELL_FILE.parse(path, content))
    if problems:
        error = CELL_FILE.refusal(path, problems)
        error.remedy = tr("Nothing was written.")
        raise error
    return content


def _quoted(value: str | float) -> str:
    """Return a value as TOML has it; of text JSON's way of writing is one of TOML's."""
    return json.dumps(value)
