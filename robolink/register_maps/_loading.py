"""From a file to a map, or to everything that is wrong in it."""

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from robolink.files.key_problems import is_not_known, sentence
from robolink.files.toml import FileKind, Problem
from robolink.messages import tr
from robolink.register_maps._map import RegisterMap

if TYPE_CHECKING:
    from pydantic import ValidationError


MAP_FILE: Final = FileKind(
    named=lambda path: tr("The PLC map {path}", path=path),
    unreadable_remedy=lambda: tr("docs/plc-maps.md shows what a map looks like. Nothing was sent."),
    wrong_remedy=lambda: tr("Correct it; docs/plc-maps.md explains every key. Nothing was sent."),
)


def load_map(path: Path) -> RegisterMap:
    """Return the map in a file.

    Raises:
        ConfigError: It cannot be read, is no TOML, or is wrong; every problem is told with
            its path.
    """
    register_map, problems = _checked(path)
    if register_map is None or problems:
        raise MAP_FILE.refusal(path, problems)
    return register_map


def check_map(path: Path) -> tuple[Problem, ...]:
    """Return everything that is wrong in a map; nothing when it is right.

    Raises:
        ConfigError: It cannot be read, or is no TOML.
    """
    return tuple(_checked(path)[1])


def _checked(path: Path) -> tuple[RegisterMap | None, list[Problem]]:
    from pydantic import ValidationError

    from robolink.register_maps._checks import problems_together
    from robolink.register_maps._resolving import Resolving
    from robolink.register_maps._tables import MapFile

    content = MAP_FILE.read(path)
    try:
        file = MapFile.model_validate(MAP_FILE.parse(path, content))
    except ValidationError as error:
        return None, problems_of(error)
    resolving = Resolving(file)
    register_map = resolving.resolve(hashlib.sha256(content).hexdigest())
    if register_map is None:
        return None, resolving.problems
    return register_map, problems_together(file, register_map)


_COMMIT_DEPTH: Final = 2
"""How deep pydantic's location goes before the kind of commit stands in it."""


def problems_of(error: "ValidationError") -> list[Problem]:
    """Return everything that pydantic objects to."""
    return [
        Problem(_path(detail["loc"]), _sentence(detail))
        for detail in error.errors(include_url=False, include_input=False)
    ]


def _path(location: Sequence[int | str]) -> str:
    steps = list(location)
    if len(steps) > _COMMIT_DEPTH and steps[0] == "commit":
        del steps[1]  # the kind of commit, which pydantic puts in and no file has
    path = ""
    for step in steps:
        joint = "." if path else ""
        path += f"#{step + 1}" if isinstance(step, int) else f"{joint}{step}"
    return path


def _sentence(detail: Any) -> str:  # noqa: ANN401 - pydantic's own form
    match detail["type"]:
        case "extra_forbidden":
            from robolink.register_maps._tables import KEYS

            return is_not_known(str(detail["loc"][-1]), sorted(KEYS))
        case "union_tag_invalid" | "union_tag_not_found":
            return tr("needs a kind: {kinds}", kinds="commit_bit, level, none")
        case "list_type":
            return tr("must be a list of tables")
        case "too_short":
            return tr("must not be empty")
        case "missing":
            return _missing(detail["loc"]) or sentence(detail)
    return sentence(detail)


def _missing(location: Sequence[int | str]) -> str:
    """Return what to write where a whole table is missing; empty for a key of a table."""
    match tuple(location):
        case ("schema",):
            return tr('is missing: begin the file with schema = "robolink/plc-map/1"')
        case ("tools",):
            return tr("is missing: write one [[tools]] table for each tool")
        case ("commit",):
            return tr(
                "is missing: write in [commit] how the PLC takes new values over: kind = "
                '"commit_bit", "level" or "none"'
            )
    return ""
