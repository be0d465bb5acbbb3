"""From a URL to an open transport.

Media that this package brings stand in a table and are imported when they are named; all
others, the bundled simulators among them, are found by the name of their full scheme in the
entry-point group ``robolink.transports``.
"""

from importlib import import_module
from typing import Protocol, cast

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.timing import Clock
from robolink.transport._base import Transport
from robolink.transport._url import LinkUrl, parse_url

TRANSPORTS_GROUP = "robolink.transports"

_MEDIA = {"tcp": ("robolink.transport._tcp", "open_tcp")}


class TransportOpener(Protocol):
    """What a medium, or an entry point of the group, provides."""

    def __call__(self, url: LinkUrl, *, timeout_s: float, clock: Clock | None) -> Transport:
        """Open a transport to ``url`` within ``timeout_s``."""


def open_transport(
    url: str | LinkUrl, *, timeout_s: float = 3.0, clock: Clock | None = None
) -> Transport:
    """Open a transport to a controller.

    Args:
        url: For example ``epson+tcp://192.168.0.1:5000``.
        timeout_s: Longest wait for the connection.
        clock: Replaces the machine's clock; a simulator brings its own.

    Raises:
        ConfigError: The URL is wrong, or nothing knows its scheme.
        ConnectError: No connection could be made.
    """
    link = parse_url(url) if isinstance(url, str) else url
    return _find(link)(link, timeout_s=timeout_s, clock=clock)


def _find(link: LinkUrl) -> TransportOpener:
    if link.medium in _MEDIA:
        module, name = _MEDIA[link.medium]
        return cast(TransportOpener, getattr(import_module(module), name))
    from importlib import metadata  # costs more than all of this package; TCP needs none of it

    found = metadata.entry_points(group=TRANSPORTS_GROUP, name=link.scheme)
    if not found:
        known = {f"{link.kind}+{medium}" for medium in _MEDIA}
        known |= metadata.entry_points(group=TRANSPORTS_GROUP).names
        raise ConfigError(
            tr("Nothing here knows how to reach {scheme!r}.", scheme=link.scheme),
            remedy=tr("Known are: {known}.", known=", ".join(sorted(known))),
        )
    try:
        return cast(TransportOpener, next(iter(found)).load())
    except (ImportError, AttributeError) as error:
        raise ConfigError(
            tr(
                "What reaches {scheme!r} cannot be loaded: {cause}.",
                scheme=link.scheme,
                cause=error,
            ),
            remedy=tr("Install robolink again, or the package that brings this scheme."),
        ) from error
