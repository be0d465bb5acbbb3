"""The flow: from a state and a happening to the next state and an action. Pure.

Nothing here decides whether a touch counts: the runner does, for every face and every script. What
is refused here is what the runner would refuse too, said before it is sent.
"""

import math
from dataclasses import replace

from robolink.calibration_run import ChangeReport
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.runner import (
    FitSubject,
    JogSubject,
    MoveSubject,
    OfferedChoice,
    Question,
    refuse_decimal_comma,
)
from robolink_cli.wizard.happenings import (
    CellIs,
    Effect,
    Happening,
    HasEnded,
    KeyPressed,
    LineTyped,
    MovementHeld,
    OffersAtTheEnd,
    Pressed,
    Reading,
    SaidAtTheEnd,
    SendAnswer,
    TaughtPoints,
    TooFast,
    WaitsForAnswer,
    WasAsked,
    WasRead,
    WasRegarded,
    WasTold,
    WizardCommand,
)
from robolink_cli.wizard.keys import folded, meaning_of, number_in, pose_in, step_of
from robolink_cli.wizard.places import not_yet
from robolink_cli.wizard.questions_flow import (
    PRESSED_AT_THE_END,
    answered_by_key,
    answered_by_line,
    answered_by_press,
    chosen_by_key,
    chosen_by_line,
    into_field,
)
from robolink_cli.wizard.state import (
    ARMED_AFTER_S,
    STEP_SIZES,
    CheckSubject,
    ChoiceSubject,
    Header,
    Jogging,
    LastScreen,
    WizardState,
    subject_of,
)
from robolink_cli.wizard.views.offered import refusal
from robolink_cli.wizard.views.view import view_of

Advanced = tuple[WizardState, list[Effect]]

_MOST_REMARKS = 40
_FREE_STOPS = frozenset({"main", "5", "0", "q"})


def advance(state: WizardState, happening: Happening) -> Advanced:
    """Return the next state, and the action."""
    match happening:
        case WasTold(text=text):
            remarks = (*state.remarks, text)[-_MOST_REMARKS:]
            return replace(state, remarks=remarks, fresh=(*state.fresh, text), message=text), []
        case WasRead(reading=reading):
            return replace(state, reading=_as_far_as_known(state, reading)), []
        case WasRegarded(subject=subject):
            return _regarding(state, subject), []
        case WasAsked():
            return _asked(state, happening), []
        case HasEnded(ended=LastScreen() as ended):
            return replace(state, ended=ended, message=""), []
        case HasEnded():
            return state, []
        case WaitsForAnswer():
            return _waiting(state, happening.at_s), []
        case TooFast():
            return state.says(tr("Looked like a scanner; ignored. Type it again.")), []
        case LineTyped():
            return _line(state, happening)
        case KeyPressed():
            return _key(state, happening)
        case Pressed():
            return _press(state, happening)


def _regarding(state: WizardState, subject: object) -> WizardState:
    if isinstance(subject, JogSubject):
        jogging = replace(
            state.jogging,
            steps=state.jogging.steps + 1,
            longest=subject.longest,
        )
        reading = state.reading
        if reading is not None:
            reading = replace(reading, pose=subject.after)
        return replace(state, jogging=jogging, reading=reading, message="")
    if isinstance(subject, MoveSubject):
        # Its purpose is shown beside its picture, not above later questions.
        fresh, remarks = (
            tuple(text for text in told if text != subject.purpose)
            for told in (state.fresh, state.remarks)
        )
        moves = replace(state, subject=subject, question=None, waits=False)
        return replace(moves, fresh=fresh, remarks=remarks, carried=True, message="")
    if isinstance(subject, Header):
        return _known(replace(state, header=subject), state.header.simulated, state.header.needle)
    if isinstance(subject, CellIs):
        return _known(state, subject.simulated, subject.needle)
    if isinstance(subject, MovementHeld):
        return replace(state, held_back=subject.why)
    if isinstance(subject, OffersAtTheEnd):
        return replace(state, offers=subject.offers)
    if isinstance(subject, SaidAtTheEnd):
        return replace(state, closing=(*state.closing, subject.text))
    if isinstance(subject, TaughtPoints):
        return replace(state, impact=subject.impact)
    if isinstance(subject, ChangeReport):
        return replace(state, report=subject)
    if isinstance(subject, FitSubject):
        return replace(state, subject=subject, fit=subject)
    if isinstance(subject, OfferedChoice):
        return replace(state, subject=subject_of(subject))
    if isinstance(subject, CheckSubject):
        before = state.subject
        same = isinstance(before, CheckSubject) and before.rows == subject.rows
        # The row under a finger must not change between reading and pressing.
        return replace(state, subject=subject, marked=state.marked if same else None)
    return replace(state, subject=subject)


