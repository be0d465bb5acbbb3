"""Own eyes by their URL: the entry points of the group ``robolink.sensors``."""

from pathlib import Path
from typing import TYPE_CHECKING, Final
from urllib.parse import unquote, urlsplit

from robolink.errors import ConfigError
from robolink.messages import known_names, tr
from robolink.model import sensor_address

if TYPE_CHECKING:
    from robolink.eye.eye_camera import EyeCamera
    from robolink.eye.source import PictureSource

__all__ = ["SCHEMES", "open_eye", "open_source"]

SCHEMES: Final = (*("folder", "gige", "http", "https", "mjpeg+http", "mjpeg+https", "rtsp", "usb"),)
"""What a URL of an own eye begins with."""


def open_eye(url: str) -> "EyeCamera":
    """Open the camera that a URL names; it keeps its pictures in the state folder.

    Args:
        url: For example ``http://camera.local/snapshot.jpg``.

    Raises:
        ConfigError: The URL makes no sense, or a package is missing.
        CalibrationError: ``camera_gone`` or ``camera_taken``.
    """
    from robolink.eye.eye_camera import EyeCamera
    from robolink.eye.kept_pictures import PictureStore

    return EyeCamera(open_source(url), store=PictureStore(address=sensor_address(url)))


def open_source(url: str) -> "PictureSource":
    """Open what delivers pictures.

    Args:
        url: See :func:`open_eye`.

    Raises:
        ConfigError, CalibrationError: As :func:`open_eye`.
    """
    scheme = url.partition("://")[0].lower()
    if scheme == "folder":
        return _folder(url)
    if scheme in ("http", "https"):
        from robolink.eye.cameras.http import HttpSource

        return HttpSource(url)
    if scheme == "gige":
        from robolink.eye.cameras.gige.opening import open_gige

        return open_gige(_gige(url))
    if scheme in ("mjpeg+http", "mjpeg+https"):
        from robolink.eye.cameras.mjpeg import MjpegReader
        from robolink.eye.cameras.stream import StreamSource

        return StreamSource(MjpegReader(url.partition("+")[2]))
    if scheme in ("usb", "rtsp"):
        from robolink.eye.cameras.stream import StreamSource
        from robolink.eye.cameras.usb import OpenCvReader

        return StreamSource(OpenCvReader(url if scheme == "rtsp" else _device(url)))
    raise ConfigError(
        tr("{url!r} names no source of pictures.", url=sensor_address(url)),
        remedy=known_names(SCHEMES, scheme),
    )


def _folder(url: str) -> "PictureSource":
    from robolink.eye.cameras.folder import FolderSource

    parts = urlsplit(url)
    folder = Path(unquote(parts.netloc + parts.path))
    if parts.query or parts.fragment or not (parts.netloc + parts.path).strip("/"):
        raise ConfigError(
            tr("{url!r} names no folder.", url=url),
            remedy=tr("Write folder:///path/to/the/pictures."),
        )
    return FolderSource(folder)


def _gige(url: str) -> str:
    """Return what ``gige://192.168.1.20`` or ``gige://22334455`` names; empty for the only one."""
    name = unquote(url.partition("://")[2]).strip("/")
    if any(mark in name for mark in "/?#@"):
        raise ConfigError(
            tr("{url!r} names no GigE camera.", url=sensor_address(url)),
            remedy=tr(
                "Write gige:// with its address or serial number, such as "
                "gige://192.168.1.20, or gige:// alone for the only one."
            ),
        )
    return name


def _device(url: str) -> int | str:
    """Return what ``usb://0`` or ``usb:///dev/video0`` names."""
    name = unquote(url.partition("://")[2])
    if name.isascii() and name.isdecimal() and len(name) < 4:
        return int(name)
    if name.startswith("/"):
        return name
    raise ConfigError(
        tr("{url!r} names no camera on USB.", url=url),
        remedy=tr("Write usb://0 for the first one, or usb:///dev/video0."),
    )
