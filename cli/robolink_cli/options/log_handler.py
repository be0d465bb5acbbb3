"""The file of a log: lines that several processes append to, and that logrotate may move away."""

import logging
import logging.handlers
from datetime import UTC, datetime
from io import TextIOWrapper
from pathlib import Path
from typing import Final, cast

from robolink.files.named import append_to_named
from robolink.messages import tr
from robolink.package_log import complain

LINE: Final = "%(asctime)s %(levelname)s %(process)d %(threadName)s %(name)s %(message)s"


class LogFile(logging.handlers.WatchedFileHandler):
    """Appends a line a record, at once; reopens the file if it was moved or deleted.

    A line goes out in one piece, so that those of two processes are not mixed. What cannot be
    written is said once on standard error, and ends nothing.

    Attributes:
        levels: What the levels of the loggers were before.

    Args:
        path: The file.

    Raises:
        OSError: It cannot be written.
    """

    def __init__(self, path: str) -> None:
        self.levels: dict[str, int] = {}
        super().__init__(path, encoding="utf-8", errors="backslashreplace")
        self.setFormatter(_Line(LINE))

    def _open(self) -> TextIOWrapper:
        return cast("TextIOWrapper", append_to_named(Path(self.baseFilename), encoding="utf-8"))

    def emit(self, record: logging.LogRecord) -> None:
        """Append one record; a failure is reported once."""
        try:
            super().emit(record)
        except Exception as error:
            self._complain(error)

    def close(self) -> None:
        """Close the file; a full disk is reported like that of any line."""
        try:
            super().close()
        except OSError as error:
            self._complain(error)

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802, ARG002 - logging's form
        """Report once that the disk is full, or any other failure."""
        import sys

        self._complain(sys.exc_info()[1])

    def _complain(self, error: BaseException | None) -> None:
        cause = getattr(error, "strerror", None) or error
        complain(
            tr(
                "The log {path} cannot be written: {cause}. The work goes on without it.",
                path=self.baseFilename,
                cause=cause,
            )
        )


class _Line(logging.Formatter):
    """One line, its time in UTC with its offset."""

    def formatTime(self, record: logging.LogRecord, datefmt: str | None = None) -> str:  # noqa: N802, ARG002 - logging's form
        return datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds")