def _as_far_as_known(state: WizardState, reading: Reading) -> Reading:
    """Return a reading during a movement, with the pose of its start if none was read."""
    before = state.reading
    moving = state.question is None and isinstance(state.subject, MoveSubject)
    if reading.pose is not None or before is None or not moving or reading.halted:
        return reading
    return replace(reading, pose=before.pose, axes=before.axes, follows=False)


def _known(state: WizardState, simulated: bool, needle: str) -> WizardState:
    header = state.header
    simulated, needle = header.simulated or simulated, needle or header.needle
    return replace(state, header=replace(header, simulated=simulated, needle=needle))


def _waiting(state: WizardState, at_s: float) -> WizardState:
    jogging = state.jogging
    if jogging.ended_s > -math.inf:
        jogging = replace(jogging, ended_s=at_s)
    return replace(state, waits=True, jogging=jogging)


def _asked(state: WizardState, asked: WasAsked) -> WizardState:
    size, reading = state.jogging.size, state.reading
    if reading is not None and asked.at_s - reading.at_s > 1.0:
        # A position read before the robot moved is out of date.
        reading = replace(reading, pose=None)
    subject = state.subject
    if isinstance(subject, ChoiceSubject) and asked.kind is Question.YES_NO:
        subject = asked  # the question is not about the list used before
    return replace(
        state,
        subject=subject,
        reading=reading,
        question=asked,
        asked=asked.number,
        held_back="",
        fresh=(),
        heard=state.fresh,
        page=0,
        waits=False,
        typed="",
        typing=False,
        pose_typed="",
        marked=subject.marked if isinstance(subject, ChoiceSubject) else None,
        message="",
        ending=False,
        jogging=Jogging(size=size, quarters=state.jogging.quarters),
    )


def _answer(state: WizardState, text: str) -> Advanced:
    """Send an answer; nothing else is accepted until the work waits again."""
    assert state.question is not None  # noqa: S101 - checked by the caller
    accepted = state.accepted or (state.writing is not None and text == "y")
    sent = replace(state, waits=False, message="", accepted=accepted)
    return sent, [SendAnswer(state.question.number, text)]


def _stop(state: WizardState) -> Advanced:
    """End: by the answer that ends, if there is one, else like Ctrl-C."""
    if state.ending:
        return state, []
    ending = replace(state, ending=True, message=tr("Stopping."))
    question = state.question
    if question is None or not state.waits:
        return ending, [WizardCommand.END_WORK]
    if question.kind is not Question.YES_NO:
        # Ending a plain jog interrupts nothing.
        word = "q" if state.free_jog is None else "done"
        return replace(ending, waits=False), [SendAnswer(question.number, word)]
    if state.writing is not None or confirms(state) is not None:
        return ending, [SendAnswer(question.number, "n")]
    return ending, [WizardCommand.END_WORK]  # the answer no would continue


def armed_anew(state: WizardState, at_s: float) -> WizardState:
    """Return a state whose question is shown anew: earlier keys do not answer it.

    Args:
        state: The state.
        at_s: When it is shown.
    """
    question = state.question
    asked = None if question is None else replace(question, at_s=at_s)
    return replace(state, question=asked, typed="", typing=False, message="")


def _armed(state: WizardState, at_s: float) -> bool:
    return state.question is not None and at_s - state.question.at_s >= ARMED_AFTER_S


def _too_early(state: WizardState, key: KeyPressed) -> bool:
    """Return whether a key belongs to something that began before the field was visible.

    What is left of a code whose beginning was dropped would be another code.
    """
    unasked = not state.waits and not state.typed  # not if already answered
    early = unasked or not _armed(state, key.at_s)
    return early or key.at_s - state.early_s < ARMED_AFTER_S


