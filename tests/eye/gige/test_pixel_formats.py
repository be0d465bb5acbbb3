"""Every pixel format that is read, from bytes as the conventions lay them."""

from itertools import zip_longest

import numpy as np
import pytest

from robolink.errors import CalibrationError
from robolink.eye.cameras.gige.pixel_formats import FORMATS, format_name, grey_pixels

NUMBERS = {name: number for number, name in FORMATS.items()}
SIZE_PX = (6, 4)
COUNT = SIZE_PX[0] * SIZE_PX[1]


def values(bits: int, count: int = COUNT) -> list[int]:
    return [int(value) for value in np.random.default_rng(bits).integers(0, 1 << bits, count)]


def dense(pixels: list[int], bits: int) -> bytes:
    """Return pixels one behind the other, the lowest bits first (PFNC, "p")."""
    whole = 0
    for at, value in enumerate(pixels):
        whole |= value << at * bits
    return whole.to_bytes((len(pixels) * bits + 7) // 8, "little")


def packed(pixels: list[int], bits: int) -> bytes:
    """Return two pixels in three bytes (GigE Vision, "Packed")."""
    low = bits - 8
    mask, data = (1 << low) - 1, bytearray()
    for first, second in zip_longest(pixels[::2], pixels[1::2], fillvalue=0):
        data += bytes((first >> low, (first & mask) | (second & mask) << 4, second >> low))
    return bytes(data)


def laid(name: str, pixels: list[int]) -> bytes:
    depth = name.removeprefix("Mono")
    if depth.endswith("Packed"):
        return packed(pixels, int(depth[:2]))
    if depth.endswith("p"):
        return dense(pixels, int(depth[:2]))
    return np.array(pixels, np.uint8 if depth == "8" else "<u2").tobytes()


@pytest.mark.parametrize("name", [name for name in NUMBERS if name.startswith("Mono")])
@pytest.mark.parametrize("size_px", [SIZE_PX, (7, 3), (5, 1)])
def test_the_upper_eight_bits_of_each_pixel_are_kept(name, size_px):
    bits = int("".join(letter for letter in name if letter.isdigit()))
    width, height = size_px
    pixels = values(bits, width * height)
    grey = grey_pixels(laid(name, pixels), NUMBERS[name], size_px)
    assert grey.dtype == np.uint8
    assert grey.tolist() == (np.array(pixels) >> bits - 8).reshape(height, width).tolist()


@pytest.mark.parametrize("order", ["GR", "RG", "GB", "BG"])
def test_a_grey_scene_through_a_colour_filter_stays_what_and_where_it_is(order):
    # A ramp is kept by any weights that are even about the pixel.
    ramp = np.add.outer(3 * np.arange(12), 5 * np.arange(16)).astype(np.uint8)
    grey = grey_pixels(ramp.tobytes(), NUMBERS[f"Bayer{order}8"], (16, 12))
    assert np.abs(grey[1:-1, 1:-1].astype(int) - ramp[1:-1, 1:-1]).max() == 0


@pytest.mark.parametrize(("order", "red_at"), [("RG", (0, 0)), ("GR", (0, 1)), ("BG", (1, 1))])
def test_each_colour_counts_alike_at_every_pixel(order, red_at):
    mosaic = np.zeros((8, 10), np.uint8)
    mosaic[red_at[0] :: 2, red_at[1] :: 2] = 200  # red light alone
    grey = grey_pixels(mosaic.tobytes(), NUMBERS[f"Bayer{order}8"], (10, 8))
    assert (grey == 50).all()


def test_colour_filters_of_more_bits_are_averaged_too():
    pixels = [0xABC] * COUNT
    for name, data in (
        ("BayerRG12", laid("Mono12", pixels)),
        ("BayerGB12p", laid("Mono12p", pixels)),
        ("BayerBG12Packed", laid("Mono12Packed", pixels)),
    ):
        assert (grey_pixels(data, NUMBERS[name], SIZE_PX) == 0xAB).all(), name


def test_bytes_behind_each_row_are_left_out():
    rows = np.arange(COUNT, dtype=np.uint8).reshape(4, 6)
    data = b"".join(row.tobytes() + b"\xff\xff" for row in rows)
    assert grey_pixels(data, NUMBERS["Mono8"], SIZE_PX, padding=2).tolist() == rows.tolist()


@pytest.mark.parametrize(
    ("number", "data", "told"),
    [
        (0x02180014, b"x" * 72, "RGB8"),
        (0x12345678, b"x" * 72, "0x12345678"),
        (NUMBERS["Mono8"], b"x" * (COUNT - 1), "23 bytes instead of 24"),
        (NUMBERS["Mono12Packed"], b"x" * 35, "35 bytes instead of 36"),
    ],
)
def test_what_cannot_be_read_is_named(number, data, told):
    with pytest.raises(CalibrationError, match=told) as caught:
        grey_pixels(data, number, SIZE_PX)
    assert caught.value.code == "picture_unreadable"
    assert "PixelFormat" in caught.value.remedy


def test_rows_that_share_a_byte_cannot_be_filled_up():
    with pytest.raises(CalibrationError, match="pads its rows"):
        grey_pixels(b"x" * 100, NUMBERS["Mono12p"], (5, 3), padding=2)


def test_a_format_of_which_nobody_knows_has_its_number():
    assert format_name(NUMBERS["Mono10p"]) == "Mono10p"
    assert format_name(0x81100006) == "0x81100006"
