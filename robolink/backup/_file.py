"""A backup as a file: plain JSON that can be read by eye.

One line holds one tool, so that two files can be compared with any text tool. Reading is
strict: what is missing, unknown or not a number is refused by its place in the file, because
a file that is half understood would be half restored.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Final

from robolink.backup._reading import JsonReader
from robolink.backup._values import COMPONENTS, TOOLS, Backup, ToolState
from robolink.errors import ConfigError
from robolink.files.named import read_named, save_named
from robolink.messages import tr
from robolink.model import ControllerFacts, ToolOffset

SCHEMA: Final = "robolink/backup/1"

_LONGEST: Final = 1_000_000
_FAMILY: Final = "robolink/backup/"


def save(backup: Backup, path: Path, *, replace: bool = False) -> None:
    """Write ``backup``; the file is whole and on the disk when this returns.

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
    tools = {str(tool): _plain(backup.state.tools[tool]) for tool in TOOLS}
    members = {
        "schema": json.dumps(SCHEMA),
        "saved_at": json.dumps(backup.saved_at),
        "robolink_version": json.dumps(backup.robolink_version),
        "controller": json.dumps(backup.controller),
        "facts": _block(asdict(backup.facts)),
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
                "{source}: schema is {schema!r}, a newer form than {own!r}.",
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


def _plain(offset: ToolOffset | None) -> dict[str, float] | None:
    if offset is None:
        return None
    return dict(zip(COMPONENTS, offset.components(), strict=True))


def _block(members: Mapping[str, object]) -> str:
    lines = [f'    "{name}": {json.dumps(value)}' for name, value in members.items()]
    return "{\n" + ",\n".join(lines) + "\n  }"