def _last(state: WizardState, wanted: WizardCommand | None) -> Advanced:
    """Leave the last screen, for good or for a choice on it."""
    return (state, []) if wanted is None else (replace(state, wants=wanted), [wanted])


def _key(state: WizardState, key: KeyPressed) -> Advanced:
    if state.ended is not None:
        return _last(state, chosen_by_key(state, state.ended, key))
    if key.name == "stop" or (key.name == "0" and not (state.has_field and key.text)):
        return _stop(state)
    if stops_at_once(state, key.name):
        return _stop(state)
    if state.has_field and _too_early(state, key):
        said = tr("Typed too early and ignored. Please type it again.")
        return replace(state, early_s=key.at_s, typed="", message=said), []
    if state.question is None or not state.waits or not _armed(state, key.at_s):
        if state.at_place and key.name == "main" and not state.waits:
            return state.says(tr("Wait: the robot is still moving.")), []
        return state, []  # busy: drop
    if state.at_place:
        return _key_at_place(state, key)
    return _taken(state, answered_by_key(state, key))


def _press(state: WizardState, press: Pressed) -> Advanced:
    """Carry out what a view offered; anything else only says why it does nothing."""
    why = refusal(view_of(state, press.at_s), press)
    if why:
        return state.says(why), []
    shown_s = state.question.at_s if state.question is not None else -math.inf
    if state.ended is not None:
        shown_s = state.ended.at_s
    ends = press.action == "leave" and state.ended is None
    if press.at_s - shown_s < ARMED_AFTER_S and not ends:
        return state.says(tr("Pressed too early and ignored. Press it again.")), []
    if state.ended is not None:
        return _last(state, PRESSED_AT_THE_END[press.action])
    if ends:
        return _stop(state)
    if state.at_place:
        return _press_at_place(state, press)
    return _taken(state, answered_by_press(state, press))


def _press_at_place(state: WizardState, press: Pressed) -> Advanced:
    jogging, value = state.jogging, press.value
    match press.action:
        case "jog":
            return _jog(state, value, press.at_s)
        case "size":
            sized = replace(jogging, size=STEP_SIZES.index(float(value)))
            return replace(state, jogging=sized, message=""), []
        case "turn":
            turned = replace(jogging, quarters=(jogging.quarters + 1) % 4)
            return replace(state, jogging=turned, message=""), []
        case "again":
            return _again(state, int(value) if value else None)
        case "pose":
            return _pose_typed(state, value)
        case _:
            return _take(state, press.at_s)


def stops_at_once(state: WizardState, name: str) -> bool:
    """Return whether a key stops, however fast it follows another one.

    Who jogs for its own sake has nothing to record, so the largest key stops too.
    """
    return state.free_jog is not None and name in _FREE_STOPS


def _key_at_place(state: WizardState, key: KeyPressed) -> Advanced:
    if state.typing:
        return _key_in_pose(state, key)
    jogging = state.jogging
    if key.name in (".", "delete"):
        return _begin_pose(state)
    if key.name in ("+", "-"):
        size = jogging.size + (1 if key.name == "+" else -1)
        size = min(max(size, 0), len(STEP_SIZES) - 1)
        return replace(state, jogging=replace(jogging, size=size), message=""), []
    if key.name == "tab":
        turned = replace(jogging, quarters=(jogging.quarters + 1) % 4)
        return replace(state, jogging=turned, message=""), []
    if key.name in ("main", "5", "t"):
        return _take(state, key.at_s)
    if key.name == "/":
        return _again(state)
    if key.name == "q":
        return _stop(state)
    step = step_of(key.name, jogging.step, jogging.quarters)
    return (state, []) if step is None else _jog(state, step, key.at_s)


def _begin_pose(state: WizardState) -> Advanced:
    """Open the field for typing a pose."""
    if state.touch is None or not state.touch.types:
        return state.says(tr("You cannot type a pose here.")), []
    return replace(state, typing=True, typed="", pose_typed="", message=""), []


def _key_in_pose(state: WizardState, key: KeyPressed) -> Advanced:
    """Fill the field; ENTER closes it, and accepts nothing."""
    if key.name != "enter":
        return into_field(state, key), []
    return _pose_typed(replace(state, typing=False), state.typed)


