"""Before a procedure moves the robot: one question, or the check list of a wizard."""

from typing import TYPE_CHECKING

from robolink.errors import DeclinedError, NotReadyError, NotReadyReason
from robolink.messages import joined, tr
from robolink_cli.prompts.current_desk import current_desk
from robolink_cli.session.motion_consent import (
    agree_to_motion,
    heed_what_was_left,
    motion_question,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from robolink.model import Controller, MotionTerms
    from robolink.stations import StationKind
    from robolink_cli.prompts.current_desk import AskingDesk
    from robolink_cli.wizard.state import CheckPoint


def agree_to_procedure(
    controller: "Controller",
    purpose: str,
    *,
    moves: int,
    speed_mm_s: float,
    box_mm: float,
    yes: bool,
    at: "StationKind | None",
    tools: "Sequence[int]" = (),
) -> None:
    """Let a person agree to a procedure in which the robot moves by itself.

    Args:
        controller: The controller, connected.
        purpose: What it moves for, in words.
        moves: How many movements are foreseen.
        speed_mm_s: How fast at most.
        box_mm: How far at most.
        yes: Whether the answer was given in advance.
        at: At what it measures, which has to be clean too; ``None`` where nobody knows.
        tools: Numbers of the tools that are measured: the list says how they were left.

    Raises:
        NotReadyError: Nothing can move now.
        StoppedError, DeclinedError: As :func:`agree_to_motion`.
    """
    if yes or current_desk() is None:
        question = motion_question(controller, purpose, speed_mm_s=speed_mm_s, box_mm=box_mm)
        agree_to_motion(question, yes=yes)
        return
    check_before_start(
        controller,
        purpose,
        moves=moves,
        speed_mm_s=speed_mm_s,
        box_mm=box_mm,
        at=at,
        tools=tools,
    )


def check_before_start(
    controller: "Controller",
    purpose: str,
    *,
    moves: int,
    speed_mm_s: float,
    box_mm: float,
    at: "StationKind | None",
    tools: "Sequence[int]" = (),
    takes: str = "",
) -> None:
    """Let the person at the desk go through the list; arguments as above.

    ``takes`` says how long the robot will take, in a sentence.

    Raises:
        NotReadyError: Nothing can move now, and no key of the list changes that.
        StoppedError, DeclinedError: As :func:`agree_to_motion`.
    """
    desk = current_desk()
    assert desk is not None  # noqa: S101 - checked by the caller
    heed_what_was_left(yes=False)
    foreseen = {"n": moves, "v": f"{speed_mm_s:g}", "d": f"{box_mm:g}"}
    if controller.capabilities.low_power:
        plan = tr(
            "The robot will move by itself {n} times: power LOW, up to {v} mm/s, at most {d} mm "
            "from here.",
            **foreseen,
        )
    else:
        plan = tr(
            "The robot will move by itself {n} times: up to {v} mm/s, at most {d} mm from here.",
            **foreseen,
        )
    plan = joined(" ", [plan, takes]) if takes else plan
    tried, left = False, (saved_tools(controller), *_as_left(controller, tools))
    new = _new_nozzle(at)
    while _answer_to_list(desk, controller, purpose, plan, left, new, tried=tried) != "y":
        controller.motors(True)
        tried = True


def name_the_needle(
    controller: "Controller", ids: "Callable[[Callable[[str], str]], Iterator[str]]"
) -> None:
    """Let the person at the desk name what is mounted, before anything moves.

    Args:
        controller: Looked at meanwhile.
        ids: Asks for each id by the function that it is given, and yields it.

    Raises:
        DeclinedError: The person leaves.
    """
    from robolink_cli.wizard.happenings import CellIs

    desk = current_desk()
    assert desk is not None  # noqa: S101 - checked by the caller
    named = list(ids(lambda question: _text(desk, controller, question)))
    if named:
        desk.regard(CellIs(needle=", ".join(named)))


def _text(desk: "AskingDesk", controller: "Controller", question: str) -> str:
    from robolink.runner import POLL_S, Question

    desk.regard(None)
    desk.ask(question, Question.TEXT)
    while (answer := desk.poll(POLL_S)) is None:
        controller.status()
    if answer == "q":
        raise DeclinedError(
            tr("You did not start it."), remedy=tr("To start, give the same command again.")
        )
    return answer


def _answer_to_list(
    desk: "AskingDesk",
    controller: "Controller",
    purpose: str,
    plan: str,
    left: "tuple[CheckPoint, ...]",
    new: str,
    *,
    tried: bool,
) -> str:
    """Show the list; return ``y``, or that the motors are to be switched on.

    Args:
        desk: Where.
        controller: The controller, connected.
        purpose: What it moves for, in words.
        plan: What it will do, a sentence.
        left: Whether the tools are saved, and how they were left.
        new: What the person confirms of the new nozzle.
        tried: Whether it was told before to switch them on: asking once more would not help.

    Raises:
        DeclinedError: The person leaves.
        NotReadyError: Nothing can move now, and no key of the list changes that.
    """
    from robolink.model import AnsweredBy
    from robolink.runner import POLL_S, Question
    from robolink_cli.prompts.questions import keep_answer
    from robolink_cli.wizard.state import SWITCH_ON, CheckSubject, Mark

    off = _motors_are_off(controller, purpose, tried=tried)
    name, terms = _name(controller), controller.groups[0].terms()
    desk.regard(CheckSubject(_points(name, terms, left, new, off=off), plan))
    desk.ask(tr("Start moving"), Question.YES_NO)
    while (answer := desk.poll(POLL_S)) is None:
        now = _motors_are_off(controller, purpose, tried=tried)
        if now is not off:
            # The list shows the present state; items that the person confirmed stay confirmed.
            off = now
            desk.regard(CheckSubject(_points(name, terms, left, new, off=off), plan))
    if answer == SWITCH_ON:
        return answer
    if answer == "y":
        controller.groups[0].require_able(purpose)
        for point in _points(name, terms, left, new, off=off):
            if point.mark is Mark.YOU:
                keep_answer(point.text, True, AnsweredBy.PERSON)
        keep_answer(joined(" ", (plan, tr("Start moving"))), True, AnsweredBy.PERSON)
        return answer
    raise DeclinedError(
        tr("You did not start it."), remedy=tr("To start, give the same command again.")
    )


def _motors_are_off(controller: "Controller", purpose: str, *, tried: bool) -> bool:
    """Return whether the motors are off, which a key of the list changes.

    Raises:
        NotReadyError: Something else stands in the way, or that key was pressed before.
    """
    try:
        controller.groups[0].require_able(purpose)
    except NotReadyError as error:
        off = error.reason is NotReadyReason.MOTORS_OFF and controller.capabilities.motors
        if not off or tried:
            raise
        return True
    return False


def saved_tools(controller: "Controller") -> "CheckPoint":
    """Return the point that names the backup of the tools on this computer.

    What it says is read from that file. A missing one keeps nobody from measuring: whatever writes
    makes it first.

    Args:
        controller: The controller, connected.
    """
    from robolink.backup import kept_backup
    from robolink.errors import ConfigError
    from robolink.timing import local_label
    from robolink_cli.wizard.state import CheckPoint, Mark

    if not controller.outcomes.durable:
        gone = tr("The tools are not saved: the simulation ends with this command")
        return CheckPoint(Mark.LOOK, gone)
    try:
        backup = kept_backup(controller)
    except ConfigError as error:
        return CheckPoint(Mark.LOOK, tr("The tools are not saved: {cause}", cause=error.what))
    if backup is None:
        missing = tr("The tools are not saved: this computer has no backup of this controller")
        return CheckPoint(Mark.LOOK, missing)
    count, when = len(controller.tools.indices()), local_label(backup.saved_at)
    return CheckPoint(Mark.OK, tr("All {n} tools are saved: backup of {when}", n=count, when=when))


def _as_left(controller: "Controller", tools: "Sequence[int]") -> "Iterator[CheckPoint]":
    from robolink_cli.wizard.state import CheckPoint, Mark

    for sentence in tools_as_left(controller, tools):
        yield CheckPoint(Mark.OK, sentence)


def tools_as_left(controller: "Controller", tools: "Sequence[int]") -> tuple[str, ...]:
    """Return a sentence for each tool that still holds its last confirmed value.

    One that holds something else was told of already, one without a record says nothing.

    Args:
        controller: The controller, connected.
        tools: Numbers of the tools.
    """
    from robolink.model import describe_offset
    from robolink.timing import local_label
    from robolink.transaction import changed_since, last_proof

    said = []
    for tool in tools:
        now, last = controller.tools.read(tool), last_proof(controller, tool)
        if now is None or last is None or changed_since(controller, tool, now) is not None:
            continue
        facts = {"t": tool, "value": describe_offset(now), "when": local_label(last.at)}
        nozzle = last.signature.nozzle
        said.append(
            tr(
                "Tool {t} is unchanged since the last change: {value}. {when}, needle {id}.",
                **facts,
                id=nozzle,
            )
            if nozzle
            else tr("Tool {t} is unchanged since the last change: {value}. {when}.", **facts)
        )
    return tuple(said)


def _points(
    name: str, terms: "MotionTerms", left: "tuple[CheckPoint, ...]", new: str, *, off: bool
) -> "tuple[CheckPoint, ...]":
    from robolink_cli.wizard.state import CheckPoint, Mark

    points = [
        CheckPoint(Mark.OK, tr("Controller answers: {name}", name=name)),
        *([CheckPoint(Mark.OK, terms.able)] if terms.able else ()),
        *left,
        CheckPoint(Mark.OK, terms.watch),
    ]
    clear = tr("Nobody in the cell, hoses free")
    points.append(CheckPoint(Mark.YOU, new, "mounted", tr("Yes")))
    points.append(CheckPoint(Mark.YOU, clear, "clear", tr("Yes")))
    # Last, after the person has looked into the cell; the rows above keep their numbers.
    if off:
        points.append(CheckPoint(Mark.TO_DO, tr("Motors are off"), "motors", tr("Switch them on")))
    else:
        points.append(CheckPoint(Mark.OK, tr("Motors are on")))
    return tuple(points)


def _new_nozzle(at: "StationKind | None") -> str:
    """Return what the person confirms of the new nozzle, and of what it is measured at."""
    from robolink.stations import StationKind

    match at:
        case StationKind.PIN:
            clean = tr("tip and pin are clean")
        case StationKind.BEAMS:
            clean = tr("tip and beams are clean")
        case StationKind.TOUCH:
            clean = tr("tip and surface are clean")
        case StationKind.CAMERA:
            clean = tr("tip and camera are clean")
        case _:
            clean = tr("the tip is clean")
    return tr("The new nozzle is mounted and tight; {clean}", clean=clean)


def _name(controller: "Controller") -> str:
    facts = controller.facts()
    serial = facts.controller_serial and tr("serial {serials}", serials=facts.controller_serial)
    firmware = facts.firmware or ""
    if firmware[:1].isdigit():  # a PLC says "mailbox 1.0"
        firmware = tr("firmware {version}", version=firmware)
    said = (*facts.robot_models, serial, firmware)
    return ", ".join(one for one in said if one) or controller.identity
