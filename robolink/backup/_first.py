"""The backup that is made by itself, before the first write to a controller."""

from collections.abc import Callable
from pathlib import Path

from robolink.backup._file import load, save
from robolink.backup._values import Backup, ToolHolder, take_backup
from robolink.errors import ConfigError
from robolink.files.durable import file_name, make_folder, state_folder
from robolink.messages import tr
from robolink.model import EntryKind, NewEntry


def first_backup_path(identity: str) -> Path:
    """Return where the first backup of a controller stands, in the user's state folder.

    Args:
        identity: Who the controller is, as its record calls it; not its URL.
    """
    return state_folder("backups") / file_name(identity)


def keep_first_backup(
    controller: ToolHolder, *, tell: Callable[[str], None] = lambda _sentence: None
) -> Path | None:
    """Save the tools of a controller that has no backup in the user's state folder yet.

    To be called before a tool is written. A simulator that dies with this process needs none.

    Args:
        controller: The controller, connected.
        tell: Told where it was saved, in a sentence.

    Returns:
        Where it was saved, ``None`` when that was done before.

    Raises:
        ConfigError: It cannot be stored. Nothing may be written then.
        NotReadyError: The tools cannot be read now.
    """
    if not controller.outcomes.durable:
        return None
    paths = _paths(controller)
    path = paths[0]
    if any(one.exists() for one in paths):
        return None
    backup = take_backup(controller)
    # Before it is there: a backup that is not on record is a sign that the record was lost.
    verdict = tr("saved in {path}", path=path)
    controller.outcomes.append(NewEntry(EntryKind.BACKUP, verdict=verdict))
    try:
        make_folder(path.parent)
        save(backup, path)
    except (OSError, ConfigError) as error:
        raise ConfigError(
            tr(
                "The tools as they are now cannot be saved in {path}: {cause}",
                path=path,
                cause=error,
            ),
            remedy=tr(
                "Nothing was written: the first write to a controller needs a backup. "
                "Make that folder writable, or name another one with "
                "ROBOLINK_STATE_DIR."
            ),
            controller=controller.identity,
        ) from error
    tell(
        tr(
            "Before the first write to this controller its tools were saved in {path}",
            path=path,
        )
    )
    return path


def kept_backup(controller: ToolHolder) -> Backup | None:
    """Return the backup of a controller that was made before the first write, read from its file.

    Args:
        controller: The controller, connected; it is not asked for its tools.

    Returns:
        ``None`` when there is none on this computer.

    Raises:
        ConfigError: There is one that cannot be read.
    """
    if not controller.outcomes.durable:
        return None
    path = next((one for one in _paths(controller) if one.exists()), None)
    return None if path is None else load(path)


def _paths(controller: ToolHolder) -> list[Path]:
    """Return where the backup may be, by every name of the controller, that of now first."""
    outcomes = controller.outcomes
    names = (outcomes.robot,) if outcomes.robot else outcomes.names
    return [first_backup_path(name) for name in names]
