"""--record FILE: the dialogue with the controller, kept as it happens."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from robolink.errors import ConfigError
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.transport import TraceSink


@contextmanager
def recording(path: str | None, controller: str) -> "Iterator[TraceSink | None]":
    """Append the traffic of the connection to a file, line by line, without the login.

    Appended, so that a morning of commands makes one recording, which is replayed in the
    same order.

    Args:
        path: The file; ``None`` records nothing.
        controller: Identity of the far end.

    Raises:
        ConfigError: The file cannot be written.
    """
    if path is None:
        yield None
        return
    from robolink.files.named import append_to_named
    from robolink.timing import wall_label
    from robolink.transport import DialogueLog, Direction, opening_line, passage_line

    log = DialogueLog(controller, wall_label())
    try:
        file = append_to_named(Path(path))
    except OSError as error:
        raise _unwritable(path, error) from error

    def write(line: str) -> None:
        # Flushed at once: the lines before a crash matter most.
        try:
            file.write(f"{line}\n")
            file.flush()
        except OSError as error:
            raise _unwritable(path, error) from error

    def keep(at_ns: int, direction: Direction, data: bytes) -> None:
        write(passage_line(log.keep(at_ns, direction, data)))

    try:
        write(opening_line(log.dialogue))
        yield keep
    finally:
        with suppress(OSError):  # a full disk was reported already, and does not end a change
            file.close()


def _unwritable(path: str, error: OSError) -> ConfigError:
    return ConfigError(
        tr("The recording {path} cannot be written: {cause}.", path=path, cause=error.strerror),
        remedy=tr("Nothing was sent. Choose another file."),
    )
