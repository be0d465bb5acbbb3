"""Who only looks, beside a process of this computer that has the controller."""

from dataclasses import asdict

from robolink.errors import RobolinkError
from robolink.messages import tr

_SEVERAL_CLIENTS = "+modbus-tcp://"
"""Such a server can be asked itself, by as many as want."""


def seen_by_another(url: str) -> dict[str, object] | None:
    """Return the document of what the holder of a controller saw last.

    ``None`` where nobody on this computer has it, where its holder lets nobody look, and where
    the controller serves several clients. The controller is not asked: it serves one client, and
    that one is at work.

    Args:
        url: The controller.
    """
    if _SEVERAL_CLIENTS in url or "+sim://" in url:
        return None
    from robolink.stopping import HolderGoneError, far_end_of, holders_of

    try:
        holders = list(holders_of(far_end_of(url)))
    except RobolinkError:
        return None  # what is wrong with the URL is told by who connects
    for holder in holders:
        try:
            seen = holder.last_seen()
        except HolderGoneError:
            continue
        flags = {} if seen is None else asdict(seen.status)
        return {
            "controller": url.partition("?")[0],
            "held_by": holder.who or tr("process {pid}", pid=holder.pid),
            "pid": holder.pid,
            "age_s": None if seen is None else round(seen.age_s, 3),
            "state": None if seen is None else str(seen.status.state),
            **flags,
        }
    return None
