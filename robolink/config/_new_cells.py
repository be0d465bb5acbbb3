"""A cell is added to a cell file, whose other lines stay as they are."""

import json
from collections.abc import Mapping
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
