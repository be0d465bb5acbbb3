"""Point files of EPSON RC+ (``robot1.pts``).

The layout is not documented; this is what public RC+ projects of 2009 to 2026 hold, all with
``sVersion="2.0.0"``: a first line with a checksum, ``key=value`` lines, and a block per
point::

    Point1 {
            nNumber=0
            sLabel="pick"
            nUndefined=0
            rX=88.952
            rU=-101.024
            nLocal=0
            nHand=1
    }

``nUndefined`` counts in bits. Deleted points show 262143, all eighteen; points whose X to W
are in use show 0 or 448, which is R, S and T when the bits follow the order of the fields.
That order is inferred. ``nHand`` is 1 for right and 2 for left, as the function Hand
(docs/reference/spel.md 5.1).
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Hand, Pose
from robolink.pose_files._reading import read_text, unusable

_FIELDS: Final = ("nNumber", "nUndefined", "rX", "rY", "rZ", "rU", "rV", "rW", "nLocal", "nHand")
_BLOCK: Final = re.compile(r"^Point[0-9]+ *\{\s*?\n(.*?)^\s*\}", re.MULTILINE | re.DOTALL)
_FIELD: Final = re.compile(
    rf"^\s*({'|'.join(_FIELDS)})=(-?[0-9]{{1,9}}(?:\.[0-9]{{1,9}})?(?:E[+-][0-9]{{1,3}})?)\s*$",
    re.MULTILINE | re.ASCII,
)
_COUNT: Final = re.compile(r"^nNumberOfPoints=([0-9]{1,6})\s*$", re.MULTILINE | re.ASCII)
_XYZU: Final = 0b1111
_HANDS: Final = {1: Hand.RIGHT, 2: Hand.LEFT}


def read_pts(path: Path) -> dict[int, Pose | None]:
    """Read the points of a ``.pts`` file by number, ``None`` for a deleted one.

    The poses carry no tool; a point does not know with which it was taught.

    Raises:
        ConfigError: It cannot be read or is no such file.
    """
    # Labels may be in any of Windows' encodings; every byte is a character of this one, and
    # only numbers are used.
    text = read_text(path, encoding="latin-1").replace("\r\n", "\n")
    try:
        return parse_pts(text)
    except ConfigError as error:
        raise unusable(path, error.what) from error


def parse_pts(text: str) -> dict[int, Pose | None]:
    """Read the text of a ``.pts`` file; see :func:`read_pts`.

    Raises:
        ConfigError: It is not one, or a point of it cannot be read.
    """
    counted = _COUNT.search(text)
    blocks = _BLOCK.findall(text)
    if counted is None or int(counted[1]) != len(blocks):
        raise ConfigError(
            tr("it is not a whole point file of EPSON RC+"),
            remedy=tr("Export the points again."),
        )
    points: dict[int, Pose | None] = {}
    for number, block in enumerate(blocks, start=1):
        fields = {name: float(value) for name, value in _FIELD.findall(block)}
        if set(fields) != set(_FIELDS) or fields["nNumber"] in points:
            raise ConfigError(
                tr("point block {number} cannot be read", number=number),
                remedy=tr("Export the points again."),
            )
        points[int(fields["nNumber"])] = _pose(fields)
    return points


def _pose(fields: Mapping[str, float]) -> Pose | None:
    if int(fields["nUndefined"]) & _XYZU:
        return None
    return Pose(
        fields["rX"],
        fields["rY"],
        fields["rZ"],
        fields["rU"],
        fields["rV"],
        fields["rW"],
        hand=_HANDS.get(int(fields["nHand"])),
        local=int(fields["nLocal"]),
    )
