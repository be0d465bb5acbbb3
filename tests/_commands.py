"""Runs a command in this process and returns its exit code and output."""

import contextlib
import io
import json
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

from robolink_cli import main

from robolink.locale.languages import translator

chinese = cache(partial(translator, "zh"))
"""Returns the Chinese translator. Its thousands of sentences are read once for all tests."""


@dataclass(frozen=True)
class Ended:
    """The exit code and the output of a command."""

    code: int
    out: str
    err: str

    @property
    def document(self) -> dict[str, Any]:
        """The JSON document that was printed."""
        found: dict[str, Any] = json.loads(self.out)
        return found


def run_command(*words: str, err: io.StringIO | None = None) -> Ended:
    """Run a command; ``err`` may be a stream that claims to be a terminal."""
    out, err = io.StringIO(), err or io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main.run(list(words))
    return Ended(code, out.getvalue(), err.getvalue())
