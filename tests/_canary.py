"""Searches everything that a test makes robolink write, print or log for the test's passwords.

Each ``Secret`` that a test makes is a canary. At the end of the test its text is looked for in the
files of the test (journals, traces, backups, reports, state), in the output of this process and of
started processes, in the log, and in every error object, shown or not.
"""

import logging
import subprocess
from collections import deque
from collections.abc import Callable, Iterator
from functools import wraps
from pathlib import Path
from typing import Any, Final

import pytest

from robolink.errors import RobolinkError
from robolink.model import Secret

SHORTEST: Final = 7
"""A shorter password could occur in a text by chance, so tests must not use one."""

_MOST_KEPT: Final = 20_000


class Watch:
    """Records all output and all passwords since :meth:`begin`.

    Attributes:
        passwords: The texts that must not appear.
        said: Each recorded text, with its source.
    """

    def __init__(self) -> None:
        self.passwords: set[str] = set()
        self.said: deque[tuple[str, str]] = deque(maxlen=_MOST_KEPT)

    def begin(self) -> None:
        """Forget everything recorded."""
        self.passwords.clear()
        self.said.clear()

    def hear(self, where: str, what: object) -> None:
        """Record an output."""
        if what:
            text = what.decode("latin-1") if isinstance(what, bytes) else str(what)
            self.said.append((where, text))

    def leaks(self, *folders: Path) -> list[str]:
        """Return the outputs and files that contain a password; never the password itself."""
        found = []
        for password in sorted(self.passwords):
            found += [where for where, what in self.said if password in what]
            for folder in folders:
                found += [str(file) for file in _files(folder) if _holds(file, password.encode())]
        return found


def install(watch: Watch) -> None:
    """Make ``watch`` record every password, error, output and log entry from now on."""
    _after(Secret, "__init__", lambda _none, _self, value: _note(watch, value))
    _after(
        RobolinkError,
        "__init__",
        lambda _none, error, what, **more: watch.hear(
            type(error).__name__, [what, more, error.args]
        ),
    )
    _after(pytest.CaptureFixture, "readouterr", lambda shown, _self: watch.hear("shown", shown))
    _after(
        subprocess.Popen,
        "communicate",
        lambda shown, _self, *_given, **_named: watch.hear("shown by another process", shown),
    )
    logging.getLogger().addHandler(_Listener(watch))


def _note(watch: Watch, password: str) -> None:
    if password in ("", "..."):  # none, and that of the pages
        return
    if len(password) < SHORTEST:
        raise ValueError(f"a password of {len(password)} characters stands in texts by chance")
    watch.passwords.add(password)


def _after(kind: type, name: str, hear: Callable[..., object]) -> None:
    method: Callable[..., Any] = getattr(kind, name)

    @wraps(method)
    def heard(*given: Any, **named: Any) -> object:
        answer = method(*given, **named)
        hear(answer, *given, **named)
        return answer

    setattr(kind, name, heard)


class _Listener(logging.Handler):
    def __init__(self, watch: Watch) -> None:
        super().__init__()
        self._watch = watch

    def emit(self, record: logging.LogRecord) -> None:
        self._watch.hear(f"logged by {record.name}", record.getMessage())


def _files(folder: Path) -> Iterator[Path]:
    for path in folder.rglob("*"):
        if path.is_file() and not path.is_symlink():
            yield path


def _holds(file: Path, password: bytes) -> bool:
    try:
        data = file.read_bytes()
    except OSError:
        return False
    # The file in which a test supplied the password.
    return password in data and data.split(b"\n", 1)[0].strip(b"\xef\xbb\xbf \r") != password
