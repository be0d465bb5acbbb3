"""From a file to a map, or to everything that is wrong in it."""

import hashlib
from pathlib import Path

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.named_files import read_named
from robolink.register_maps._map import RegisterMap
from robolink.register_maps._problems import problems_of, refusal
from robolink.toml_files import NotTomlError, Problem, parse_toml


def load_map(path: Path) -> RegisterMap:
    """Return the map in a file.

    Raises:
        ConfigError: It cannot be read, is no TOML, or is wrong; every problem is told with
            its path.
    """
    register_map, problems = _checked(path)
    if register_map is None or problems:
        raise refusal(path, problems)
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

    content = _content(path)
    try:
        file = MapFile.model_validate(_document(path, content))
    except ValidationError as error:
        return None, problems_of(error)
    resolving = Resolving(file)
    register_map = resolving.resolve(hashlib.sha256(content).hexdigest())
    if register_map is None:
        return None, resolving.problems
    return register_map, problems_together(file, register_map)


def _content(path: Path) -> bytes:
    try:
        return read_named(path)
    except OSError as error:
        raise _unreadable(path, error.strerror or str(error)) from error


def _document(path: Path, content: bytes) -> dict[str, object]:
    try:
        return parse_toml(content)
    except NotTomlError as error:
        raise _unreadable(path, str(error)) from error


def _unreadable(path: Path, cause: str) -> ConfigError:
    return ConfigError(
        tr("The PLC map {path} cannot be read: {cause}.", path=path, cause=cause),
        remedy=tr("docs/plc-maps.md shows what a map looks like. Nothing was sent."),
    )
