"""How to reach a cell, whatever the rest of its settings is.

A stop may not be kept from the robot by a wrong key beside the URL. So of the cell files only the
address and the place of the password are read here, and where a file cannot be read at all, the
copy counts that the last successful connection left in the state folder.
"""

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Final
from urllib.parse import parse_qsl, urlencode

from robolink.config._files import config_files, read_document, whole_place
from robolink.errors import ConfigError
from robolink.files.durable import file_name, make_folder, state_folder, write_whole
from robolink.files.named import read_named
from robolink.messages import listed, tr
from robolink.model import PersonRole

_KIND = "cells"

PIN_KEY: Final = "server_certificate"
OPCUA_KEYS: Final = (PIN_KEY, "user")
"""Keys of a cell that are options of its URL: how an OPC UA server is known, and who logs in."""


@dataclass(frozen=True, slots=True)
class Expected:
    """What the cell files require even of a read-only look.

    Attributes:
        cell: The cell's name.
        tool: The tool that works there, ``None`` where nothing is said.
        robot: Model of its robot, ``None`` where nothing is said.
        robot_file: The file that names the robot; empty where none does.
        people: Who works there, with their roles; ``None`` where nobody is named.
    """

    cell: str
    tool: int | None = None
    robot: str | None = None
    robot_file: str = ""
    people: Mapping[str, PersonRole] | None = field(default=None, hash=False)


@dataclass(frozen=True, slots=True)
class Reach:
    """How to reach a cell.

    Attributes:
        url: The controller's URL.
        password_file: File whose first line is the password; empty for none.
        password_env: Environment variable that holds the password; empty for none.
        timeout_s: Longest wait for one answer; 0 where nothing is said.
        journal: Where its journal is; empty where nothing is said.
        home: The computer where alone it is changed; empty where nothing is said.
        proof: Of the cell files that were right as a whole when this was kept; empty for none.
        expected: What they say that a look has to heed; ``None`` where they were not right.
        doubt: What is wrong with the cell files, or with this; empty for nothing.
    """

    url: str
    password_file: str = ""
    password_env: str = ""
    timeout_s: float = 0.0
    proof: str = ""
    expected: Expected | None = None
    doubt: str = ""
    journal: str = ""
    home: str = ""


def address_with(url: str, said: Mapping[str, object]) -> str:
    """Return a cell's URL with what its file says beside it of an OPC UA server and its user.

    What the URL says itself stays: a file that says both is refused when it is read as a whole.

    Args:
        url: The cell's URL.
        said: The keys of the cell; those of :data:`OPCUA_KEYS` count.
    """
    if "+opcua://" not in url:
        return url
    given = dict(parse_qsl(url.partition("?")[2], keep_blank_values=True))
    more = {
        key: "".join(value.split()) if key == PIN_KEY else value
        for key in OPCUA_KEYS
        if key not in given and isinstance(value := said.get(key), str)
    }
    return f"{url}{'&' if given else '?'}{urlencode(more, safe=':')}" if more else url


def reach_cell(name: str) -> Reach:
    """Return how to reach the cell ``name``, from no more settings than that needs.

    Raises:
        ConfigError: No file says it, and no connection has left a copy.
    """
    doubts: list[str] = []
    said: dict[str, object] = {}
    of_all: dict[str, str] = {}
    for file in config_files():
        if not file.present:
            continue
        try:
            document = read_document(file.path)
            table = _table(document, name)
        except ConfigError as error:
            doubts.append(error.what)
            copy = _recall(name, file.path)
            table = asdict(copy) if copy else {}
            if copy:
                doubts.append(tr("The address is from the last connection: {url}.", url=copy.url))
        else:
            for key in ("password_file", "journal"):
                if isinstance(hinted := table.get(key), str):
                    table[key] = whole_place(hinted, file.path)
            of_all = _of_all(document, file.path) | of_all
        said = table | said
        if isinstance(table.get("url"), str):
            # Files with lower priority may refer to the robot at another address (``load_cells``).
            of_all = _of_farther(file.path) | of_all
            return Reach(
                url=address_with(str(said["url"]), said),
                password_file=_text(said, "password_file"),
                password_env=_text(said, "password_env"),
                doubt=" ".join(doubts),
                journal=_text(said, "journal") or of_all.get("journal", ""),
                home=_text(said, "home") or of_all.get("home", ""),
            )
    raise ConfigError(
        listed(tr("No address is known for the cell {name!r}:", name=name), doubts)
        if doubts
        else tr("No address is known for the cell {name!r}.", name=name),
        remedy=tr(
            "Give its URL in place of the name, for example -c epson+tcp://192.168.0.1:5000."
        ),
    )


