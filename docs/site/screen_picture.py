"""Draws a text screen as SVG: ``python docs/site/screen_picture.py SCREEN.txt PICTURE.svg``."""

import sys
from html import escape
from pathlib import Path

COLUMN, ROW = 8.4, 18


def picture(text: str) -> str:
    """Return the rows of a terminal as a picture, 80 columns wide."""
    rows = text.rstrip("\n").split("\n")
    wide, high = round(80 * COLUMN + 24), len(rows) * ROW + 24
    lines = "\n".join(
        f'<text x="12" y="{12 + ROW * number - 4}" xml:space="preserve">{escape(row)}</text>'
        for number, row in enumerate(rows, start=1)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide}" height="{high}" '
        f'viewBox="0 0 {wide} {high}" font-family="DejaVu Sans Mono, Consolas, monospace" '
        f'font-size="14">\n<rect width="100%" height="100%" rx="6" fill="#101418"/>\n'
        f'<g fill="#e6e6e6">\n{lines}\n</g>\n</svg>\n'
    )


if __name__ == "__main__":
    source, target = sys.argv[1:]
    Path(target).write_text(picture(Path(source).read_text(encoding="utf-8")), encoding="utf-8")
