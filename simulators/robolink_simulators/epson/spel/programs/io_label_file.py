"""Labels of inputs and outputs of a project, as RC+ writes them (docs/reference/spel.md 16)."""

import re
from pathlib import Path
from typing import Final

from robolink_simulators.epson.memory.bits import (
    BIT,
    BYTE,
    INPUT,
    MEMORY,
    OUTPUT,
    WORD,
    IOLabel,
)
from robolink_simulators.epson.spel.source.point_file import blocks, project_text

_KINDS: Final = {"Input": INPUT, "Output": OUTPUT, "Memory": MEMORY}
_WIDTHS: Final = {"Bit": BIT, "Byte": BYTE, "Word": WORD}
_LABELS: Final = re.compile(r"(Input|Output|Memory)(Bit|Byte|Word)Labels$")


def read_io_labels(path: Path, encoding: str | None = None) -> dict[str, IOLabel]:
    """Return the labels of inputs, outputs and memory bits, by their names in lower case.

    Raises:
        ConfigError: It cannot be read.
    """
    labels = dict[str, IOLabel]()
    for names, pairs in blocks(project_text(path, encoding)):
        kind = _LABELS.match(names[-2]) if len(names) > 1 else None
        number = next((v for k, v in pairs.items() if k in ("nBit", "nByte", "nWord", "nPort")), "")
        name = pairs.get("sLabel", "")
        if kind is None or not name or not number.isdecimal():
            continue
        labels[name.lower()] = IOLabel(_KINDS[kind[1]], _WIDTHS[kind[2]], int(number), name)
    return labels
