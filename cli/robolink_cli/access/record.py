"""--record FILE: the dialogue with the controller, kept as it happens."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from robolink.errors import ConfigError
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.transport import TraceSink


@contextmanager
def recording(path: str | None, controller: str) -> "Iterator[TraceSink | None]":
    """Append what goes over the connection to a file, line by line, without the login.

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
        raise ConfigError(
            tr("The recording {path} cannot be written: {cause}.", path=path, cause=error.strerror),
            remedy=tr("Nothing was sent. Choose another file."),
        ) from error
    with file:

        def keep(at_ns: int, direction: Direction, data: bytes) -> None:
            # Flushed at once: what matters most is what came before a crash.
            file.write(passage_line(log.keep(at_ns, direction, data)) + "\n")
            file.flush()

        file.write(opening_line(log.dialogue) + "\n")
        yield keep
