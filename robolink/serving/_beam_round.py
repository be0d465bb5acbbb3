"""A round about two beams that a program drove by itself and reported as one line.

The line holds what the controller showed before the first side, where the robot was at each edge
and at each corner, and what the input of the beam showed. What it means is decided here, in the
words and at the limits of a round that robolink drives (docs/reference/spel_callback.md, "The
lines").
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from robolink.errors import CalibrationError, RemoteProtocolError
from robolink.messages import tr
from robolink.model import Pose
from robolink.protocols.spel_callback import read_components, read_thousandths

if TYPE_CHECKING:
    from robolink.calibration import Crossing
    from robolink.stations import BeamStation

_SIDES: Final = 4
_STATE_FIELDS: Final = 12
"""Number of fields before the sides: proof, tool, motors, power, SpeedS, AccelS, and a place."""

_SIDE_FIELDS: Final = 7
"""Number of fields of a side: what was seen, the entry, the exit, and the corner at its end."""

_SEEN: Final = re.compile("[01][0-3][0-3]")
_SLOWEST_MM_S: Final = 0.5
_FASTEST_MM_S: Final = 20.0
"""Limits of the speed of a crossing, in mm/s, as for ``calibrate beams``."""


@dataclass(frozen=True, slots=True)
class RoundSide:
    """One side of a round: a straight way through one beam.

    Attributes:
        before: Whether the input was on where the side begins.
        met, left: Whether each search ended at its edge, not at the corner.
        entry_on, exit_on: Whether the input was on at rest after each search.
        start, entry, exit, end: Where the robot was.
    """

    before: bool
    met: bool
    entry_on: bool
    left: bool
    exit_on: bool
    start: Pose
    entry: Pose
    exit: Pose
    end: Pose


@dataclass(frozen=True, slots=True)
class BeamRound:
    """What a program reports of one round.

    Attributes:
        proof: Whether it belongs to the turn test.
        tool: The selected tool, in which all places are.
        motors_on, power_high: What the controller showed before the first side.
        speed_mm_s: SpeedS of the crossings.
        acceleration_mm_s2: The lesser of both values of AccelS.
        sides: They, in order; fewer than four where the last one did not find an edge.
    """

    proof: bool
    tool: int
    motors_on: bool
    power_high: bool
    speed_mm_s: float
    acceleration_mm_s2: float
    sides: tuple[RoundSide, ...]

    def on_record(self) -> dict[str, object]:
        """Return what it was driven with, plain JSON."""
        return {
            "tool": self.tool,
            "motors_on": self.motors_on,
            "power_high": self.power_high,
            "speed_mm_s": self.speed_mm_s,
            "acceleration_mm_s2": self.acceleration_mm_s2,
        }


def read_round(fields: Sequence[str]) -> BeamRound:
    """Return what a line says.

    Raises:
        RemoteProtocolError: It is no round.
    """
    state, rest = fields[:_STATE_FIELDS], fields[_STATE_FIELDS:]
    # The last side tells no end: it is the first corner, or was not reached.
    count, over = divmod(len(rest) + 2, _SIDE_FIELDS)
    if len(state) != _STATE_FIELDS or over or not 1 <= count <= _SIDES:
        raise RemoteProtocolError(tr("No round has {count} fields.", count=len(fields)))
    proof, motors, power = (_yes(field) for field in (state[0], state[2], state[3]))
    (speed_mm_s,) = read_thousandths(state[4:5], 1)
    tool, acceleration = (_count(field) for field in (state[1], state[5]))
    x, y, z, u, v, w = read_components(state[6:])
    corner = Pose(x_mm=x, y_mm=y, z_mm=z, u_deg=u, v_deg=v, w_deg=w, tool=tool)
    sides = tuple(_sides([*rest, "0", "0"], corner))
    last = sides[-1]
    if count < _SIDES and last.left and last.exit_on is last.before:
        raise RemoteProtocolError(tr("A round ended before its last side."))
    return BeamRound(proof, tool, motors, power, speed_mm_s, float(acceleration), sides)


def _sides(fields: Sequence[str], corner: Pose) -> Iterator[RoundSide]:
    start = corner
    for at in range(0, len(fields), _SIDE_FIELDS):
        seen, *lengths = fields[at : at + _SIDE_FIELDS]
        if not _SEEN.fullmatch(seen):
            raise RemoteProtocolError(tr("{fields} is not a side of a round.", fields=seen))
        before, entry, leaving = map(int, seen)
        x1, y1, x2, y2, x3, y3 = read_thousandths(lengths, 6)
        end = _beside(corner, x3, y3)
        yield RoundSide(
            before == 1,
            entry >= _BY_EDGE,
            entry % _BY_EDGE == 1,
            leaving >= _BY_EDGE,
            leaving % _BY_EDGE == 1,
            start,
            _beside(corner, x1, y1),
            _beside(corner, x2, y2),
            end,
        )
        start = end


_BY_EDGE: Final = 2
"""What is added to the state of an input where its edge ended the way."""


def _beside(corner: Pose, x_mm: float, y_mm: float) -> Pose:
    return replace(corner, x_mm=corner.x_mm + x_mm, y_mm=corner.y_mm + y_mm)


def require_promised(driven: BeamRound) -> None:
    """Refuse a round that was not driven as robolink drives.

    Raises:
        CalibrationError: ``not_low_power``, ``crossing_speed``.
    """
    if driven.power_high or not driven.motors_on:
        raise CalibrationError(
            "not_low_power", tr("The round was not driven in Power Low with the motors on.")
        )
    if not _SLOWEST_MM_S <= driven.speed_mm_s <= _FASTEST_MM_S:
        raise CalibrationError(
            "crossing_speed",
            tr(
                "The round was driven at {speed:g} mm/s; {least:g} to {most:g} are allowed.",
                speed=driven.speed_mm_s,
                least=_SLOWEST_MM_S,
                most=_FASTEST_MM_S,
            ),
        )


def round_crossings(driven: BeamRound, station: "BeamStation") -> "list[Crossing]":
    """Return the crossings of a round, in the tool that it was driven in.

    Raises:
        CalibrationError: ``edge_passed``, ``no_edge``, ``run_up_too_short``: the first that a
            round of robolink would have ended with.
    """
    from robolink.calibration import Crossing
    from robolink.methods.beams import BeamsParameters
    from robolink.methods.beams.drive import RunUp, require_reached

    speed_mm_s = driven.speed_mm_s
    needs = RunUp.at(speed_mm_s, speed_mm_s**2 / (2 * driven.acceleration_mm_s2))
    plan = BeamsParameters(crossing_mm_s=speed_mm_s)
    found = []
    for number, side in enumerate(driven.sides):
        beam = number % 2
        _require_edges(side, beam, off_when_broken=station.off_when_broken)
        found.append(Crossing(beam, side.entry, side.exit))
        require_reached(needs, plan, found[-1], side.start, side.end)
    return found


def _require_edges(side: RoundSide, beam: int, *, off_when_broken: bool) -> None:
    def broken(on: bool) -> bool:
        return on is not off_when_broken

    if broken(side.before) or (side.met and not broken(side.entry_on)):
        raise CalibrationError(
            "edge_passed",
            tr("The tip was past the edge of beam {beam} already.", beam=beam + 1),
        )
    if not side.met or not side.left:
        raise CalibrationError("no_edge", tr("Input of beam {beam} did not switch.", beam=beam + 1))
    if broken(side.exit_on):
        raise CalibrationError(
            "edge_passed",
            tr("The tip was past the edge of beam {beam} already.", beam=beam + 1),
        )


def _yes(field: str) -> bool:
    if field not in ("0", "1"):
        raise RemoteProtocolError(tr("{field!r} is neither 0 nor 1.", field=field))
    return field == "1"


def _count(field: str) -> int:
    if not re.fullmatch("[1-9][0-9]{0,5}", field):
        raise RemoteProtocolError(tr("{field!r} is not a number.", field=field))
    return int(field)
