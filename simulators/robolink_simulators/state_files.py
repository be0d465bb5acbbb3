"""What a simulated controller keeps over a restart, as one small file."""

import json
import random
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from robolink import ambient
from robolink.files.durable import sync_folder, write_whole
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
    return ambient.random_number(32)


def drawn_serial(origin: str = "") -> str:
    """Return a serial number as :func:`drawn_number` draws it, marked as a simulator's."""
    return f"SIM{drawn_number(origin):08X}"


class StateNotKeptError(NotNowError):
    """A file of a state cannot be written, so what was changed would not outlive a restart."""


class StateFile:
    """The file that stands for flash or retained memory.

    A controller whose memory is broken and goes on as if nothing were would make a test green
    that is not: whoever serves it looks at :attr:`failure`, and ends it.

    Args:
        path: Where; ``None`` keeps nothing.

    Attributes:
        path: Where.
        failure: Why something could not be kept; ``None`` as long as all was.
    """

    def __init__(self, path: Path | None) -> None:
        self.path = path
        self.failure: StateNotKeptError | None = None

    def save(self, document: Mapping[str, object]) -> None:
        """Put a new state in the place of the old one; a crash leaves one of them whole.

        Its folder is made where there is none.

        Raises:
            StateNotKeptError: It cannot be written.
        """
        if self.path is None:
            return
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(self.path, json.dumps(document).encode())
            sync_folder(self.path.parent)
        except OSError as error:
            self.failure = StateNotKeptError(
                tr(
                    "The simulator cannot save its state in {path}: {cause}.",
                    path=self.path,
                    cause=error.strerror or error,
                ),
                remedy=tr("Name a file in a folder that can be written."),
            )
            raise self.failure from error
