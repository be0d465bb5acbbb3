"""Does what the flow wants done; the same for every face."""

from typing import Final

from robolink.interrupts import EndedBy, end
from robolink_cli.wizard.desk import Desk
from robolink_cli.wizard.happenings import Effect, SendAnswer, WizardCommand

_END: Final = WizardCommand.END_WORK


def carry_out(desk: Desk, effects: list[Effect]) -> None:
    """Send answers, or end the work."""
    for effect in effects:
        if isinstance(effect, SendAnswer):
            desk.answer(effect)
        elif effect is _END:
            end(EndedBy.CTRL_C)


def leaves(effects: list[Effect]) -> bool:
    """Tell whether the last screen is left, for good or for what was chosen there."""
    return any(isinstance(one, WizardCommand) for one in effects if one is not _END)
