"""A command in this process: how it ended and what it showed."""

import contextlib
import io
import json
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

from robolink_cli import main

from robolink.locale.languages import translator

chinese = cache(partial(translator, "zh"))
"""Returns what translates; thousands of sentences are read once, not for each test."""


@dataclass(frozen=True)
class Ended:
    """How a command ended and what it showed."""

    code: int
    out: str
    err: str

    @property
    def document(self) -> dict[str, Any]:
        """The JSON document."""
        found: dict[str, Any] = json.loads(self.out)
        return found


def run_command(*words: str, err: io.StringIO | None = None) -> Ended:
    """Run a command; ``err`` may be a stream that claims to be a terminal."""
    out, err = io.StringIO(), err or io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main.run(list(words))
    return Ended(code, out.getvalue(), err.getvalue())
