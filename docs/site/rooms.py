"""Draws docs/pictures/rooms.svg: the rooms of the library, from the contracts in pyproject.toml.

``python docs/site/rooms.py`` draws it; with ``--check`` it fails when the picture is not that of
the contracts.
"""

import sys
import tomllib
from html import escape
from pathlib import Path

ROOT = Path(__file__).parents[2]
PICTURE = ROOT / "docs" / "pictures" / "rooms.svg"

WIDTH, LEFT, TOP, HEIGHT, GAP = 1080, 46, 20, 44, 8
COLOURS = {"robolink_cli": "#fde8c8", "robolink_simulators": "#dcecd8", "robolink": "#eef2f8"}

WORDS = {
    "fleet": "plans of many cells: rings, outcomes, halts",
    "testing": "what every kind of controller is held to",
    "files": "of robolink, of people, by name",
    "closing": "what is closed",
    "robolink_cli": "commands, options, questions, views",
    "robolink_simulators": "cell, assist, hosting, epson, softmotion, plc: the fakes",
    "recipe": "a nozzle change written down once, as TOML",
    "serving": "running programs that calibrate a tool themselves: what is believed and kept",
    "calibration_run": "measure, propose, ask, write, prove, keep or put back",
    "nozzle_change": "old name of calibration_run",
    "methods": "one folder a calibration method",
    "procedures": "what methods share: ways, touches, looks, sampling",
    "inspection": "a whole cell looked at, without moving",
    "stations": "pins, beams, surfaces, cameras by name",
    "config": "cell files",
    "locale": "languages, and their catalogues",
    "transaction": "all tools or none",
    "runner": "runs a procedure, with a person",
    "backup": "all tools in a file",
    "report": "a page a change",
    "stopping": "from another process",
    "controllers": "epson, softmotion, plc_map",
    "calibration": "mathematics, no I/O",
    "pose_tables": "files of poses",
    "sensing": "cameras",
    "transport": "moves bytes: TCP, serial, Modbus, CAN",
    "protocols": "codecs for both ends, no I/O",
    "register_maps": "a builder's own registers",
    "journal": "what was done, chained",
    "model": "values and interfaces, no I/O",
    "stop_latch": "what is sent passes here",
    "errors": "every exception",
    "timing": "clocks, deadlines",
    "plug_ins": "of other packages",
    "interrupts": "Ctrl-C and others",
    "messages": "the catalogue",
    "runtime": "chance, time, locks",
    "ambient": "old name of runtime",
    "remedy_words": "words of who shows",
    "lazy_exports": "names on first use",
    "deprecation": "old names",
    "controller_outcome": "what is left",
    "standing": "old name of controller_outcome",
    "version": "which robolink",
    "checkpoints": "where another thread may come in",
}
"""Description of each room, short enough for its box."""


def layers() -> list[list[str]]:
    """Return the layers of the library, uppermost first, each with what lies side by side in it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = project["tool"]["importlinter"]["contracts"]
    (wanted,) = (c["layers"] for c in contracts if c.get("containers") == ["robolink"])
    return [[name.strip() for name in layer.split("|")] for layer in wanted]


def text(x: float, y: float, words: str, style: str) -> str:
    return f'<text x="{x:g}" y="{y:g}" {style}>{escape(words)}</text>'


def box(x: float, y: float, width: float, name: str, colour: str) -> list[str]:
    middle = x + width / 2
    return [
        f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{HEIGHT}" rx="4" fill="{colour}" '
        'stroke="#64748b"/>',
        text(middle, y + 18, name, 'class="name"'),
        text(middle, y + 34, WORDS.get(name, ""), 'class="what"'),
    ]


def picture() -> str:
    """Return the picture: a row a layer, and an arrow for the direction of imports."""
    lines, y, wide = [], TOP, WIDTH - LEFT - 20
    for name in ("robolink_cli", "robolink_simulators"):
        lines += box(LEFT, y, wide, name, COLOURS[name])
        y += HEIGHT + GAP
    rows = layers()
    frame = len(rows) * (HEIGHT + GAP) + 30
    lines += [
        f'<rect x="{LEFT}" y="{y}" width="{wide}" height="{frame}" rx="6" '
        f'fill="{COLOURS["robolink"]}" stroke="#64748b"/>',
        text(LEFT + 12, y + 19, "robolink", 'class="name" style="text-anchor:start"'),
    ]
    y += 26
    for row in rows:
        width = (wide - 20 - GAP * (len(row) - 1)) / len(row)
        for place, name in enumerate(row):
            lines += box(LEFT + 10 + place * (width + GAP), y, width, name, "#ffffff")
        y += HEIGHT + GAP
    bottom = y + 4
    arrow = (
        f'<path d="M24 {TOP} V{bottom - 10}" stroke="#334155" stroke-width="2" '
        'marker-end="url(#tip)"/>'
        f'<text transform="translate(16 {(TOP + bottom) / 2:g}) rotate(-90)" class="what">'
        "imports go downwards only; what stands side by side does not know each other</text>"
    )
    return "\n".join([*HEAD, arrow, *lines, "</svg>", ""]).replace("@H", str(bottom + 16))


HEAD = [
    f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} @H" '
    f'width="{WIDTH}" height="@H">',
    "<title>The rooms of robolink: who may import whom</title>",
    "<style>text{font-family:Helvetica,Arial,sans-serif;text-anchor:middle;fill:#0f172a}"
    ".name{font-size:14px;font-weight:bold}.what{font-size:11.5px;fill:#334155}</style>",
    '<defs><marker id="tip" viewBox="0 0 10 10" refX="8" refY="5" markerWidth="7" '
    'markerHeight="7" orient="auto"><path d="M0 0 L10 5 L0 10 z" fill="#334155"/></marker></defs>',
    f'<rect width="{WIDTH}" height="@H" fill="#ffffff"/>',
]


def main() -> int:
    drawn = picture()
    if "--check" not in sys.argv:
        PICTURE.write_text(drawn, encoding="utf-8")
        return 0
    if PICTURE.read_text(encoding="utf-8") == drawn:
        return 0
    print("The contracts have changed: python docs/site/rooms.py", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
