"""The errors of SoftMotion that the program tells apart, as a table to be filled in on site."""

import csv
import io
from typing import Final

from robolink.protocols.mailbox._codes import ErrorClass

_ROWS: Final = (
    ("wrongState", "SMC_AXIS_GROUP_WRONG_STATE", "201..204, 209", 11000),
    ("nothingToReset", "SMC_R_NO_ERROR_TO_RESET", ErrorClass.NOTHING_TO_RESET.value, 120),
    ("noSuchMovement", "", ErrorClass.NO_SUCH_MOVEMENT.value, ""),
    ("notAtContinue", "", ErrorClass.WRONG_STATE.value, ""),
    (
        "toolIncompatible",
        "SMC_AXIS_GROUP_TOOL_OFFSET_INCOMPATIBLE_WITH_KINEMATICS",
        f"{ErrorClass.TOOL_INCOMPATIBLE.value}, {ErrorClass.NO_ORIENTATION_IMAGE.value}",
        "",
    ),
    ("axesMismatch", "", ErrorClass.NO_KINEMATICS.value, ""),
    ("unreachable", "", ErrorClass.UNREACHABLE.value, ""),
    ("axisLimit", "", ErrorClass.UNREACHABLE.value, 10),
    ("posture", "", ErrorClass.UNREACHABLE.value, ""),
    ("parameter", "", ErrorClass.OPERAND.value, ""),
    ("dynamics", "", ErrorClass.DYNAMICS.value, ""),
    ("noPower", "", ErrorClass.AXIS.value, 14),
    ("axisError", "", ErrorClass.AXIS.value, 2),
    (
        "byAxis",
        "SMC_AXIS_GROUP_INTERRUPTED_BY_SINGLE_AXIS",
        ErrorClass.INTERRUPTED_BY_AXIS.value,
        "",
    ),
    ("pcsInUse", "SMC_AXIS_GROUP_PCS_STILL_IN_USE", ErrorClass.WRONG_STATE.value, ""),
    (
        "blending",
        "SMC_BLENDING_NOT_SUPPORTED_BY_PREVIOUS_MOVEMENT",
        ErrorClass.WRONG_STATE.value,
        "",
    ),
)


def error_table_csv() -> str:
    """Return the table: member of ``RL_Machine.numbers``, symbol, error class, number.

    A symbol or number is given where a document or a field report names it
    (docs/reference/softmotion.md 1.4); what is empty stands in the Library Manager.
    """
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(("member", "symbol", "error_class", "number"))
    rows.writerows(_ROWS)
    return text.getvalue()
