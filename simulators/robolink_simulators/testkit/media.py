"""Serves a simulated controller made by a test, for as long as a ``with`` lasts."""

import itertools
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from robolink.errors import ConfigError
from robolink.messages import known_names, tr
from robolink_simulators.device.hosted import HostedDevice

MEDIA: Final = {
    "epson": ("sim", "tcp", "serial"),
    "softmotion": ("sim", "modbus-tcp", "modbus-rtu", "can", "opcua", "opcua-secured"),
    "plc": ("modbus-tcp", "modbus-rtu", "opcua", "opcua-secured", "sim"),
}
"""Media through which each kind of controller can be reached."""

_count = itertools.count(1)


@contextmanager
def served(
    simulator: HostedDevice,
    medium: str = "sim",
    *,
    clock: Any = None,  # noqa: ANN401 - stepped or scaled
    map_file: Path | None = None,
) -> Iterator[str]:
    """Serve a simulator and yield its URL, under a name or on a port of its own.

    Args:
        simulator: Of any kind, furnished as the test likes.
        medium: One of :data:`MEDIA`; ``serial`` and ``modbus-rtu`` not on Windows, ``opcua``
            (neither signed nor encrypted) and ``opcua-secured`` with the package asyncua.
        clock: Its time: a ``ManualClock`` in the process, else a ``ScaledClock``. By default a
            clock of its own, which on a port is real time.
        map_file: The file of the map of a PLC that has one, for its URL: a map of symbols for
            ``opcua``, else one of registers.

    Raises:
        ConfigError: There is no such medium for its kind.

    Example:
        >>> import robolink
        >>> from robolink_simulators.epson import EpsonSimulator
        >>> from robolink_simulators.testkit.media import served
        >>> simulator = EpsonSimulator(seed=1)
        >>> simulator.machine.tools.set(5, robolink.ToolOffset(1, 2, 3))
        >>> with served(simulator) as url, robolink.connect(url) as controller:
        ...     print(controller.tools.read(5).z_mm)
        3.0
    """
    known = MEDIA[simulator.kind]
    if medium not in known:
        raise ConfigError(
            tr("A simulator cannot be served over {medium!r}.", medium=medium),
            remedy=known_names(known),
        )
    given: dict[str, Any] = {} if map_file is None else {"map_file": map_file}
    if medium == "sim":
        module: Any = _in_process(simulator.kind)
        name = free_name()
        try:
            yield module.register(name, simulator, clock=clock, **given)
        finally:
            module.unregister(name)
        return
    with _host(simulator, medium, clock, given) as host:
        yield host.secured_url if medium == "opcua-secured" else host.url


def free_name() -> str:
    """Return a name that no other cell of this machine has."""
    return f"pytest-{os.getpid()}-{next(_count)}"


def _in_process(kind: str) -> Any:  # noqa: ANN401 - a module
    if kind == "epson":
        from robolink_simulators.hosting.in_process import epson

        return epson
    if kind == "softmotion":
        from robolink_simulators.hosting.in_process import softmotion

        return softmotion
    from robolink_simulators.plc import in_process

    return in_process


def _host(
    simulator: Any,  # noqa: ANN401 - of any kind
    medium: str,
    clock: Any,  # noqa: ANN401 - scaled
    given: dict[str, Any],
) -> Any:  # noqa: ANN401 - of any kind
    if simulator.kind == "epson":
        from robolink_simulators.hosting.streams.epson import serve_serial, serve_tcp

        return (serve_tcp if medium == "tcp" else serve_serial)(simulator, clock=clock)
    if simulator.kind == "plc":
        from robolink_simulators.plc import serve_plc, serve_plc_line, serve_plc_opcua

        if medium.startswith("opcua"):
            return serve_plc_opcua(simulator, **given, clock=clock)
        on_tcp = medium == "modbus-tcp"
        return (serve_plc if on_tcp else serve_plc_line)(simulator, **given, clock=clock)
    if medium.startswith("opcua"):
        from robolink_simulators.hosting.fieldbus.opcua import serve_opcua

        return serve_opcua(simulator, clock=clock)
    if medium == "can":
        from robolink_simulators.hosting.fieldbus.canopen_node import CanPlace, serve_canopen

        return serve_canopen(simulator, CanPlace("virtual", free_name()), clock=clock)
    from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_rtu, serve_modbus_tcp

    serve = serve_modbus_tcp if medium == "modbus-tcp" else serve_modbus_rtu
    return serve(simulator, clock=clock)
