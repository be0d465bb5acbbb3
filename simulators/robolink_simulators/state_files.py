"""What a simulated controller keeps over a restart, as one small file."""

import json
from collections.abc import Mapping
from pathlib import Path

from robolink.errors import ConfigError
from robolink.files.durable import sync_folder, write_whole
from robolink.messages import tr


def save_state(path: Path, document: Mapping[str, object]) -> None:
    """Put a new state in the place of the old one; a crash leaves one of them whole.

    Its folder is made where there is none.

    Raises:
        ConfigError: It cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, json.dumps(document).encode())
        sync_folder(path.parent)
    except OSError as error:
        raise ConfigError(
            tr(
                "The simulator cannot save its state in {path}: {cause}.",
                path=path,
                cause=error.strerror or error,
            ),
            remedy=tr("Name a file in a folder that can be written."),
        ) from error
