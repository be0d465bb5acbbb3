"""That a person compared a map's values with what the HMI shows: kept for one map at one PLC.

Without a probe in the PLC nothing else tells a right map from a shifted one, or one word
order from the other. A file that was changed is another map. A PLC is the one that its own
number names, where the map has that, else the one at its resolved address: by another spelling of
its host it is the same, and with a number another one in its place is not.
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.files.durable import file_name, make_folder, state_folder, sync_folder, write_whole
from robolink.messages import tr
from robolink.register_maps._map import RegisterMap
from robolink.timing import wall_label

_FORMAT: Final = "robolink/plc-map-confirmation/1"


@dataclass(frozen=True, slots=True)
class Confirmation:
    """Who confirmed a map.

    Attributes:
        by: Name or badge.
        at: Wall-clock label, ISO 8601 UTC.
        compared: What was compared, in words.
    """

    by: str
    at: str
    compared: str


def confirmation_of(identity: str, register_map: RegisterMap) -> Confirmation | None:
    """Return who confirmed this very map at this PLC, ``None`` when nobody did.

    A record that cannot be read confirms nothing.

    Args:
        identity: The PLC's name, never a URL: see :class:`robolink.model.Identity`.
        register_map: The map.
    """
    try:
        document = json.loads(_path(identity, register_map).read_bytes())
        if (document["schema"], document["controller"]) != (_FORMAT, identity):
            return None
        return Confirmation(document["by"], document["at"], document["compared"])
    except (OSError, ValueError, KeyError, RecursionError, TypeError):
        return None


def confirm(identity: str, register_map: RegisterMap, *, by: str, compared: str) -> Confirmation:
    """Put on record that a person found this map right at this PLC.

    Args:
        identity: The PLC's name, never a URL: see :class:`robolink.model.Identity`.
        register_map: The map.
        by: Name or badge of the person.
        compared: What was compared, in words.

    Raises:
        ConfigError: It cannot be stored.

    Example:
        >>> from robolink.register_maps import confirm, confirmation_of, load_map
        >>> from robolink_simulators.testkit.recipes import written_map
        >>> from pathlib import Path
        >>> register_map = load_map(written_map(Path.cwd()))
        >>> made = confirm("plc-7", register_map, by="K. Sato", compared="tool 1 with the HMI")
        >>> confirmation_of("plc-7", register_map).by
        'K. Sato'
    """
    made = Confirmation(by, wall_label(), compared)
    path = _path(identity, register_map)
    document = {
        "schema": _FORMAT,
        "controller": identity,
        "map": register_map.name,
        "map_sha256": register_map.sha256,
        **asdict(made),
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


def revoke(identity: str, register_map: RegisterMap) -> Confirmation | None:
    """Take back that a map is right, because a comparison showed that it is not.

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


def _path(identity: str, register_map: RegisterMap) -> Path:
    return state_folder("plc-maps") / file_name(f"{identity} {register_map.sha256}")
