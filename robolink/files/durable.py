"""Files that are whole and durable, and where robolink keeps its own."""

import os
import re
from collections.abc import Iterable
from pathlib import Path

from robolink import runtime


def state_folder(kind: str) -> Path:
    """Return the folder for one kind of record.

    It stands in ROBOLINK_STATE_DIR or, without that, in the user's state folder for robolink.
    """
    base = os.environ.get("ROBOLINK_STATE_DIR")
    if base:
        return Path(base) / kind
    from platformdirs import user_state_path

    return user_state_path("robolink", appauthor=False) / kind


def file_name(identity: str) -> str:
    """Return a readable file name that is legal everywhere, and of this identity only."""
    from hashlib import sha256

    readable = re.sub(r"[^A-Za-z0-9.]+", "-", identity).strip("-.")[:60]
    # A name may contain characters that no encoding has; its digest must still be the same.
    digest = sha256(identity.encode(errors="surrogatepass")).hexdigest()
    return f"{readable or 'controller'}-{digest[:16]}.json"


def make_folder(folder: Path) -> None:
    """Make a folder that only its owner may read, if it is missing.

    Raises:
        OSError: It cannot be made.
    """
    if not folder.is_dir():
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        sync_folder(folder.parent)


def write_whole(
    path: Path, data: bytes | Iterable[bytes], *, replace: bool = True, mode: int = 0o600
) -> None:
    """Write ``data`` to ``path``, whole and on the disk, or leave everything as it was.

    The rename is durable after :func:`sync_folder`.

    Args:
        path: Where; its folder exists.
        data: All of the file, in one piece or in several.
        replace: Whether a file that is there already may go.
        mode: Who may read and write it, before the process's umask.

    Raises:
        FileExistsError: It is there already and may not go.
        OSError: It cannot be written.
    """
    draft = path.with_name(f".{runtime.random_bytes(16).hex()}.new")
    try:
        descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
        with open(descriptor, "wb") as file:
            file.writelines([data] if isinstance(data, bytes) else data)
            file.flush()
            os.fsync(descriptor)
        if replace:
            os.replace(draft, path)
        else:
            _put_beside(draft, path)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise


def sync_folder(folder: Path) -> None:
    """Make a rename in ``folder`` durable; Windows cannot open folders and needs not."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _put_beside(draft: Path, path: Path) -> None:
    """Rename ``draft`` without ever replacing another file."""
    try:
        os.link(draft, path)
    except FileExistsError:
        raise
    except OSError:
        # A memory stick has no hard links; there, check whether the file exists.
        if path.exists():
            raise FileExistsError(f"{path} exists") from None
        os.replace(draft, path)
    else:
        draft.unlink()
