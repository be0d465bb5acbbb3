"""What robolink logs: one logger a package, with the standard :mod:`logging`.

A library configures nothing: no handler but a ``NullHandler`` on the logger ``robolink``, no
level, never the root logger. What passes on a link is logged at DEBUG
(:mod:`robolink.transport.traffic`), what was decided at INFO. Records are in English, like the
journal, whatever language a person reads, and each carries ``controller``, ``request`` and
``direction`` for filters and formatters.

Nobody can listen in a process that has not imported ``logging``. So it is not imported here either:
a stop does without it (docs/decisions/0017-a-stop-has-its-own-way-to-the-wire.md).
"""

import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Final, Literal

from robolink.messages import in_english, tr

if TYPE_CHECKING:
    from logging import Logger

ROOT: Final = "robolink"

Way = Literal["sent", "received", ""]
"""Direction of a message; empty for a decision."""

_DEBUG: Final = 10
_INFO: Final = 20
_WARNING: Final = 30

_told: set[str] = set()
"""Sentences already written to standard error."""


class PackageLog:
    """The logger of one package.

    No method raises, waits for anything but the handlers that a program has set up, or lets one of
    them that fails end what is logged.

    Args:
        package: Its name, ``__package__`` of the module that logs.

    Example:
        >>> import logging
        >>> from robolink.package_log import PackageLog
        >>> log = PackageLog("robolink.package_log_example")
        >>> log.debugs()
        False
        >>> logging.getLogger("robolink.package_log_example").setLevel(logging.DEBUG)
        >>> log.debugs()
        True
    """

    __slots__ = ("_logger", "_package")

    def __init__(self, package: str | None) -> None:
        self._package = package or ROOT
        self._logger: Logger | None = None

    def debugs(self) -> bool:
        """Whether anybody logs what passes on a link."""
        logger = self._logger
        if logger is None:
            logger = self._found()
        return logger is not None and logger.isEnabledFor(_DEBUG)

    def passed(self, text: str, *, controller: str, request: str, direction: Way) -> None:
        """Log, at DEBUG, one piece that went over a link."""
        self._log(_DEBUG, text, controller, request, direction)

    def decided(self, text: str, *, controller: str, request: str = "") -> None:
        """Log a decision, at INFO.

        Args:
            text: A sentence, without the controller's name in front.
            controller: Identity of the controller that it is about.
            request: What it was decided about.
        """
        self._log(_INFO, text, controller, request, "")

    def doubted(self, text: str, *, controller: str, request: str = "") -> None:
        """Log, at WARNING, what a person has to look into; see :meth:`decided`."""
        self._log(_WARNING, text, controller, request, "")

    def _log(self, level: int, text: str, controller: str, request: str, direction: Way) -> None:
        logger = self._logger
        if logger is None:
            logger = self._found()
        if logger is None or not logger.isEnabledFor(level):
            return
        extra = {"controller": controller, "request": in_english(request), "direction": direction}
        try:
            logger.log(level, "%s: %s", controller, in_english(text), stacklevel=3, extra=extra)
        except Exception as error:
            complain(tr("A handler of the log failed; the work goes on. {cause}", cause=error))

    def _found(self) -> "Logger | None":
        logging = sys.modules.get("logging")
        if logging is None or (make := getattr(logging, "getLogger", None)) is None:
            return None  # no listener, or another thread is importing logging just now
        root: Logger = make(ROOT)
        if not any(isinstance(one, logging.NullHandler) for one in root.handlers):
            root.addHandler(logging.NullHandler())  # otherwise warnings go to standard error
        found: Logger = make(self._package)
        self._logger = found
        return found


def complain(sentence: str) -> None:
    """Write a warning to standard error, once a process; failures here are ignored.

    Args:
        sentence: What; the same is not said twice.
    """
    if sentence in _told or sys.stderr is None:
        return
    _told.add(sentence)
    with suppress(Exception):  # the console may be gone, or unable to write the text
        sys.stderr.write(f"{sentence}\n")
