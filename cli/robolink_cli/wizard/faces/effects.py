"""Does what the flow wants done; the same for every face."""

from robolink.interrupts import EndedBy, end
from robolink_cli.wizard.desk import Desk
from robolink_cli.wizard.happenings import Effect, SendAnswer, WizardCommand


def carry_out(desk: Desk, effects: list[Effect]) -> None:
    """Send answers, or end the work."""
    for effect in effects:
        if isinstance(effect, SendAnswer):
            desk.answer(effect)
        elif effect is WizardCommand.END_WORK:
            end(EndedBy.CTRL_C)


def leaves(effects: list[Effect]) -> bool:
    """Tell whether the last screen is left, to end or to begin again."""
    return any(one in (WizardCommand.LEAVE, WizardCommand.BEGIN_AGAIN) for one in effects)
