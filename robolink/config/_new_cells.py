"""A cell is added to a cell file, or a key to a cell; all other lines stay as they are."""

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

from robolink.config._cells import problems_in
from robolink.config._files import CELL_FILE
from robolink.errors import ConfigError
from robolink.files.durable import write_whole
from robolink.messages import tr


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
    _write(path, content_with_cell(path, name, said))


def set_cell_key(path: Path, name: str, key: str, value: str) -> None:
    """Set one key of a cell that a file has; the rest of the file stays as it is, to the byte.

    Args:
        path: The file.
        name: The cell's name.
        key: The key; the value that it has goes.
        value: Its new value.

    Raises:
        ConfigError: The file has no such cell, is wrong or would be, or writes the cell in a way
            that is not changed here; nothing is written, and the line for an editor is named.

    Example:
        >>> from pathlib import Path
        >>> from robolink.config import add_cell, find_cell, set_cell_key
        >>> add_cell(Path("robolink.toml"), "line3", {"url": "epson+tcp://192.168.0.1:5000"})
        >>> set_cell_key(Path("robolink.toml"), "line3", "notes", "needle 22G")
        >>> find_cell("line3").settings.notes
        'needle 22G'
    """
    before = CELL_FILE.read(path)
    document = _plain(CELL_FILE.parse(path, before))
    line = f"{key} = {_quoted(value)}"
    wanted = _with_key(document, name, key, value)
    if path.is_symlink():
        raise ConfigError(
            tr("{path} is a link to another file.", path=path),
            remedy=tr(
                "Nothing was written. Add this line to the cell in an editor: {line}", line=line
            ),
        )
    if wanted == document:
        return
    for content in _with_line(before, name, key, line) if wanted else ():
        if _parsed(content) == wanted:
            problems = problems_in(wanted)
            if problems:
                error = CELL_FILE.refusal(path, problems)
                error.remedy = tr("Nothing was written.")
                raise error
            _write(path, content)
            return
    raise ConfigError(
        tr("{path} does not write the cell {name} as a table of its own.", path=path, name=name),
        remedy=tr("Nothing was written. Add this line to the cell in an editor: {line}", line=line),
    )


def _write(path: Path, content: bytes) -> None:
    try:
        mode = path.stat().st_mode & 0o777 if path.exists() else 0o666
        write_whole(path, content, mode=mode)
    except OSError as error:
        raise ConfigError(
            tr("{path} cannot be written: {cause}.", path=path, cause=error.strerror or error),
            remedy=tr("Nothing was written."),
        ) from error


def _plain(document: object) -> dict[str, object]:
    """Return a copy to compare: dates as text, tuples as lists."""
    made: dict[str, object] = json.loads(json.dumps(document, default=str))
    return made


def _with_key(document: object, name: str, key: str, value: str) -> dict[str, object] | None:
    """Return a document with a key set in a cell; ``None`` where it has no such cell."""
    made = _plain(document)
    cells = made.get("cells")
    cell = cells.get(name) if isinstance(cells, dict) else None
    if not isinstance(cell, dict):
        return None
    cell[key] = value
    return made


def _with_line(before: bytes, name: str, key: str, line: str) -> Iterator[bytes]:
    """Yield contents that may be the right one: whoever asks parses and compares them."""
    lines = before.decode().splitlines(keepends=True)
    said = re.compile(rf"\s*(?:{re.escape(key)}|\"{re.escape(key)}\")\s*=")
    for at, header in enumerate(lines):
        if _table_of(header) != name:
            continue
        end = "\r\n" if header.endswith("\r\n") else "\n"
        for there in range(at + 1, len(lines)):
            if said.match(lines[there]):
                yield "".join([*lines[:there], line + end, *lines[there + 1 :]]).encode()
            if lines[there].lstrip().startswith("["):
                break
        opened = header if header.endswith("\n") else header + end
        yield "".join([*lines[:at], opened, line + end, *lines[at + 1 :]]).encode()


def _table_of(line: str) -> str | None:
    """Return the cell whose table a line begins; ``None`` for any other line."""
    if not line.lstrip().startswith("["):
        return None
    cells = _parsed(line.encode()).get("cells")
    if not isinstance(cells, dict) or len(cells) != 1:
        return None
    ((name, keys),) = cells.items()
    return None if keys else str(name)


def _parsed(content: bytes) -> dict[str, object]:
    try:
        return _plain(tomllib.loads(content.decode()))
    except (ValueError, RecursionError):
        return {}


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
