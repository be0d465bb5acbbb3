"""A backup as a file: plain JSON that a person can read.

One line holds one tool, so that two files can be compared with any text tool. Reading is
strict: what is missing, unknown or not a number is refused by its place in the file, because
a file that is half understood would be half restored. The first backup of a controller is made by
itself, before the first write to it.
"""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final, NoReturn

from robolink.backup._comparison import (
    TOOLS,
    Backup,
    ToolHolder,
    ToolState,
    take_backup,
)
from robolink.errors import ConfigError, JournalError
from robolink.files.durable import file_name, make_folder, state_folder
from robolink.files.named import read_named, save_named
from robolink.messages import tr
from robolink.model import (
    COMPONENTS,
    ControllerFacts,
    EntryKind,
    NewEntry,
    ToolOffset,
    json_fields,
    json_value,
)


class JsonReader:
    """Reads one document.

    Args:
        source: What an error calls the file.
    """

    def __init__(self, source: str) -> None:
        self.source = source

    def document(self, text: str) -> object:
        """Return the document; duplicate names and NaN are refused.

        Raises:
            ConfigError: It is no JSON.
        """
        try:
            found: object = json.loads(
                text, object_pairs_hook=self._once, parse_constant=self._no_constant
            )
        except ConfigError:
            raise
        except (ValueError, RecursionError) as error:
            raise self.wrong(
                "", tr("it is not a robolink backup (not JSON: {cause})", cause=error)
            ) from error
        return found

    def members(self, value: object, path: str, names: Sequence[str]) -> dict[str, object]:
        """Return an object that has exactly these members, in this order."""
        if not isinstance(value, dict):
            raise self.wrong(path, tr("it is not an object in braces"))
        for name in value:
            if name not in names:
                raise self.wrong(_joined(path, name), tr("unknown name"))
        for name in names:
            if name not in value:
                raise self.wrong(_joined(path, name), tr("it is missing"))
        return {name: value[name] for name in names}

    def text(self, value: object, path: str) -> str:
        """Return a text."""
        if not isinstance(value, str):
            raise self.wrong(path, tr("{value!r} is not text", value=value))
        return value

    def texts(self, value: object, path: str) -> tuple[str, ...]:
        """Return a list of texts."""
        if not isinstance(value, list):
            raise self.wrong(path, tr("{value!r} is not a list", value=value))
        return tuple(self.text(item, f"{path}.{i}") for i, item in enumerate(value))

    def whole(self, value: object, path: str, lowest: int, highest: int) -> int:
        """Return a whole number in a range."""
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.wrong(path, tr("{value!r} is not a whole number", value=value))
        if not lowest <= value <= highest:
            raise self.wrong(
                path,
                tr(
                    "{value} is not from {lowest} to {highest}",
                    value=value,
                    lowest=lowest,
                    highest=highest,
                ),
            )
        return value

    def number(self, value: object, path: str) -> float:
        """Return a finite number."""
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.wrong(path, tr("{value!r} is not a number", value=value))
        try:
            found = float(value)
        except OverflowError:
            found = math.inf
        if not math.isfinite(found):
            raise self.wrong(path, tr("it is not a finite number"))
        return found

    def wrong(self, path: str, cause: str) -> ConfigError:
        """Return the error for one place of the file."""
        place = path or tr("the file")
        return ConfigError(
            tr("{source}: {place}: {cause}.", source=self.source, place=place, cause=cause),
            remedy=tr("Nothing was sent. Correct the file by hand, or use another backup."),
        )

    def _once(self, pairs: list[tuple[str, object]]) -> dict[str, object]:
        found: dict[str, object] = {}
        for name, value in pairs:
            if name in found:
                raise self.wrong(name, tr("it appears twice"))
            found[name] = value
        return found

    def _no_constant(self, constant: str) -> NoReturn:
        raise self.wrong("", tr("{constant} is not a number", constant=constant))


