"""What follows once the tool of a held board is written: select it, jog the board, teach the place.

These are the steps of EPSON's chapter about held boards after CalcBoardTool
(docs/reference/vision.md). The place is taught in the board's own tool: then a board that is held
otherwise next time is put down at the same place and angle.
"""

from robolink.messages import tr
from robolink.methods.declaration.method import NextStep


def board_steps(tool: int) -> tuple[NextStep, ...]:
    """Return the three steps.

    Args:
        tool: Number of the tool that was written.
    """
    return (
        NextStep(
            "select",
            tr("Select tool {tool}, so that positions are those of the board.", tool=tool),
            f"tool select {tool}",
        ),
        NextStep("jog", tr("Jog the board to where it is to be put down."), "robot jog"),
        NextStep(
            "teach",
            tr(
                "Teach that place with tool {tool} selected: on the pendant, or in the program "
                "with the position that this shows.",
                tool=tool,
            ),
            "robot where",
        ),
    )
