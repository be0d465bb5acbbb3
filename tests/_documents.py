"""Whether every document that a command printed in this process fits its published schema.

What is looked at is what reached a program: each text that goes out through the one place that
prints JSON. A test whose command is made up says so with :meth:`Documents.forgive`.
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
    """Return where the schema of a document stands: ``status-1`` of ``robolink/status/1``."""
    return schema.removeprefix("robolink/").replace("/", "-")


def wrong_in(document: dict[str, Any]) -> list[str]:
    """Return what is wrong with a document, each with its place."""
    schema = document["schema"]
    described = PUBLISHED.get(key_of(schema))
    if described is None:
        return [f"{schema} is not published"]
    return [f"{schema}: {wrong}" for wrong in _SCHEMAS.wrong(described, document)]


class Documents:
    """What was wrong with documents since :meth:`begin`."""

    def __init__(self) -> None:
        self.wrong: list[str] = []
        self._forgiven = False

    def begin(self) -> None:
        """Forget everything."""
        self.wrong.clear()
        self._forgiven = False

    def forgive(self) -> None:
        """Look at no document of this test: they are made up."""
        self._forgiven = True
        self.wrong.clear()

    def hear(self, text: object) -> None:
        """Look at what was printed."""
        if self._forgiven or not isinstance(text, str) or _MARK not in text[:40]:
            return
        rest = text
        while rest:  # what a process said that has ended is handed over as one text
            document, end = _DECODER.raw_decode(rest)
            self.wrong += wrong_in(document)
            rest = rest[end:].lstrip()

    def install(self) -> None:
        """Look at all that is printed from here on."""
        printed = click.echo

        @wraps(printed)
        def echo(message: Any = None, *rest: Any, **named: Any) -> None:
            self.hear(message)
            printed(message, *rest, **named)

        click.echo = echo


DOCUMENTS: Final = Documents()
"""Of the test that runs."""