def _of_all(document: dict[str, object], path: Path) -> dict[str, str]:
    """Return where a file says that all cells have their journal and their home."""
    said = {key: one for key in ("journal", "home") if isinstance(one := document.get(key), str)}
    return said | ({"journal": whole_place(said["journal"], path)} if "journal" in said else {})


def _of_farther(after: Path) -> dict[str, str]:
    """Return the same of files with lower priority, the nearest first; unreadable ones say nothing.

    Args:
        after: The file behind which they come.
    """
    places = [file.path for file in config_files() if file.present]
    said: dict[str, str] = {}
    for path in places[places.index(after) + 1 :]:
        with suppress(ConfigError):
            said = _of_all(read_document(path), path) | said
    return said


def glance_at_cell(name: str) -> Reach | None:
    """Return how to reach a cell if its files were right before and have not changed.

    A look need not wait for pydantic to check them anew.
    """
    proof = proof_of_files()
    for file in config_files():
        copy = _recall(name, file.path) if file.present else None
        if copy is not None and proof and copy.proof == proof and copy.expected is not None:
            return copy
    return None


def proof_of_files() -> str:
    """Return a value that changes with any byte of any cell file; empty if one is unreadable."""
    digest = sha256()
    try:
        for file in config_files():
            if file.present:
                content = read_named(file.path)
                digest.update(f"{file.path} {len(content)} ".encode() + content)
    except OSError:
        return ""
    return digest.hexdigest()


def remember_reach(name: str, origin: Path, reach: Reach) -> None:
    """Keep how a cell was reached, for when its file cannot be read.

    Args:
        name: The cell.
        origin: The file that gave its URL; the same name may mean another cell elsewhere.
        reach: How it was reached. Nothing secret is in it.

    Example:
        >>> from pathlib import Path
        >>> from robolink.config import Reach, reach_cell, remember_reach
        >>> reach = Reach("epson+tcp://192.168.0.1:5000")
        >>> remember_reach("line3", Path("robolink.toml").resolve(), reach)
    """
    kept = asdict(reach) | {"doubt": ""}
    path = _copy_of(name, origin)
    # The copy is a convenience: a failure to write it is reported when the copy is needed.
    with suppress(OSError):
        if _read(path) != kept:
            make_folder(path.parent)
            write_whole(path, json.dumps(kept).encode())


def _recall(name: str, origin: Path) -> Reach | None:
    kept = _read(_copy_of(name, origin))
    if kept is None or not isinstance(kept.get("url"), str):
        return None
    timeout_s = kept.get("timeout_s")
    return Reach(
        str(kept["url"]),
        password_file=_text(kept, "password_file"),
        password_env=_text(kept, "password_env"),
        timeout_s=timeout_s if isinstance(timeout_s, float) else 0.0,
        proof=_text(kept, "proof"),
        expected=_recalled_expected(kept.get("expected")),
        journal=_text(kept, "journal"),
        home=_text(kept, "home"),
    )


def _recalled_expected(kept: object) -> Expected | None:
    """Return what was kept of the cell file; ``None`` if an earlier version kept nothing."""
    try:
        found = Expected(**kept)  # type: ignore[arg-type]
        people = found.people
        if people is None:
            return found
        return replace(found, people={name: PersonRole(role) for name, role in people.items()})
    except (TypeError, ValueError, AttributeError):
        return None


def _copy_of(name: str, origin: Path) -> Path:
    return state_folder(_KIND) / file_name(f"{name} {origin.absolute()}")


def _read(path: Path) -> dict[str, object] | None:
    try:
        kept = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    return kept if isinstance(kept, dict) else None


def _table(document: dict[str, object], name: str) -> dict[str, object]:
    cells = document.get("cells")
    table = cells.get(name) if isinstance(cells, dict) else None
    return dict(table) if isinstance(table, dict) else {}


def _text(said: dict[str, object], key: str) -> str:
    value = said.get(key)
    return value if isinstance(value, str) else ""
