"""The data types of SoftMotion that a program names, as far as documents show them.

Source: docs/reference/softmotion.md 1.3, 2.4, 2.6. That the union of positions calls its array
``v`` is assumed, here and on one marked line of the exported adapter.
"""

from collections.abc import Mapping, Sequence
from typing import Final

from robolink_simulators.softmotion.options import SmcNumbers
from robolink_simulators.softmotion.smc_errors import ErrorKind, SmcError
from robolink_simulators.structured_text.data_types import (
    BOOL,
    ELEMENTARY,
    LREAL,
    ArrayType,
    BlockType,
    DataType,
    Family,
    OpaqueType,
    ScalarType,
    StructType,
    members_of,
)

_MEMBERS: Final[Mapping[str, ErrorKind]] = {
    "wrongstate": ErrorKind.WRONG_STATE,
    "nothingtoreset": ErrorKind.NOTHING_TO_RESET,
    "nosuchmovement": ErrorKind.NO_SUCH_MOVEMENT,
    "notatcontinue": ErrorKind.NOT_AT_CONTINUE_POSITION,
    "toolincompatible": ErrorKind.TOOL_INCOMPATIBLE,
    "axesmismatch": ErrorKind.AXES_MISMATCH,
    "unreachable": ErrorKind.UNREACHABLE,
    "axislimit": ErrorKind.AXIS_LIMIT,
    "posture": ErrorKind.CONFIGURATION,
    "parameter": ErrorKind.PARAMETER,
    "dynamics": ErrorKind.DYNAMICS,
    "nopower": ErrorKind.NO_POWER,
    "axiserror": ErrorKind.AXIS_ERROR,
    "pcsinuse": ErrorKind.PCS_STILL_IN_USE,
    "blending": ErrorKind.BLENDING_NOT_SUPPORTED,
    "byaxis": ErrorKind.INTERRUPTED_BY_SINGLE_AXIS,
}
"""Kinds of errors by the member of RL_Numbers that gives their number."""


class ErrorNumbers:
    """One number for each error.

    Args:
        known: The numbers that the options give; 0 for those that nobody knows.
    """

    def __init__(self, known: SmcNumbers) -> None:
        self._numbers = {
            kind: known.error(kind).number or -order for order, kind in enumerate(ErrorKind, 1)
        }
        # One symbol covers both (documented): the program distinguishes them by the kinematics.
        both = self._numbers[ErrorKind.TOOL_INCOMPATIBLE]
        self._numbers[ErrorKind.NO_ORIENTATION_IMAGE] = both

    def number(self, error: SmcError) -> int:
        """Return the ErrorID of an error; a drive's own number stays."""
        return error.number or self._numbers[error.kind]

    def members(self) -> Mapping[str, int]:
        """Return what RL_Numbers holds, by member."""
        return {member: self._numbers[kind] for member, kind in _MEMBERS.items()}


SIX: Final = ArrayType(((0, 5),), LREAL)
MASKS: Final = ArrayType(((0, 5),), BOOL)
ERROR_ID: Final = ELEMENTARY["DINT"]
COORD_SYSTEM: Final = ScalarType("SMC_COORD_SYSTEM", Family.INTEGER, 16, True)
COUPLED: Final = "TRAFO.Kin_Coupled"
BUFFER_MODE: Final = ScalarType("MC_BUFFER_MODE", Family.INTEGER, 16, True)
READ_MODE: Final = ScalarType("SMC_READ_TOOL_MODE", Family.INTEGER, 16, True)
AXIS_GROUP: Final = OpaqueType("AXIS_GROUP_REF_SM3")
CONTINUE_DATA: Final = StructType("SMC_AXIS_GROUP_CONTINUE_DATA", members_of([("written", BOOL)]))
COORD_REF: Final = StructType("MC_COORD_REF", members_of([(name, LREAL) for name in "xyzabc"]))
POSITION: Final = StructType("SMC_POS_REF", members_of([("v", SIX)]))

_SYSTEMS: Final = ("ACS", "MCS", "WCS", "PCS_1", "PCS_2", "TCS")
_MODES: Final = (
    "Aborting",
    "Buffered",
    "BlendingLow",
    "BlendingPrevious",
    "BlendingNext",
    "BlendingHigh",
)

SYMBOLS: Final[Mapping[ScalarType, Sequence[str]]] = {COORD_SYSTEM: _SYSTEMS, BUFFER_MODE: _MODES}
"""Names of enumeration members, in the order of their numbers."""


def kinematics_types(name: str) -> Mapping[str, DataType]:
    """Return the blocks of a kinematics by name, in capital letters.

    Of two that are coupled there are three: each, and ``Kin_Coupled``, whose inputs take them
    (docs/reference/softmotion.md 3.1).

    Args:
        name: Of a block, or of two with a + between them.
    """
    position, plus, orientation = name.partition("+")
    if not plus:
        return {f"TRAFO.{name}".upper(): OpaqueType(f"TRAFO.{name}", name)}
    first = OpaqueType(f"TRAFO.{position}", position)
    second = OpaqueType(f"TRAFO.{orientation}", orientation)
    # Types of the same name, empty until the program fills them.
    empty = (OpaqueType(first.name), OpaqueType(second.name))
    pins = members_of(tuple(zip(("itfPosKin", "itfOriKin"), empty, strict=True)), "var_input")
    made = (first, second, BlockType(COUPLED, pins))
    return {of.name.upper(): of for of in made}


def foreign_types() -> Mapping[str, DataType]:
    """Return the types by name, in capital letters."""
    named = (READ_MODE, COORD_SYSTEM, BUFFER_MODE, AXIS_GROUP, CONTINUE_DATA, COORD_REF, POSITION)
    return {of.name.upper(): of for of in named}
