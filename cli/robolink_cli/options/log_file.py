"""--log-file and --log-level: robolink's decisions and traffic in a file, for any command.

The file is opened before a command does anything, and one that cannot be written refuses it; but
for a stop, which neither waits for a log nor fails because of one: what it sent is logged
afterwards. Nothing of it is imported where no log is wanted.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from robolink.errors import ConfigError
from robolink.messages import known_names, tr
from robolink.package_log import PackageLog
from robolink_cli.console.render import LOG_LEVELS

if TYPE_CHECKING:
    from robolink.transport import Direction
    from robolink_cli.options.log_handler import LogFile

USUAL: Final = "info"

_LOGGERS: Final = ("robolink", "robolink_cli", "robolink_simulators")

_LOG: Final = PackageLog("robolink_cli")

_opened: "list[LogFile]" = []


def open_log_file(path: str, level: str) -> None:
    """Append what is logged from here on to a file.

    Args:
        path: The file.
        level: Its level; empty for the usual one.

    Raises:
        ConfigError: The file cannot be written, none is named, or there is no such level.
    """
    if not path:
        raise ConfigError(
            tr(
                "{option} says how much a log holds, and no log was asked for.",
                option="--log-level",
            ),
            remedy=tr("Give --log-file FILE too."),
        )
    if level and level not in LOG_LEVELS:
        raise ConfigError(
            tr("{level!r} is not a level of a log.", level=level),
            remedy=known_names(LOG_LEVELS),
        )
    import logging

    from robolink_cli.options.log_handler import LogFile

    try:
        handler = LogFile(path)
    except OSError as error:
        raise ConfigError(
            tr(
                "The log {path} cannot be written: {cause}.",
                path=path,
                cause=error.strerror or error,
            ),
            remedy=tr("Nothing was sent. Choose another file, or leave --log-file out."),
        ) from error
    handler.setLevel((level or USUAL).upper())
    for name in _LOGGERS:
        logger = logging.getLogger(name)
        handler.levels[name] = logger.level
        logger.setLevel(min(handler.level, logger.level or handler.level))
        logger.addHandler(handler)
    _opened.append(handler)


def close_logs(*, beyond: int = 0, code: int | None = None) -> None:
    """Close the logs that were opened, the last one first.

    Args:
        beyond: As many stay open.
        code: How the command ended.
    """
    if code is not None and len(_opened) > beyond:
        _LOG.decided(f"ended: exit code {code}", controller="robolink", request="")
    while len(_opened) > beyond:
        _close(_opened.pop())


def logs_open() -> int:
    """Return how many logs are open."""
    return len(_opened)


def began(command: str, path: str, level: str) -> None:
    """Open the log of a command.

    Raises:
        ConfigError: As :func:`open_log_file`.
    """
    open_log_file(path, level)
    _LOG.decided(f"began: {command}", controller="robolink", request="")


def log_afterwards(
    path: str, level: str, heard: "Sequence[tuple[int, Direction, bytes]]", sentence: str, url: str
) -> str:
    """Log what a stop sent and how it ended, once it is over.

    Returns:
        Why that was not possible; empty where it was.
    """
    if not (path or level):
        return ""
    from robolink.transport.traffic import as_logged

    before = len(_opened)
    try:
        open_log_file(path, level)
        try:
            wire = PackageLog("robolink.transport")
            for _, direction, data in heard:
                text = f"{direction} {as_logged(data)} (logged after the stop)"
                wire.passed(text, controller=url, request="stop", direction=direction)
            _LOG.decided(sentence, controller=url, request="stop")
        finally:
            close_logs(beyond=before)
    except ConfigError as error:
        return error.what
    return ""


def _close(handler: "LogFile") -> None:
    import logging

    for name in _LOGGERS:
        logger = logging.getLogger(name)
        logger.removeHandler(handler)
        logger.setLevel(handler.levels[name])
    handler.close()
