"""TOML files that people write: read, or refused with all their errors at once.

Cell files, recipes and PLC maps differ in their keys. How one is read, how a problem names its
key and how all problems of a file are told is the same for them.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.files.named import read_named
from robolink.messages import listed, tr

__all__ = [
    "FileKind",
    "MOST_BYTES",
    "MOST_SHOWN",
    "Problem",
]

MOST_BYTES: Final = 250_000
"""Size limit in bytes: a recipe of a hundred tools or a cell file of a hundred cells takes 60 kB.
"""

MOST_SHOWN: Final = 40
"""Largest number of problems of one file in an error; a file in another format has one in each
line."""

_MOST_PARTS: Final = 32
_PART: Final = r"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY: Final = (
    rf"(?m)^[ \t]*+\[*+[ \t]*+{_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{_MOST_PARTS}}}"
    rf"|[{{,][ \t]*+{_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{_MOST_PARTS}}}"
)
"""A key with very many parts, on which Python's parser takes quadratic time: a key of 60,000 parts,
120 kB, took minutes. The keys of robolink have four parts."""


@dataclass(frozen=True, slots=True)
class Problem:
    """One error in a file.

    Attributes:
        where: Path of the key inside the file; empty for the file as a whole.
        what: What is wrong with it. Never the value: it might be a password.
    """

    where: str
    what: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what}" if self.where else self.what


@dataclass(frozen=True, slots=True)
class FileKind:
    """The name of a kind of file, and what to do about one that is unusable.

    The sentences are asked for when they are shown, in the language of that moment.

    Attributes:
        named: Returns its name in a sentence: "The recipe change.toml".
        unreadable_remedy: Returns what to do when it cannot be read.
        wrong_remedy: Returns what to do when something in it is wrong.
    """

    named: Callable[[Path], str]
    unreadable_remedy: Callable[[], str]
    wrong_remedy: Callable[[], str]

    def read(self, path: Path) -> bytes:
        """Return the content of a file.

        Raises:
            ConfigError: It cannot be read, or is longer than :data:`MOST_BYTES`.
        """
        try:
            return read_named(path, most_bytes=MOST_BYTES)
        except OSError as error:
            raise self._unreadable(path, error.strerror or str(error)) from error

    def parse(self, path: Path, content: bytes) -> dict[str, object]:
        """Return what a file says, from its content.

        Raises:
            ConfigError: It is no TOML.
        """
        import tomllib  # not needed while a cell's file is unchanged

        try:
            # Editors on Windows add a byte order mark, which TOML does not allow.
            text = content.decode("utf-8-sig")
            if re.search(_LONG_KEY, text):
                raise self._unreadable(
                    path, tr("a key has more than {most} parts", most=_MOST_PARTS)
                )
            return tomllib.loads(text)
        except UnicodeError as error:
            raise self._unreadable(path, tr("it is not UTF-8 text")) from error
        except RecursionError as error:
            raise self._unreadable(path, tr("it is nested too deeply")) from error
        except ValueError as error:  # a TOML error, or a number with thousands of digits
            raise self._unreadable(path, str(error)) from error

    def refusal(self, path: Path, problems: Sequence[Problem]) -> ConfigError:
        """Return the error that lists the problems of one file, the first forty of them."""
        shown = [str(problem) for problem in problems[:MOST_SHOWN]]
        if len(problems) > MOST_SHOWN:
            shown.append(tr("and {more} more", more=len(problems) - MOST_SHOWN))
        named = self.named(path)
        head = (
            tr("{file} has {count} errors:", file=named, count=len(problems))
            if len(problems) > 1
            else tr("{file} has an error:", file=named)
        )
        return ConfigError(listed(head, shown), remedy=self.wrong_remedy())

    def _unreadable(self, path: Path, cause: str) -> ConfigError:
        return ConfigError(
            tr("{path} cannot be read: {cause}.", path=self.named(path), cause=cause),
            remedy=self.unreadable_remedy(),
        )
