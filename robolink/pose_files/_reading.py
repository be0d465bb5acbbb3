"""A file as text, or a sentence that says why not."""

from pathlib import Path

from robolink.errors import ConfigError
from robolink.messages import tr

_MAX_BYTES = 4_000_000
"""A thousand points take half a megabyte; more than this is not a file of poses."""


def read_text(path: Path, *, encoding: str) -> str:
    """Return the text of a file of at most 4 MB.

    Raises:
        ConfigError: It cannot be read, is too large, or is not text in this encoding.
    """
    try:
        with path.open("rb") as file:
            data = file.read(_MAX_BYTES + 1)
        if len(data) > _MAX_BYTES:
            raise unusable(path, tr("it is larger than 4 MB"))
        return data.decode(encoding)
    except OSError as error:
        raise unusable(path, error.strerror or str(error)) from error
    except UnicodeDecodeError as error:
        raise unusable(path, tr("it is not UTF-8 text")) from error


def unusable(path: Path, why: str) -> ConfigError:
    """Return the error for a file that cannot be used."""
    return ConfigError(
        tr("{path} cannot be used: {why}.", path=path, why=why),
        remedy=tr("Nothing was sent. Correct the file or name another one."),
    )
