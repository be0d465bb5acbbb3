"""Pixels as GigE cameras send them, to grey: eight bits a pixel.

Of more than eight bits the upper eight are kept. Colour filters (Bayer) are averaged so that each
pixel holds a quarter red, half green and a quarter blue, as the picture is there: nothing is moved
by half a pixel, whichever colour comes first.

Source: Pixel Format Naming Convention 2.1 and GigE Vision 2.0, 27; numbers as in ``arvenums.h`` of
Aravis 0.8.26. Data are little-endian.
"""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final

from robolink.errors import CalibrationError
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.eye.picture import Grey

__all__ = ["FORMATS", "format_name", "grey_pixels"]

_BITS: Final = 0xFF
"""Mask of the bits a pixel in bits 16 to 23 of a format's number."""

_ORDERS: Final = ("GR", "RG", "GB", "BG")
_DENSE_ORDERS: Final = ("BG", "GB", "GR", "RG")


def _bayer(first: int, depth: str) -> dict[int, str]:
    """Return the four colour orders of one depth, whose numbers follow each other."""
    return {first + at: f"Bayer{order}{depth}" for at, order in enumerate(_ORDERS)}


def _bayer_dense(first: int, depth: str) -> dict[int, str]:
    """Return them for pixels without unused bits, whose numbers are two apart."""
    return {first + 2 * at: f"Bayer{order}{depth}" for at, order in enumerate(_DENSE_ORDERS)}


FORMATS: Final[Mapping[int, str]] = {
    0x01080001: "Mono8",
    0x01100003: "Mono10",
    0x010C0004: "Mono10Packed",
    0x010A0046: "Mono10p",
    0x01100005: "Mono12",
    0x010C0006: "Mono12Packed",
    0x010C0047: "Mono12p",
    0x01100025: "Mono14",
    0x01100007: "Mono16",
    **_bayer(0x01080008, "8"),
    **_bayer(0x0110000C, "10"),
    **_bayer(0x01100010, "12"),
    **_bayer(0x0110002E, "16"),
    **_bayer(0x010C0026, "10Packed"),
    **_bayer(0x010C002A, "12Packed"),
    **_bayer_dense(0x010A0052, "10p"),
    **_bayer_dense(0x010C0053, "12p"),
}
"""The formats that are read, by their numbers."""

_OTHERS: Final[Mapping[int, str]] = {
    0x01080002: "Mono8s",
    0x02180014: "RGB8",
    0x02180015: "BGR8",
    0x02200016: "RGBa8",
    0x02200017: "BGRa8",
    0x020C001E: "YUV411_8_UYYVYY",
    0x0210001F: "YUV422_8_UYVY",
    0x02100032: "YUV422_8",
    0x02180020: "YUV8_UYV",
}
"""Some that are not read, for a message that names them."""


def format_name(number: int) -> str:
    """Return the name of a pixel format, its number in hexadecimal where it is not known."""
    return FORMATS.get(number) or _OTHERS.get(number) or f"0x{number:08X}"


def grey_pixels(data: bytes, number: int, size_px: tuple[int, int], *, padding: int = 0) -> "Grey":
    """Return a frame as grey pixels, rows by columns.

    Args:
        data: What the camera sent.
        number: Its pixel format.
        size_px: Width and height.
        padding: Bytes behind each row that hold nothing.

    Raises:
        CalibrationError: ``picture_unreadable``: a format that is not read, or fewer bytes than
            it says.
    """
    import numpy as np

    width, height = size_px
    name = FORMATS.get(number)
    if name is None:
        raise _unreadable(
            tr(
                "robolink cannot read the camera's pixel format {format}.",
                format=format_name(number),
            ),
        )
    bits = number >> 16 & _BITS
    row = (width * bits + 7) // 8
    if padding:
        data = _without_padding(data, row, height, padding, whole=width * bits % 8 == 0)
    least = (width * height * bits + 7) // 8
    if len(data) < least:
        raise _unreadable(
            tr("The camera sent {there} bytes instead of {least}.", there=len(data), least=least)
        )
    depth = name.removeprefix("Mono")
    for order in _ORDERS:
        depth = depth.removeprefix(f"Bayer{order}")
    pixels = _EIGHT_BITS[depth](np.frombuffer(data, np.uint8), width * height)
    grey: Grey = pixels[: width * height].reshape(height, width)
    return grey if name.startswith("Mono") else _averaged(grey)


