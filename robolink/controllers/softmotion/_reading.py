"""From the words of a response block to what they say, or to why they cannot be believed.

Words in a wrong order, or read one register too far, make plausible numbers. So the probe is
looked for before anything is believed, and the error names what was found (docs/mailbox.md;
docs/reference/softmotion.md 4.4; docs/reference/faults.md F33, F34, F70).
"""

from collections.abc import Sequence
from typing import Final

from robolink.errors import RemoteProtocolError
from robolink.messages import tr
from robolink.protocols.mailbox import (
    PROBE,
    RESPONSE,
    BlockError,
    BlockFault,
    Response,
    WordOrder,
    decode_response,
    find_probe,
)

PASSING: Final = frozenset({BlockFault.TORN, BlockFault.CRC})
"""What a read in the middle of a change gives, and the next one may not."""


def read_block(words: Sequence[int], *, controller: str) -> Response:
    """Return what a response block says.

    Args:
        words: The block.
        controller: Identity of the PLC.

    Raises:
        BlockError: It was caught in the middle of a change; read it again.
        RemoteProtocolError: It is no mailbox of ours, or its words stand elsewhere.
    """
    try:
        response = decode_response(words)
    except BlockError as error:
        _require_place(words, controller)
        if error.fault in PASSING:
            raise
        raise _foreign(error.fault.meaning, controller) from error
    if response.probe != PROBE:
        _require_place(words, controller)
        raise _foreign(tr("its probe value is missing"), controller)
    if not response.boot_id:
        raise _foreign(tr("its boot_id is 0"), controller)
    if not 0 < response.unit_um < float("inf"):
        raise _foreign(tr("its unit_um is {value}", value=response.unit_um), controller)
    return response


def _require_place(words: Sequence[int], controller: str) -> None:
    """Refuse words whose probe stands elsewhere, or in another order, and say how."""
    found = find_probe(words)
    if found is None:
        return
    shift = found.word - RESPONSE["probe"].word
    if not shift and found.order is WordOrder.LOW_FIRST:
        return
    raise RemoteProtocolError(
        tr(
            "The probe of {controller} stands {shift:+d} registers from its place, in this word "
            "order: {order}.",
            controller=controller,
            shift=shift,
            order=found.order.meaning,
        ),
        remedy=tr(
            "Nothing was written. Low word first at +0 is right: correct the response address in "
            "the URL, or the word order in the PLC's union or in the gateway."
        ),
        controller=controller,
    )


def _foreign(meaning: str, controller: str) -> RemoteProtocolError:
    return RemoteProtocolError(
        tr(
            "What {controller} holds is no mailbox of this version: {meaning}.",
            controller=controller,
            meaning=meaning,
        ),
        remedy=tr(
            "Nothing was written. Compare the addresses in the URL and the program in the PLC "
            "with 'robolink plc export'."
        ),
        controller=controller,
    )
