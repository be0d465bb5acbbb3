"""The vocabulary in which a procedure asks for things to happen.

A procedure is a generator. It yields steps and is sent what came of them; its return value
is a proposal. It knows no controller, no clock and no person, so it can be tested by feeding
it numbers, shown before anything moves, and replayed from a record.
"""

from collections.abc import Generator
from dataclasses import dataclass
from typing import Any, TypeVar

from robolink.model import InputEdge, Path, Pose


@dataclass(frozen=True, slots=True)
class Move:
    """Drive the frame in force to ``target``; answered with the pose that was reached."""

    target: Pose
    path: Path
    purpose: str


@dataclass(frozen=True, slots=True)
class Ask:
    """Let a person bring the tip onto the reference point; answered with the pose then."""

    instruction: str


@dataclass(frozen=True, slots=True)
class Seek:
    """Drive the frame in force straight on until an input switches; answered with the pose then.

    When the input shows the edge already, or not on the way, whoever runs the procedure throws
    CalibrationError ``edge_passed`` or ``no_edge`` into it. The frame is then where it was, or
    at ``target``.
    """

    target: Pose
    edge: InputEdge
    speed_mm_s: float
    purpose: str


@dataclass(frozen=True, slots=True)
class Tell:
    """Let a person know how it goes; answered with ``None``."""

    text: str


@dataclass(frozen=True, slots=True)
class Offer:
    """Offer something that a person may accept; answered with whether they did.

    Where nobody is to be asked, the answer is ``False``: a measurement never depends on it.
    """

    question: str


Step = Move | Ask | Seek | Tell | Offer

T = TypeVar("T")
Procedure = Generator[Step, Any, T]
"""Yields steps, is sent what each step is answered with, returns a result.

The type of an answer follows from the step, which a generator's type cannot say.
"""