def _unreadable(what: str) -> CalibrationError:
    return CalibrationError(
        "picture_unreadable",
        what,
        remedy=tr("Set the camera's PixelFormat to Mono8, with its maker's program."),
    )


def _without_padding(data: bytes, row: int, height: int, padding: int, *, whole: bool) -> bytes:
    """Return the rows alone; bits of two rows never share a byte where there is padding."""
    import numpy as np

    stride = row + padding
    if len(data) < stride * height - padding or not whole:
        raise _unreadable(tr("The camera pads its rows in a way that robolink cannot read."))
    padded = np.frombuffer(data.ljust(stride * height, b"\0"), np.uint8)[: stride * height]
    return padded.reshape(height, stride)[:, :row].tobytes()


def _unpacked(shift: int) -> Callable[[Any, int], Any]:
    """Two bytes a pixel, of which some of the upper bits are used."""

    def upper(data: Any, pixels: int) -> Any:  # noqa: ANN401 - numpy is imported when it is used
        import numpy as np

        values = data[: 2 * pixels].view("<u2") >> shift
        return np.minimum(values, _BITS).astype(np.uint8)

    return upper


def _packed(data: Any, pixels: int) -> Any:  # noqa: ANN401 - numpy is imported when it is used
    """Two pixels in three bytes: the upper bits of each are a byte, the middle one the rest."""
    return _groups(data, pixels, 2, 3)[:, (0, 2)].reshape(-1)


def _dense_12(data: Any, pixels: int) -> Any:  # noqa: ANN401 - numpy is imported when it is used
    """Two pixels in three bytes, the lowest bits first."""
    import numpy as np

    groups = _groups(data, pixels, 2, 3)
    first = groups[:, 0] >> 4 | groups[:, 1] << 4
    return np.stack((first, groups[:, 2]), axis=1).reshape(-1)


def _dense_10(data: Any, pixels: int) -> Any:  # noqa: ANN401 - numpy is imported when it is used
    """Four pixels in five bytes, the lowest bits first."""
    import numpy as np

    groups = _groups(data, pixels, 4, 5)
    # Pixel k is bits 10 k to 10 k + 9, of which the upper eight begin at bit 10 k + 2.
    parts = [
        groups[:, at] >> 2 * (at + 1) | groups[:, at + 1] << 8 - 2 * (at + 1) for at in range(3)
    ]
    return np.stack((*parts, groups[:, 4]), axis=1).reshape(-1)


def _groups(data: Any, pixels: int, each: int, size: int) -> Any:  # noqa: ANN401 - likewise
    import numpy as np

    groups = -(-pixels // each)
    missing = groups * size - len(data)
    whole = np.pad(data, (0, missing)) if missing > 0 else data[: groups * size]
    return whole.reshape(groups, size)


_EIGHT_BITS: Final[Mapping[str, Callable[[Any, int], Any]]] = {
    "8": lambda data, pixels: data[:pixels],
    "10": _unpacked(2),
    "12": _unpacked(4),
    "14": _unpacked(6),
    "16": _unpacked(8),
    "10Packed": _packed,
    "12Packed": _packed,
    "10p": _dense_10,
    "12p": _dense_12,
}


def _averaged(mosaic: "Grey") -> "Grey":
    """Return a quarter red, half green, a quarter blue at each pixel of a colour filter.

    The weights 1 2 1 along both axes give each of the four places of the filter a quarter, and are
    even about the pixel. At the border the picture is mirrored, which keeps the colours apart.
    """
    import numpy as np

    if min(mosaic.shape) < 2:
        return mosaic
    wide = np.pad(mosaic, 1, mode="reflect").astype(np.uint16)
    down = wide[:-2] + 2 * wide[1:-1] + wide[2:]
    both = down[:, :-2] + 2 * down[:, 1:-1] + down[:, 2:]
    averaged: Grey = (both + 8 >> 4).astype(np.uint8)
    return averaged
