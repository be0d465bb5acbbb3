"""Which face this terminal gets."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from robolink_cli.wizard.work import Face


def face_here() -> "Face":
    """Return the face for this process's terminal."""
    from robolink_cli.wizard.faces.lines import LineFace

    return LineFace()