def _pose_typed(state: WizardState, text: str) -> Advanced:
    """Keep a typed pose until it is accepted."""
    numbers = folded(text).replace(";", " ").split()
    if not numbers:
        return replace(state, pose_typed="", message=""), []
    if len(numbers) not in (4, 6):
        return state.says(tr("A pose is X Y Z U, or X Y Z U V W. Nothing was recorded.")), []
    said = tr("Typed: {pose}. [5] or take records it as typed.", pose=" ".join(numbers))
    return replace(state, pose_typed=" ".join(numbers), message=said), []


def _jog(state: WizardState, step: str, at_s: float) -> Advanced:
    jogging = replace(state.jogging, ended_s=at_s)
    return _answer(replace(state, jogging=jogging, pose_typed=""), step)


def _take(state: WizardState, at_s: float) -> Advanced:
    if state.pose_typed:
        return _answer(replace(state, pose_typed=""), f"pose {state.pose_typed}")
    why = not_yet(state, at_s)
    return (state.says(why), []) if why else _answer(state, "done")


def _again(state: WizardState, number: int | None = None) -> Advanced:
    """Repeat an earlier touch: the last one, unless another is named."""
    touch = state.touch
    if touch is None or touch.number < 2 or touch.proof:
        return state.says(tr("There is no earlier touch to repeat.")), []
    if not touch.retakes:
        return _answer(state, "again")
    number = touch.number - 1 if number is None else number
    if not 1 <= number < touch.number:
        return state.says(tr("Touch {k} was not made yet.", k=number)), []
    return _answer(state, f"again {number}")


def _line(state: WizardState, line: LineTyped) -> Advanced:
    if state.ended is not None:
        chosen = chosen_by_line(state, line.text)
        unknown = chosen is None and folded(line.text)
        return _last(state.says(tr("Type one of these words.") if unknown else ""), chosen)
    meaning = meaning_of(line.text)
    question = state.question
    typed = question is not None and question.kind is Question.TEXT
    if meaning == "stop" and not (typed and folded(line.text) not in ("q", "stop", "停止")):
        return _stop(state)
    if question is None or not state.waits:
        return state, []
    listed = typed and isinstance(state.subject, ChoiceSubject)
    settles = typed or question.kind is Question.CHOICE
    if settles and not listed and not _armed(state, line.at_s):
        # The end of a code scanned before the question appeared would be a wrong code.
        return state.says(tr("Typed too early and ignored. Please type it again.")), []
    if state.at_place:
        return _line_at_place(state, line, meaning)
    return _taken(state, answered_by_line(state, line.text))


def _line_at_place(state: WizardState, line: LineTyped, meaning: str) -> Advanced:
    if not folded(line.text):
        return state.says(""), []  # the position is shown again
    if meaning == "take":
        return _stop(state) if state.free_jog is not None else _take(state, line.at_s)
    if meaning == "again":
        return _again(state, number_in(line.text))
    if meaning == "help":
        return state.says(help_at_place(free=state.free_jog is not None)), []
    typed = pose_in(line.text)
    if typed is not None:
        begun, _ = _begin_pose(state)
        return _pose_typed(replace(begun, typing=False), typed) if begun.typing else (begun, [])
    try:
        refuse_decimal_comma(line.text)
    except ConfigError as error:
        return state.says(error.what), []
    return _jog(state, folded(line.text), line.at_s)


def help_at_place(*, free: bool) -> str:
    """Return what can be typed at a place, or while jogging only."""
    if free:
        return tr(
            "Steps: x+0.1 moves 0.1 mm to +X; x y z in mm, u in degrees; several at once: "
            "x+0.1 z-0.5. stop ends."
        )
    return tr(
        "Steps: x+0.1 moves 0.1 mm to +X; x y z in mm, u in degrees; several at once: x+0.1 z-0.5. "
        "take records, pose X Y Z U types one, again 1 makes touch 1 again, stop ends."
    )


def _taken(state: WizardState, said: "WizardState | str") -> Advanced:
    """Send the answer to a question, or only show what happened to it."""
    return _answer(state, said) if isinstance(said, str) else (said, [])


def confirms(state: WizardState) -> CheckSubject | None:
    """Return the check list in question, ``None`` for none."""
    subject = state.subject
    asks = state.question is not None and state.question.kind is Question.YES_NO
    return subject if asks and isinstance(subject, CheckSubject) else None
