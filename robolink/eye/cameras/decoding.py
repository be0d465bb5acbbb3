"""CameraPicture files, decoded to grey: PGM by hand, all others by Pillow.

Pixels stay where the sensor has them: a note in the file that it is to be shown turned is not
followed, because a camera is calibrated in the pixels of its sensor.
"""

import io
import warnings
from typing import TYPE_CHECKING, Any, Final

from robolink.errors import CalibrationError, ConfigError
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.eye.picture import Grey

__all__ = ["MOST_BYTES", "decoded", "unreadable"]

MOST_BYTES: Final = 64 * 1024 * 1024
"""Largest picture file that is read."""

MOST_PIXELS: Final = 64_000_000
"""Largest picture; a small file can claim a size that fills the memory."""

LEAST_EDGE_PX: Final = 16
"""Smallest width and height."""

FORMATS: Final = ("JPEG", "PNG", "BMP", "TIFF", "PPM")
"""What Pillow is allowed to read: what cameras write, and nothing that runs another program."""

_TWELVE_BITS: Final = 4095
_BYTE: Final = 255
_TEXT: Final = frozenset(b"\t\r\n" + bytes(range(0x20, 0x7F)))


def decoded(data: bytes, name: str) -> "Grey":
    r"""Return a picture file as grey pixels, rows by columns.

    Colours become their luminance. Of 16 bits the upper eight are taken; where no pixel is above
    4095, the camera has 12 bits, and the upper eight of those are taken.

    Args:
        data: The file.
        name: What it is called in a message.

    Raises:
        CalibrationError: ``picture_unreadable``: it is not a whole picture, or one too large.
        ConfigError: Pillow is missing.

    Example:
        >>> from robolink.eye.cameras.decoding import decoded
        >>> decoded(b"P5 16 16 255\n" + bytes(range(256)), "bench").shape
        (16, 16)
    """
    if data[:2] == b"P5":
        return _pgm(data, name)
    try:
        from PIL import Image, UnidentifiedImageError
    except ImportError as error:
        raise ConfigError(
            tr("The pictures of {name} need the package Pillow, which is missing.", name=name),
            remedy=tr("Install it: pip install 'robolink[eye]'."),
        ) from error
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about its size, which is checked below
            with Image.open(io.BytesIO(data), formats=FORMATS) as image:
                _require_size(image.size, name)
                return _grey(image)
    except CalibrationError:
        raise
    except Exception as error:  # Pillow raises whatever a damaged file leads it to
        known = "" if isinstance(error, UnidentifiedImageError) else str(error)
        raise unreadable(name, data, known) from error


def unreadable(name: str, data: bytes = b"", cause: str = "") -> CalibrationError:
    """Return the refusal of something that is not a picture.

    Args:
        name: What it is called.
        data: What came, of which the beginning is looked at.
        cause: Why, in words; empty where only ``data`` can tell.
    """
    if not cause:
        if not data:
            cause = tr("it is empty")
        elif all(byte in _TEXT for byte in data[:200]):
            cause = tr("it is text, such as a page to log in")
        else:
            cause = tr("it is no JPEG, PNG, BMP, TIFF or PGM")
    return CalibrationError(
        "picture_unreadable",
        tr("{name} delivers no picture: {cause}.", name=name, cause=cause),
        remedy=tr("Open the same address in a browser, or the file in a viewer, and correct it."),
    )


def _grey(image: Any) -> "Grey":  # noqa: ANN401 - Pillow is optional
    import numpy as np

    if image.mode.startswith("I") or image.mode == "F":
        return _upper_eight(np.asarray(image).astype(np.uint32))
    return np.asarray(image.convert("L"))


def _upper_eight(values: Any) -> "Grey":  # noqa: ANN401 - numpy is imported when it is used
    import numpy as np

    grey: Grey = (values >> (4 if values.max(initial=0) <= _TWELVE_BITS else 8)).astype(np.uint8)
    return grey


def _pgm(data: bytes, name: str) -> "Grey":
    """Return a binary PGM (netpbm.sourceforge.net/doc/pgm.html)."""
    import numpy as np

    fields, at = list[bytes](), 2
    while len(fields) < 3:
        while data[at : at + 1].isspace():
            at += 1
        if data[at : at + 1] == b"#":
            at = data.find(b"\n", at)
            if at < 0:
                raise unreadable(name, cause=tr("its beginning is damaged"))
            continue
        end = at
        while data[end : end + 1].isdigit():
            end += 1
        if end == at or end - at > 5:
            raise unreadable(name, cause=tr("its beginning is damaged"))
        fields.append(data[at:end])
        at = end
    width, height, highest = (int(field) for field in fields)
    _require_size((width, height), name)
    if not 0 < highest < 65536:
        raise unreadable(name, cause=tr("its beginning is damaged"))
    size = 1 if highest <= _BYTE else 2
    body = data[at + 1 : at + 1 + width * height * size]
    if len(body) < width * height * size:
        raise unreadable(name, cause=tr("it ends in the middle"))
    values = np.frombuffer(body, np.uint8 if size == 1 else ">u2").reshape(height, width)
    if highest == _BYTE:
        return values
    scaled: Grey = (np.minimum(values, highest).astype(np.uint32) * _BYTE // highest).astype(
        np.uint8
    )
    return scaled


def _require_size(size_px: tuple[int, int], name: str) -> None:
    width, height = size_px
    if min(width, height) < LEAST_EDGE_PX or width * height > MOST_PIXELS:
        raise CalibrationError(
            "picture_unreadable",
            tr(
                "{name} delivers a picture of {width} x {height} pixels.",
                name=name,
                width=width,
                height=height,
            ),
            remedy=tr(
                "Set the camera to between {least} x {least} pixels and {most} megapixels.",
                least=LEAST_EDGE_PX,
                most=MOST_PIXELS // 1_000_000,
            ),
        )
