"""The journal as a file: CSV for a spreadsheet, JSON and JSON lines for programs."""

import csv
import io
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import COMPONENTS, Recorded, Signature
from robolink_cli.views.journal import entry_payload

_OFFSETS: Final = ("before", "after")
_FIGURES: Final = (
    *("rms_mm", "max_residual_mm", "max_drift_mm", "repeatable_to_mm", "accurate_to_mm"),
)

COLUMNS: Final = (
    *("number", "at", "controller", "kind", "change", "operation", "tool"),
    *(f"{offset}_{component}" for offset in _OFFSETS for component in COMPONENTS),
    *_FIGURES,
    *("tolerance", "verdict"),
    *(field.name for field in fields(Signature)),
    *("details", "previous", "hash"),
)
"""The columns of a CSV file."""

_FORMULA: Final = re.compile("((?:^|[;\t\r\n|])[\\s\x00-\x20]*)([=+@\uff1d\uff0b\uff20\uff0d-])")
"""Text that a spreadsheet would calculate as a formula instead of showing it.

The text may follow a semicolon, tab or line end: a spreadsheet that splits lines there, as most do
in Europe, makes it a separate cell. Spreadsheets in East Asia accept the full-width signs too.
"""


def csv_lines(entries: Iterable[Recorded]) -> Iterator[bytes]:
    """Yield a CSV file: a header, then a line for each entry, in UTF-8 with its mark.

    Without the mark the usual spreadsheet would read other letters than were stored.
    """
    paper = io.StringIO(newline="")
    writer = csv.DictWriter(paper, COLUMNS, restval="")
    yield b"\xef\xbb\xbf"
    writer.writeheader()
    for entry in entries:
        writer.writerow(_csv_row(entry))
        yield paper.getvalue().encode()
        paper.seek(0)
        paper.truncate()
    yield paper.getvalue().encode()


def json_document(entries: Iterable[Recorded]) -> Iterator[bytes]:
    """Yield one JSON document, an entry a line."""
    yield b'{"schema": "robolink/journal-export/1", "entries": ['
    mark = b"\n"
    for entry in entries:
        yield mark + _json(entry)
        mark = b",\n"
    yield b"\n]}\n"


def json_lines(entries: Iterable[Recorded]) -> Iterator[bytes]:
    """Yield a JSON document for each entry, a line each."""
    for entry in entries:
        yield _json(entry) + b"\n"


FORMATS: Final[Mapping[str, Callable[[Iterable[Recorded]], Iterator[bytes]]]] = {
    "csv": csv_lines,
    "json": json_document,
    "jsonl": json_lines,
}
"""Export formats by name. The names are also the usual file extensions."""


def form_of(file: Path) -> str:
    """Return the form that a file's name asks for.

    Raises:
        ConfigError: It asks for none of them.
    """
    form = file.suffix.removeprefix(".").lower()
    if form not in FORMATS:
        raise ConfigError(
            tr("The name {file} does not show the format of the export.", file=file),
            remedy=tr("End it with .csv, .json or .jsonl, or give --format."),
        )
    return form


class Counted:
    """Entries that are counted as they pass.

    Attributes:
        count: How many have passed.
    """

    def __init__(self, entries: Iterable[Recorded]) -> None:
        self._entries = entries
        self.count = 0

    def __iter__(self) -> Iterator[Recorded]:
        """Yield them."""
        for entry in self._entries:
            self.count += 1
            yield entry


def _json(entry: Recorded) -> bytes:
    return json.dumps(entry_payload(entry, as_stored=True), allow_nan=False).encode()


def _csv_row(entry: Recorded) -> dict[str, object]:
    payload = entry_payload(entry)
    row: dict[str, object] = {name: _as_shown(payload[name]) for name in COLUMNS if name in payload}
    for offset in _OFFSETS:
        value = payload.get(offset)
        if isinstance(value, dict):
            row |= {f"{offset}_{name}": number for name, number in value.items()}
    row |= {name: _as_shown(entry.details.get(name)) for name in _FIGURES}
    return row | {"details": _as_shown(json.dumps(dict(entry.details), sort_keys=True))}


def _as_shown(value: object) -> object:
    return _FORMULA.sub(r"\1'\2", value) if isinstance(value, str) else value
