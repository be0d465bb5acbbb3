"""From a URL with ``map=`` to a PLC whose probe was compared."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from robolink.controllers.plc_map.controller import PlcMapController
from robolink.controllers.registry import ConnectionTerms
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Controller, OutcomeLog
from robolink.register_maps import RegisterMap, load_map
from robolink.timing import Clock
from robolink.transport import LinkUrl, open_modbus
from robolink.ways import Way, way


def open_plc_map_url(url: LinkUrl, terms: ConnectionTerms, /) -> Controller:
    """Connect to the PLC at a URL; see :class:`~robolink.controllers.ControllerOpener`.

    Raises:
        ConfigError: The dialogue was to be recorded; and as :func:`open_plc_map`.
        RobolinkError: As :func:`open_plc_map`.
    """
    if terms.trace is not None:
        raise ConfigError(
            tr("The dialogue with a PLC's registers cannot be recorded."),
            remedy=tr(
                "Leave {record} out; a network capture shows the registers.",
                record=way(Way.RECORD),
            ),
        )
    return open_plc_map(url, outcomes=terms.record_at, timeout_s=terms.timeout_s, clock=terms.clock)


def open_plc_map(
    url: LinkUrl,
    *,
    outcomes: Callable[[str], OutcomeLog],
    timeout_s: float = 3.0,
    clock: Clock | None = None,
    compare_probe: bool = True,
) -> PlcMapController:
    """Open ``plc+modbus-tcp://host?map=machine.toml`` and compare the probe, if there is one.

    Args:
        url: ``map`` names the map, seen from the working folder; the other options are those
            of a Modbus client (docs/plc-links.md).
        outcomes: Opens the record of the PLC whose identity it is given.
        timeout_s: Longest wait for the connection, and for each answer.
        clock: Replaces the machine's clock.
        compare_probe: Whether to; what looks at a map that is not right yet does without.

    Raises:
        ConfigError: The URL, an option or the map is wrong.
        ConnectError: No connection.
        RemoteProtocolError: The probe differs; says what the map should say.
    """
    register_map, url = _with_map(url)
    client = open_modbus(url, timeout_s=timeout_s, clock=clock)
    try:
        controller = PlcMapController(client, register_map, outcomes(client.identity))
    except BaseException:
        client.close()
        raise
    try:
        if compare_probe:
            controller.require_probe()
    except BaseException:
        controller.close()
        raise
    return controller


def _with_map(url: LinkUrl) -> tuple[RegisterMap, LinkUrl]:
    """Return the map that a URL names, and the URL of the client without it."""
    options = dict(url.options)
    file = options.pop("map", "")
    if not file:
        raise ConfigError(
            tr("The option map is missing in the {scheme} URL.", scheme=url.scheme),
            remedy=tr(
                "Write for example {scheme}://192.168.0.2?map=machine.toml.", scheme=url.scheme
            ),
        )
    return load_map(Path(file).expanduser()), replace(url, options=options)
