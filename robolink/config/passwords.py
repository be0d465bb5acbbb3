"""Where the controller's password comes from. Never from the command line or a URL."""

import os
import sys
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from robolink.errors import ConfigError
from robolink.files.named import OthersMayReadError, read_named
from robolink.messages import tr
from robolink.model import Secret

KEYRING_SERVICE = "robolink"
_MOST_BYTES = 100_000


def find_password(
    identity: str,
    *,
    password_file: str | None = None,
    cell_file: str | None = None,
    cell_variable: str | None = None,
) -> Secret | None:
    """Return the password for a controller, None when there is none.

    The first that has one wins: the system's keyring (service ``robolink``, user
    ``identity``); a file; the environment.

    Args:
        identity: The controller's URL without options.
        password_file: File given on the command line. ROBOLINK_PASSWORD_FILE comes after it.
        cell_file: File that the cell file names; it comes last of the files.
        cell_variable: Variable that the cell file names, in place of ROBOLINK_PASSWORD: what
            stands there may be another cell's password.

    Raises:
        ConfigError: The file cannot be read, is no regular file or is too long, or others than
            its owner may read it; or the keyring failed, and nothing else has one.
    """
    path = password_file or os.environ.get("ROBOLINK_PASSWORD_FILE") or cell_file
    try:
        stored = from_keyring(identity)
    except ConfigError:
        if (elsewhere := from_places(path, cell_variable)) is None:
            raise
        return elsewhere
    return from_places(path, cell_variable) if stored is None else stored


def from_places(path: str | None, variable: str | None) -> Secret | None:
    """Return the password from a file or else from the environment, None if neither has one.

    Args:
        path: The file, if one is named.
        variable: The variable, in place of ROBOLINK_PASSWORD.

    Raises:
        ConfigError: The file cannot be read, is no regular file or is too long, or others than
            its owner may read it.
    """
    if path:
        return _from_file(Path(path))
    value = os.environ.get(variable or "ROBOLINK_PASSWORD")
    return None if value is None else Secret(value)


def from_keyring(identity: str) -> Secret | None:
    """Return the password in the system's keyring, None if it has none.

    Raises:
        ConfigError: The keyring failed in a way of its own, of D-Bus for example.
    """
    if "keyring" not in sys.modules and not _keyring_is_installed():
        return None
    try:
        import keyring
        from keyring.errors import KeyringError
    except ImportError:
        return None
    try:
        value = keyring.get_password(KEYRING_SERVICE, identity)
    except KeyringError:
        # No keyring service, or a locked one, as on most cell computers: the other sources
        # are used; without any, the controller itself reports that it needs a password.
        return None
    except Exception as error:
        cause = f"{type(error).__name__}: {error}"
        raise ConfigError(
            tr("The system's keyring failed: {cause}.", cause=cause),
            remedy=tr(
                "Repair it, or give the password in a file. To use no keyring, set "
                "PYTHON_KEYRING_BACKEND to keyring.backends.null.Keyring."
            ),
        ) from error
    return None if value is None else Secret(value)


@cache
def _keyring_is_installed() -> bool:
    """Whether it is, looked for once: a check of many cells asks for the password of each."""
    return find_spec("keyring") is not None


def _from_file(path: Path) -> Secret:
    try:
        lines = read_named(path, most_bytes=_MOST_BYTES, secret=True).splitlines()
        return Secret(lines[0].decode("utf-8-sig") if lines else "")
    except OthersMayReadError as error:
        raise ConfigError(
            tr("Other users may read the password file {path}.", path=path),
            remedy=tr("Run: chmod 600 {path}", path=path),
        ) from error
    except (OSError, UnicodeError) as error:
        # The cause of a UnicodeError would show bytes of the password.
        cause = error.strerror if isinstance(error, OSError) else tr("it is not UTF-8 text")
        raise ConfigError(
            tr("The password file {path} cannot be read: {cause}.", path=path, cause=cause),
            remedy=tr("Give a file whose first line is the password and nothing else."),
        ) from (error if isinstance(error, OSError) else None)
