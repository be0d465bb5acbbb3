"""What was found in a picture of a camera: lines, a document, an HTML page, a PNG file."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from textwrap import wrap
from typing import Any, Final

from markupsafe import Markup, escape

from robolink.errors import ConfigError
from robolink.eye.candidate import Candidate
from robolink.eye.picture import CameraPicture
from robolink.eye.reasons import candidate_line, candidates_summary
from robolink.eye.record.candidate_json import candidate_as_json
from robolink.files.named import save_named
from robolink.messages import in_english, tr
from robolink.report import look_markup
from robolink_cli.access.look_pictures import picture_for_page

MOST_PAGE_PX: Final = 1600
"""Longest side of a picture in a page of its own, in pixels."""

_ZOOM_RADII: Final = 4.0
_LEAST_ZOOM_PX: Final = 60.0
"""Half the side of a part that is shown larger: in radii of the tip, and at least, in pixels."""

_LINE_PX: Final = 18
_LETTER_PX: Final = 6
"""Height of a line and mean width of a letter below a PNG picture, in pixels."""
_ACCEPTED: Final = (25, 195, 125)
_REFUSED: Final = (255, 138, 0)

PAGE_ENDINGS: Final = (".html", ".htm")
PNG_ENDING: Final = ".png"


def require_known_ending(path: Path) -> None:
    """Check that a file's name says what is to be written.

    Raises:
        ConfigError: It ends in neither .html nor .png.
    """
    if path.suffix.lower() not in (*PAGE_ENDINGS, PNG_ENDING):
        raise ConfigError(
            tr("{file} is neither a page nor a picture.", file=path),
            remedy=tr("Let its name end in .html or .png."),
        )


def look_lines(candidates: Sequence[Candidate], *, most: int | None = None) -> list[str]:
    """Return what was found, a line each, and what it comes to.

    Args:
        candidates: What was found, the accepted ones first.
        most: How many have a line; the accepted ones have one in any case.
    """
    lines = [candidate_line(number, one) for number, one in enumerate(candidates, start=1)]
    if most is not None:
        listed = max(most, sum(one.accepted for one in candidates))
        if left := len(lines[listed:]):
            lines = [
                *lines[:listed],
                tr("{count} more were refused: --all lists them.", count=left),
            ]
    return [*lines, candidates_summary(candidates)]


def look_payload(
    picture: CameraPicture, candidates: Sequence[Candidate], *, camera: str, radius_px: float | None
) -> dict[str, Any]:
    """Return what was found for a document."""
    width, height = picture.size_px
    return {
        "camera": camera,
        "picture": picture.name,
        "width_px": width,
        "height_px": height,
        "expected_radius_px": radius_px,
        "accepted": sum(one.accepted for one in candidates),
        "candidates": [candidate_as_json(one) for one in candidates],
    }


def save_look(
    path: Path,
    picture: CameraPicture,
    candidates: Sequence[Candidate],
    *,
    title: str,
    at: datetime,
    overwrite: bool,
) -> None:
    """Write a picture with everything that was found in it, as a page or a PNG file.

    Args:
        path: Where; its ending says which.
        picture: The picture.
        candidates: What was found.
        title: Which camera it is of.
        at: When it was taken.
        overwrite: Whether a file that is there may go.

    Raises:
        ConfigError: It cannot be written, or Pillow is missing for a PNG file.
    """
    require_known_ending(path)
    if path.suffix.lower() == PNG_ENDING:
        data = drawn_png(picture, candidates, title=title)
    else:
        data = look_page(picture, candidates, title=title, at=at).encode("utf-8")
    save_named(path, data, replace=overwrite)


def zoomed(
    picture: CameraPicture, candidates: Sequence[Candidate]
) -> tuple[CameraPicture, list[Candidate]] | None:
    """Return the part of a picture about its best accepted candidate, with what is found in it.

    ``None`` where nothing was accepted, or the part would be the whole.

    Args:
        picture: The picture.
        candidates: What was found in it.
    """
    best = next((one for one in candidates if one.accepted), None)
    if best is None:
        return None
    half = round(max(_ZOOM_RADII * best.radius_px, _LEAST_ZOOM_PX))
    height, width = picture.grey.shape
    left, top = (max(0, round(at) - half) for at in (best.x_px, best.y_px))
    part = picture.grey[top : top + 2 * half + 1, left : left + 2 * half + 1]
    if part.shape == (height, width):
        return None
    inside = [
        replace(one, x_px=one.x_px - left, y_px=one.y_px - top)
        for one in candidates
        if left < one.x_px < left + part.shape[1] and top < one.y_px < top + part.shape[0]
    ]
    return replace(picture, grey=part), inside


def look_page(
    picture: CameraPicture, candidates: Sequence[Candidate], *, title: str, at: datetime
) -> str:
    """Return the page of one picture; it runs no script and loads nothing."""
    caption = tr("Taken {at}", at=at.astimezone().isoformat(sep=" ", timespec="seconds"))
    shown = picture_for_page(picture, candidates, caption=caption, most_px=MOST_PAGE_PX)
    near = zoomed(picture, candidates)
    larger = ""
    if near is not None:
        drawn = picture_for_page(*near, caption=tr("The accepted circle, larger"))
        said = f"<figcaption>{escape(drawn.caption)}</figcaption>"
        larger = f"<figure>{look_markup(drawn)}{said}</figure>\n"
    style = files("robolink.report").joinpath("style.css").read_text(encoding="utf-8")
    lines = Markup("").join(
        Markup('<li class="{}">{}</li>').format("" if one.accepted else "still", line)
        for one, line in zip(candidates, look_lines(candidates), strict=False)
    )
    tone = "good" if sum(one.accepted for one in candidates) == 1 else "bad"
    return (
        "<!DOCTYPE html>\n"
        f'<html lang="{tr("en")}"><head><meta charset="utf-8">'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; '
        "style-src 'unsafe-inline'; img-src data:\">"
        f'<meta name="viewport" content="width=device-width"><title>{escape(title)}</title>'
        f"<style>{style}</style></head><body>\n<header><h1>{escape(title)}</h1>"
        f'<p class="outcome {tone}">{escape(candidates_summary(candidates))}</p></header>\n'
        f"<figure>{look_markup(shown)}<figcaption>{escape(caption)}</figcaption></figure>\n{larger}"
        f"<ul>{lines}</ul>\n"
        f'<p class="small">{escape(tr("A whole circle was accepted, a dashed one was refused."))} '
        f"{escape(tr('X to the right, Y down, in pixels of the picture.'))}</p>\n</body></html>\n"
    )


def drawn_png(picture: CameraPicture, candidates: Sequence[Candidate], *, title: str) -> bytes:
    """Return the picture with circles as a PNG file, and below it a line for each, in English.

    The letters that Pillow brings are Latin.

    Raises:
        ConfigError: Pillow is missing.
    """
    try:
        from PIL import Image, ImageDraw, ImageFont
    except ImportError as error:
        raise ConfigError(
            tr("A PNG file with circles needs the package Pillow, which is missing."),
            remedy=tr("Write a page, --out look.html; or install it: pip install 'robolink[eye]'."),
        ) from error
    width, height = picture.size_px
    letters = max(width, 640) // _LETTER_PX
    told = (title, *map(in_english, look_lines(candidates)))
    lines = [row for line in told for row in wrap(line, letters, subsequent_indent="   ")]
    font: Any = ImageFont.load_default()
    sheet = Image.new("RGB", (max(width, 640), height + _LINE_PX * (len(lines) + 1)), (23, 32, 42))
    sheet.paste(Image.fromarray(picture.grey).convert("RGB"), (0, 0))
    draw = ImageDraw.Draw(sheet)
    for number, one in enumerate(candidates, start=1):
        colour = _ACCEPTED if one.accepted else _REFUSED
        x, y, r = one.x_px, one.y_px, one.radius_px
        draw.ellipse((x - r, y - r, x + r, y + r), outline=colour, width=2)
        draw.text((x + r + 3, max(y - r, 0)), str(number), fill=colour, font=font)
    for row, line in enumerate(lines):
        plain = line.encode("latin-1", "replace").decode("latin-1")
        draw.text((6, height + _LINE_PX * row + 6), plain, fill=(230, 230, 230), font=font)
    data = BytesIO()
    sheet.save(data, "PNG")
    return data.getvalue()
