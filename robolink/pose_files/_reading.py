"""A file as text, or a sentence that says why not."""

from pathlib import Path

from robolink.errors import ConfigError
from robolink.files.named import read_named
from robolink.messages import tr


def read_text(path: Path, *, encoding: str) -> str:
    """Return the text of a regular file; a thousand points take half a megabyte of at most 4.

    Raises:
        ConfigError: It cannot be read, is too large, or is not text in this encoding.
    """
    try:
        return read_named(path).decode(encoding)
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
