"""What a simulated controller retains over a restart, as one small file."""

import json
import random
from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from robolink import runtime
from robolink.errors import ConfigError
from robolink.files.durable import sync_folder, write_whole
from robolink.files.named import read_named
from robolink.messages import tr
from robolink_simulators.not_now import NotNowError

_HIGHEST: Final = 0xFFFF_FFFF


def drawn_number(origin: str = "") -> int:
    """Return a number from 1 to 2^32 - 1.

    Args:
        origin: The same text draws the same number; empty draws another one each time.
    """
    if origin:
        return random.Random(f"serial {origin}").randint(1, _HIGHEST)
    return runtime.random_number(32)


def drawn_serial(origin: str = "") -> str:
    """Return a serial number as :func:`drawn_number` draws it, marked as a simulator's."""
    return f"SIM{drawn_number(origin):08X}"


class StateNotKeptError(NotNowError):
    """A state file cannot be written, so changes would not outlive a restart."""


class StateFile(ABC):
    """The file that stands for flash or retained memory; a subclass tells what is in it.

    A controller whose memory is broken and goes on as if nothing were would make a test green
    that is not: whoever serves it looks at :attr:`failure`, and ends it.

    Args:
        path: Where; ``None`` keeps nothing.

    Attributes:
        failure: Why something could not be kept; ``None`` as long as all was.
    """

    def __init__(self, path: Path | None) -> None:
        self.failure: StateNotKeptError | None = None
        self._path = path
        self._written: Mapping[str, object] | None = None

    @abstractmethod
    def _document(self) -> Mapping[str, object]:
        """Return what to store now, as independent values."""

    @abstractmethod
    def _take(self, document: Any) -> bool:  # noqa: ANN401 - whatever the file holds
        """Take over the content of a file; return whether that was everything."""

    @abstractmethod
    def _foreign(self, path: Path) -> str:
        """Return the sentence for a file with other content."""

    def restore(self) -> bool:
        """Give the controller what the file holds; False when there is none.

        Raises:
            ConfigError: The file cannot be read or is not of this machine.
        """
        if self._path is None or not self._path.exists():
            return False
        try:
            if self._take(json.loads(read_named(self._path))):
                self._written = self._document()
        except (OSError, AttributeError, KeyError, RecursionError, TypeError, ValueError) as error:
            raise ConfigError(
                self._foreign(self._path),
                remedy=tr("Name another file, or delete this one to start afresh."),
            ) from error
        return True

    def save_changes(self) -> None:
        """Replace the old state with a new one; a crash leaves one of them whole.

        Its folder is made where there is none. A state that is written already stays.

        Raises:
            StateNotKeptError: It cannot be written.
        """
        if self._path is None or (document := self._document()) == self._written:
            return
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(self._path, json.dumps(document).encode())
            sync_folder(self._path.parent)
        except OSError as error:
            self.failure = StateNotKeptError(
                tr(
                    "The simulator cannot save its state in {path}: {cause}.",
                    path=self._path,
                    cause=error.strerror or error,
                ),
                remedy=tr("Name a file in a folder that can be written."),
            )
            raise self.failure from error
        self._written = document
