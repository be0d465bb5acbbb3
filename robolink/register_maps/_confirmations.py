"""A person's comparison of a map's values with the HMI: kept for one map at one PLC.

Nothing else tells a right map from one with two components exchanged. A file that was changed is
another map. A PLC is the one that its own
number names, where the map has that, else the one at its resolved address: by another spelling of
its host it is the same, and with a number another one in its place is not.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.files.durable import file_name, make_folder, state_folder, sync_folder, write_whole
from robolink.messages import tr
from robolink.register_maps._comparisons import (
    ComparedValue,
    MapValue,
    component_known,
    tool_known,
    values_of,
)
from robolink.register_maps._places import AnyMap
from robolink.timing import wall_label

_FORMAT: Final = "robolink/plc-map-confirmation/2"


@dataclass(frozen=True, slots=True)
class Confirmation:
    """What was compared of one map at one PLC.

    Attributes:
        by: Name or badge of whoever compared last.
        at: Wall-clock label of that, ISO 8601 UTC.
        compared: What was compared, by value.
    """

    by: str
    at: str
    compared: Mapping[MapValue, ComparedValue] = field(hash=False)

    def knows_tool(self, tool: int) -> bool:
        """Whether a comparison showed that this tool's place is not another tool's."""
        return tool_known(self.compared, tool)

    def missing(self, register_map: AnyMap) -> list[MapValue]:
        """Return the values that may not be changed yet."""
        return [
            value
            for value in values_of(register_map)
            if not self.knows_tool(value.tool)
            or not component_known(register_map, self.compared, value)
        ]


def confirmation_of(identity: str, register_map: AnyMap) -> Confirmation | None:
    """Return what was compared of this very map at this PLC, ``None`` for nothing.

    A record that cannot be read confirms nothing, and neither does one of the first format, in
    which one value stood for all.

    Args:
        identity: The PLC's name, never a URL: see :class:`robolink.model.Identity`.
        register_map: The map.
    """
    try:
        document = json.loads(_path(identity, register_map).read_bytes())
        if (document["schema"], document["controller"]) != (_FORMAT, identity):
            return None
        compared = [_comparison(one) for one in document["compared"]]
        if not compared or any(one.value not in values_of(register_map) for one in compared):
            return None
        return Confirmation(document["by"], document["at"], {one.value: one for one in compared})
    except (OSError, ValueError, KeyError, RecursionError, TypeError):
        return None


def confirm(
    identity: str, register_map: AnyMap, *, by: str, compared: Iterable[ComparedValue]
) -> Confirmation:
    """Record that a person found values of this map right at this PLC.

    What was on record before stays.

    Args:
        identity: The PLC's name, never a URL: see :class:`robolink.model.Identity`.
        register_map: The map.
        by: Name or badge of the person.
        compared: What was compared: :func:`compare` and :func:`compare_test` make it.

    Raises:
        ConfigError: It cannot be stored.

    Example:
        >>> from robolink.register_maps import (
        ...     MapValue, compare, confirm, confirmation_of, load_map
        ... )
        >>> from robolink_simulators.testkit.operator import written_map
        >>> from pathlib import Path
        >>> register_map, x = load_map(written_map(Path.cwd())), MapValue(1, "x")
        >>> made = compare(register_map, {x: 12.5}, x, "12.50")
        >>> made = confirm("plc-7", register_map, by="K. Sato", compared=[made])
        >>> held = confirmation_of("plc-7", register_map)
        >>> held.by, MapValue(1, "y") in held.missing(register_map)
        ('K. Sato', True)
    """
    held = confirmation_of(identity, register_map)
    together = {**(held.compared if held else {}), **{one.value: one for one in compared}}
    made = Confirmation(by, wall_label(), together)
    path = _path(identity, register_map)
    document = {
        "schema": _FORMAT,
        "controller": identity,
        "map": register_map.name,
        "map_sha256": register_map.sha256,
        "by": made.by,
        "at": made.at,
        "compared": [{**asdict(one), "value": str(one.value)} for one in together.values()],
    }
    try:
        make_folder(path.parent)
        write_whole(path, json.dumps(document, indent=2).encode())
        sync_folder(path.parent)
    except OSError as error:
        raise ConfigError(
            tr("{path} cannot be written: {cause}.", path=path, cause=error.strerror or error),
            remedy=tr("The map stays unconfirmed. Make room or give access, then try again."),
        ) from error
    return made


def revoke(identity: str, register_map: AnyMap) -> Confirmation | None:
    """Withdraw the confirmation of a map, because a comparison showed that it is wrong.

    Returns:
        Who had confirmed it, ``None`` when nobody had.

    Raises:
        ConfigError: The record cannot be removed.
    """
    held, path = confirmation_of(identity, register_map), _path(identity, register_map)
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise ConfigError(
            tr("{path} cannot be removed: {cause}.", path=path, cause=error.strerror or error),
            remedy=tr("Remove it by hand: it says that a wrong map is right."),
        ) from error
    return held


def _path(identity: str, register_map: AnyMap) -> Path:
    return state_folder("plc-maps") / file_name(f"{identity} {register_map.sha256}")


def _comparison(plain: Mapping[str, object]) -> ComparedValue:
    tool, _, component = str(plain["value"]).partition(".")
    return ComparedValue(
        MapValue(int(tool), component),
        str(plain["shown"]),
        tells_component=plain["tells_component"] is True,
        tells_tool=plain["tells_tool"] is True,
    )
