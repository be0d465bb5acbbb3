"""From a name or URL to an open camera.

What stands before ``://`` or ``?``, or the whole text, is the name of an entry point of the
group ``robolink.sensors``; its opener gets the whole text and reads the rest as it likes.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final, Protocol, cast

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import TipSensor
from robolink.plug_ins import PlugInError, find_plug_in
from robolink.sensing._vision_guide import VISION_GUIDE, open_vision_guide

SENSORS_GROUP: Final = "robolink.sensors"

_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9+._-]*(?=://|\?|$)", re.ASCII)


class SensorOpener(Protocol):
    """What an entry point of the group provides."""

    def __call__(self, url: str) -> TipSensor:
        """Open the camera that ``url`` names.

        Raises:
            ConfigError: The rest of the URL makes no sense.
            ConnectError: The camera is not there.
        """


@contextmanager
def open_sensor(url: str | TipSensor) -> Iterator[TipSensor]:
    """Open a camera, and let go of it at the end of the block.

    Args:
        url: For example ``assist+tcp://TOKEN@127.0.0.1:40001`` or the name of a plug-in. A
            camera that is open already is used as it is, and left open for whoever opened it.

    Raises:
        CalibrationError: ``sensor_not_found``: nothing of that name is installed.
        ConfigError: The rest of the URL makes no sense.
        ConnectError: The camera is not there.
    """
    if not isinstance(url, str):
        yield url
        return
    sensor = _opener(url)(url)
    try:
        yield sensor
    finally:
        sensor.close()


def sensor_name(sensor: str | TipSensor) -> str:
    """Return what a camera is called in a sentence or a record: its name, or who it says it is.

    Of a URL that part is left out that stands before ``@``: a user, a password or a token.
    """
    name = sensor if isinstance(sensor, str) else sensor.identity
    scheme, separator, rest = name.partition("://")
    place, slash, path = rest.partition("/")
    return f"{scheme}{separator}{place.rpartition('@')[2]}{slash}{path}"


def _opener(url: str) -> SensorOpener:
    name = _NAME.match(url)
    if name and name[0] == VISION_GUIDE:
        return open_vision_guide
    try:
        found = find_plug_in(SENSORS_GROUP, name[0]) if name else None
    except PlugInError as error:
        raise CalibrationError(
            "sensor_not_found",
            tr(
                "The sensor {url!r} cannot be loaded: {cause}.",
                url=sensor_name(url),
                cause=error,
            ),
            remedy=tr("Reinstall the package that provides it."),
        ) from error.origin
    if found is None:
        from importlib import metadata  # costs more than the rest of this package

        known = sorted({*metadata.entry_points(group=SENSORS_GROUP).names, VISION_GUIDE})
        raise CalibrationError(
            "sensor_not_found",
            tr("No sensor is called {url!r}.", url=sensor_name(url)),
            remedy=tr(
                "Name it in the cell file under sensors, or install the package that "
                "provides it. These are known: {known}.",
                known=", ".join(known),
            ),
        )
    return cast(SensorOpener, found)
