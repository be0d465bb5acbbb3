"""A movement until an input switches is not begun when the input has switched before."""

from robolink.errors import NotReadyError, NotReadyReason
from robolink.messages import tr
from robolink.model import InputEdge


def require_edge_ahead(edge: InputEdge, on: bool, *, controller: str, request: str) -> None:
    """Refuse an input that shows already what the movement waits for.

    An EPSON controller would take such a movement for finished at once, and a PLC would drive
    on to the target, the tip perhaps in contact (docs/reference/spel.md 7.1, docs/mailbox.md).

    Raises:
        NotReadyError: Names the input.
    """
    if edge.awaited(on):
        raise NotReadyError(
            tr(
                "Input {number} is {state} before the movement begins.",
                number=edge.number,
                state=tr("on") if on else tr("off"),
            ),
            reason=NotReadyReason.EDGE_PASSED,
            remedy=tr(
                "Nothing was moved. Check the number of the input, clean the sensor, and bring "
                "the tip clear of it."
            ),
            controller=controller,
            request=request,
        )
