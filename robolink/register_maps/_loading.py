"""From a file to a map, or to everything that is wrong in it."""

import hashlib
from pathlib import Path
from typing import Final

from robolink.files.toml import FileKind, Problem
from robolink.messages import tr
from robolink.register_maps._map import RegisterMap
from robolink.register_maps._problems import problems_of

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
