"""The screens of the wizard as pictures for the pages, in both languages.

``python -m tests.cli.wizard.pictures`` draws them anew into ``docs/pictures``. They are copies of a
terminal of 80 by 24, character by character: a wide one takes two columns.
"""

from html import escape
from itertools import groupby
from pathlib import Path

from robolink_cli.wizard.screens.screen import screen_of
from wcwidth import wcwidth

from robolink import messages
from robolink.locale.languages import translator
from tests.cli.wizard.test_screens import SCREENS

FOLDER = Path(__file__).parents[3] / "docs" / "pictures"
SHOWN = {
    "choose": "choose job",
    "check": "check list",
    "moving": "moving",
    "touch": "touch again",
    "typed": "touch typed",
    "fit": "fit more",
    "values": "values taught",
    "turn-test": "turn test more",
    "done": "done",
    "stopped": "stopped",
    "recover": "recover",
}
"""The names of the pictures and of their screens."""

WIDE, HIGH = 8.4, 18
HEAD = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="696" height="456" viewBox="0 0 696 456" '
    'font-family="DejaVu Sans Mono, Consolas, Noto Sans Mono CJK SC, SimHei, monospace" '
    'font-size="14">\n<rect width="100%" height="100%" rx="6" fill="#101418"/>\n'
    '<g fill="#e6e6e6">\n'
)


def runs(row):
    """Yield runs of a row with characters of one width, each with its columns."""
    column = 0
    for width, part in groupby(row, key=wcwidth):
        text = "".join(part)
        yield column, text, width * len(text)
        column += width * len(text)


def svg_of(rows):
    """Return a screen as SVG."""
    drawn = []
    for number, row in enumerate(rows):
        for column, text, columns in runs(row):
            if text.strip():
                x, y = 12 + column * WIDE, 26 + number * HIGH
                drawn.append(
                    f'<text x="{x:.1f}" y="{y}" textLength="{columns * WIDE:.1f}" '
                    f'xml:space="preserve">{escape(text)}</text>'
                )
    return HEAD + "\n".join(drawn) + "\n</g>\n</svg>\n"


def picture(name, language):
    """Return the path of a picture, and its content."""
    before = messages._translate
    messages.install(translator("zh") if language == "zh" else None)
    try:
        hand = SCREENS[SHOWN[name]]()
        rows = screen_of(hand.state, hand.now).rows()
    finally:
        messages.install(before)
    ending = ".zh" if language == "zh" else ""
    return FOLDER / f"wizard-{name}{ending}.svg", svg_of(rows)


def main():
    for name in SHOWN:
        for language in ("en", "zh"):
            path, text = picture(name, language)
            path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
