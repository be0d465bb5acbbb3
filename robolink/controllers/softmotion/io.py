"""Inputs and outputs that the PLC's program offers by number (opcodes 30006 and 30007)."""

from robolink.controllers.driver_link import DriverPart
from robolink.controllers.softmotion.answers import describe
from robolink.controllers.softmotion.mailbox import Mailbox, MarkedDraft
from robolink.protocols.mailbox import Command, Opcode


class SoftMotionIo(DriverPart):
    """Reads inputs and sets outputs; both need the ownership.

    An output cannot be read back through the mailbox: the PLC's acknowledgement is the proof.
    """

    def __init__(self, mailbox: Mailbox) -> None:
        super().__init__(mailbox)
        self._mailbox = mailbox

    def read_input(self, bit: int) -> bool:
        """Read whether an input is on; raises like :meth:`read_value`."""
        return self.read_value(bit) != 0

    def read_value(self, number: int) -> int:
        """Read an input as the number, 0 to 65535, that the PLC's program gives for it.

        Raises:
            LeaseHeldError, LeaseLostError: Another client owns the mailbox.
            RejectedError: There is no such input, or the program offers none.
        """
        draft = Command(0, Opcode.READ_INPUT, operands=(number, 0, 0, 0))
        return self._mailbox.commands.carry_out(draft).answer.input_value

    def set_output(self, bit: int, on: int) -> None:
        """Set an output, to 0 or 1 or to a number that the PLC's program understands.

        Raises:
            NotReadyError: The machine does not permit it.
            RejectedError: There is no such output; nothing was written.
            OutcomeUnknownError: No answer came; motion is blocked until ``recover``.
        """
        draft = _set_draft(bit, on)
        mailbox, request = self._mailbox, describe(draft)
        with mailbox.lock.held(request):
            mailbox.prepare(draft, request)
            marked = {"output": bit, "requested": int(on)}
            mailbox.carry_out(MarkedDraft(mailbox, draft, marked, _nothing))

    def preview_output(self, bit: int, on: int) -> tuple[str, ...]:
        """Return what :meth:`set_output` would send, in words."""
        return (describe(_set_draft(bit, on)),)


def _set_draft(number: int, value: int) -> Command:
    return Command(0, Opcode.WRITE_OUTPUT, operands=(number, int(value), 0, 0))


def _nothing() -> None:
    """Read nothing: an output cannot be read back."""
