"""Checks every document that a command prints in this process against its published schema.

All JSON is printed by one function, and each text that passes through it is checked. A test that
uses a made-up command calls :meth:`Documents.forgive`.
"""

import json
from functools import wraps
from pathlib import Path
from typing import Any, Final

import click

from tests._json_schema import Schemas

FILE: Final = Path(__file__).parents[1] / "docs" / "documents.schema.json"
PUBLISHED: Final[dict[str, Any]] = json.loads(FILE.read_text(encoding="utf-8"))["$defs"]
_SCHEMAS: Final = Schemas({"$defs": PUBLISHED})
_DECODER: Final = json.JSONDecoder()
_MARK: Final = '"schema": "robolink/'


def key_of(schema: str) -> str:
    """Return the key of a document's schema: ``status-1`` for ``robolink/status/1``."""
    return schema.removeprefix("robolink/").replace("/", "-")


def wrong_in(document: dict[str, Any]) -> list[str]:
    """Return the faults of a document, each with its place."""
    schema = document["schema"]
    described = PUBLISHED.get(key_of(schema))
    if described is None:
        return [f"{schema} is not published"]
    return [f"{schema}: {wrong}" for wrong in _SCHEMAS.wrong(described, document)]


class Documents:
    """Collects the faults of documents printed since :meth:`begin`."""

    def __init__(self) -> None:
        self.wrong: list[str] = []
        self._forgiven = False

    def begin(self) -> None:
        """Forget everything collected."""
        self.wrong.clear()
        self._forgiven = False

    def forgive(self) -> None:
        """Skip the documents of this test: they are made up."""
        self._forgiven = True
        self.wrong.clear()

    def hear(self, text: object) -> None:
        """Check a printed text."""
        if self._forgiven or not isinstance(text, str) or _MARK not in text[:40]:
            return
        rest = text
        while rest:  # the output of a process that ended comes as one text
            document, end = _DECODER.raw_decode(rest)
            self.wrong += wrong_in(document)
            rest = rest[end:].lstrip()

    def install(self) -> None:
        """Check everything printed from now on."""
        printed = click.echo

        @wraps(printed)
        def echo(message: Any = None, *rest: Any, **named: Any) -> None:
            self.hear(message)
            printed(message, *rest, **named)

        click.echo = echo


DOCUMENTS: Final = Documents()
"""The collector for the running test."""