def _joined(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


SCHEMA: Final = "robolink/backup/1"

_LONGEST: Final = 1_000_000
_FAMILY: Final = "robolink/backup/"


def save(backup: Backup, path: Path, *, replace: bool = False) -> None:
    """Write ``backup``; on return the file is complete and on the disk.

    Args:
        backup: What is kept.
        path: Where.
        replace: Whether a file that is there may go.

    Raises:
        ConfigError: A file is there already and ``replace`` is not set, or it cannot be
            written. What was there is unchanged.

    Example:
        >>> from pathlib import Path
        >>> import robolink
        >>> from robolink.backup import load, save, take_backup
        >>> with robolink.connect("epson+sim://save-example") as controller:
        ...     save(take_backup(controller), Path("cell-5.json"))
        >>> load(Path("cell-5.json")).state.selected
        1
    """
    save_named(path, backup_to_text(backup).encode("ascii"), replace=replace)


def load(path: Path) -> Backup:
    """Read a backup file.

    Raises:
        ConfigError: It cannot be read, or it is no backup; names the place in the file.
    """
    try:
        text = read_named(path, most_bytes=_LONGEST).decode("utf-8-sig")
    except (OSError, UnicodeError) as error:
        cause = error.strerror if isinstance(error, OSError) else tr("it is not UTF-8 text")
        raise ConfigError(
            tr("The backup {path} cannot be read: {cause}.", path=path, cause=cause),
            remedy=tr("Name a file that 'robolink tool backup' wrote."),
        ) from error
    return backup_from_text(text, source=str(path))


def backup_to_text(backup: Backup) -> str:
    """Return the file's text, in ASCII."""
    tools = {str(tool): json_value(backup.state.tools[tool]) for tool in TOOLS}
    members = {
        "schema": json.dumps(SCHEMA),
        "saved_at": json.dumps(backup.saved_at),
        "robolink_version": json.dumps(backup.robolink_version),
        "controller": json.dumps(backup.controller),
        "facts": _block(json_fields(backup.facts)),
        "selected_tool": json.dumps(backup.state.selected),
        "tools": _block(tools),
    }
    lines = [f'  "{name}": {value}' for name, value in members.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def backup_from_text(text: str, *, source: str) -> Backup:
    """Read a file's text.

    Args:
        text: All of it.
        source: What an error calls it.

    Raises:
        ConfigError: It is no backup; names the place in the file.
    """
    read = JsonReader(source)
    document = read.document(text)
    _check_schema(read, document)
    names = ("schema", "saved_at", "robolink_version", "controller", "facts", "selected_tool")
    members = read.members(document, "", (*names, "tools"))
    tools = read.members(members["tools"], "tools", tuple(map(str, TOOLS)))
    return Backup(
        controller=read.text(members["controller"], "controller"),
        saved_at=read.text(members["saved_at"], "saved_at"),
        robolink_version=read.text(members["robolink_version"], "robolink_version"),
        facts=_facts(read, members["facts"]),
        state=ToolState(
            {int(tool): _offset(read, value, f"tools.{tool}") for tool, value in tools.items()},
            _selected(read, members["selected_tool"]),
        ),
    )


def _selected(read: JsonReader, value: object) -> int | None:
    return None if value is None else read.whole(value, "selected_tool", 0, TOOLS[-1])


def _check_schema(read: JsonReader, document: object) -> None:
    schema = document.get("schema") if isinstance(document, dict) else None
    if schema == SCHEMA:
        return
    version = schema.removeprefix(_FAMILY) if isinstance(schema, str) else ""
    if version != schema and version.isdecimal() and int(version) > 1:
        raise ConfigError(
            tr(
                "{source}: schema is {schema!r}, newer than {own!r}.",
                source=read.source,
                schema=schema,
                own=SCHEMA,
            ),
            remedy=tr("Use the robolink that wrote it, or a newer one."),
        )
    raise read.wrong("schema", tr("it is not {own!r}", own=SCHEMA))


def _facts(read: JsonReader, value: object) -> ControllerFacts:
    names = ControllerFacts.__dataclass_fields__
    members = read.members(value, "facts", tuple(names))
    number = members["robot_number"]

    def known(name: str) -> str | None:
        found = members[name]
        return None if found is None else read.text(found, f"facts.{name}")

    return ControllerFacts(
        controller_name=known("controller_name"),
        controller_type=known("controller_type"),
        controller_serial=known("controller_serial"),
        firmware=known("firmware"),
        project=known("project"),
        robot_number=None if number is None else read.whole(number, "facts.robot_number", 0, 99),
        robot_models=read.texts(members["robot_models"], "facts.robot_models"),
        robot_serials=read.texts(members["robot_serials"], "facts.robot_serials"),
    )


def _offset(read: JsonReader, value: object, path: str) -> ToolOffset | None:
    if value is None:
        return None
    members = read.members(value, path, COMPONENTS)
    return ToolOffset(*(read.number(members[name], f"{path}.{name}") for name in COMPONENTS))


def _block(members: Mapping[str, object]) -> str:
    lines = [f'    "{name}": {json.dumps(value)}' for name, value in members.items()]
    return "{\n" + ",\n".join(lines) + "\n  }"


def first_backup_path(identity: str) -> Path:
    """Return the path of a controller's first backup, in the user's state folder.

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
        JournalError: It cannot be stored. Nothing may be written then.
        NotReadyError: The tools cannot be read now.
    """
    if not controller.outcomes.durable:
        return None
    paths = _paths(controller)
    path = paths[0]
    if any(one.exists() for one in paths):
        return None
    backup = take_backup(controller)
    # Recorded before the file exists: a backup without an entry shows that the record was lost.
    verdict = tr("saved in {path}", path=path)
    controller.outcomes.append(NewEntry(EntryKind.BACKUP, verdict=verdict))
    try:
        make_folder(path.parent)
        save(backup, path)
    except (OSError, ConfigError) as error:
        raise JournalError(
            tr(
                "robolink cannot back up the tools in {path}: {cause}.",
                path=path,
                cause=error,
            ),
            remedy=tr("Nothing was written. Make it writable, or set ROBOLINK_STATE_DIR."),
            controller=controller.identity,
        ) from error
    tell(
        tr(
            "Before the first write to this controller, robolink saved its tools in {path}",
            path=path,
        )
    )
    return path


def kept_backup(controller: ToolHolder) -> Backup | None:
    """Return the backup of a controller from before the first write, read from its file.

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
    """Return where the backup may be, by every name of the controller, the present one first."""
    outcomes = controller.outcomes
    names = (outcomes.robot,) if outcomes.robot else outcomes.names
    return [first_backup_path(name) for name in names]
