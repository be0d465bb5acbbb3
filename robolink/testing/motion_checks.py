"""Promises about movement: inside the box, for the selected tool, and ended by a stop."""

from dataclasses import replace
from typing import Final

from robolink.errors import (
    BusyError,
    JournalError,
    LimitError,
    NotReadyError,
    OutcomeUnknownError,
    RobolinkError,
    StoppedError,
)
from robolink.model import (
    Controller,
    Jump,
    MotionOutcome,
    MotionProfile,
    Path,
    Pose,
    ToolOffset,
    WorkBox,
)
from robolink.testing.guard_checks import (
    defined,
    forbidden_acts,
    full_record,
    left_unsettled,
    stopped_when_marked,
)
from robolink.testing.subject import Check, Subject, refused, require

_SLACK_MM: Final = 0.1
_SLACK_DEG: Final = 0.1
_LOOKED_S: Final = 0.3
_TIMEOUT_S: Final = 30.0
_PROFILE: Final = MotionProfile(Path.STRAIGHT, speed_mm_s=10.0)


def a_movement_arrives(subject: Subject) -> None:
    """And back again; the pose is measured, and names its tool."""
    with subject.movable() as controller:
        group = controller.groups[0]
        start = group.pose()
        require(start.tool == controller.tools.selected(), "a pose names the tool in force")
        for target in (_raised(start, subject.step_mm), start):
            motion = group.move_to(target, _PROFILE, box=_around(start, subject))
            require(motion.target == target, "a motion says where it goes")
            outcome = motion.wait(timeout_s=_TIMEOUT_S)
            require(outcome is MotionOutcome.ARRIVED, "a movement that ends by itself arrives")
            _is_at(controller, target, "it stands where it was sent")
        require(not controller.outcomes.open_markers(), "nothing is left open")


def nothing_moves_out_of_the_box(subject: Subject) -> None:
    """Whoever sends it there made a mistake."""
    with subject.movable() as controller:
        group = controller.groups[0]
        start = group.pose()
        with refused(LimitError, "a target outside of the box is refused"):
            far = _raised(start, 10 * subject.step_mm)
            group.move_to(far, _PROFILE, box=_around(start, subject))
        _stands(controller, start)


def a_target_counts_for_its_own_tool(subject: Subject) -> None:
    """The same numbers mean another place for another tool."""
    with subject.movable() as controller:
        group = controller.groups[0]
        start = group.pose()
        other = replace(start, tool=15 if start.tool != 15 else 14)
        with refused(NotReadyError, "a target for a tool that is not in force is refused"):
            group.move_to(other, _PROFILE, box=_around(start, subject))
        _stands(controller, start)


def a_preview_of_a_movement_moves_nothing(subject: Subject) -> None:
    """It says what would be sent."""
    with subject.movable() as controller:
        group = controller.groups[0]
        start = group.pose()
        requests = group.requests_for(_raised(start, subject.step_mm), _PROFILE)
        require(requests and all(requests), "requests_for() says what would be sent")
        _stands(controller, start)


def a_stop_ends_a_movement(subject: Subject) -> None:
    """Whoever waits on it is told, and the next one is held back."""
    with subject.movable() as controller:
        group = controller.groups[0]
        start = group.pose()
        box = _around(start, subject)
        motion = group.move_to(_raised(start, subject.step_mm), _PROFILE, box=box)
        with subject.releasing_stop(controller):
            controller.stop()
            with refused(StoppedError, "who waits on a movement that is stopped gets StoppedError"):
                motion.wait(timeout_s=_TIMEOUT_S)
            with refused(StoppedError, "after a stop nothing moves"):
                group.move_to(start, _PROFILE, box=box)
            rest = group.pose()
            controller.clock.sleep(_LOOKED_S)
            _is_at(controller, rest, "what was stopped stands still")


def what_is_unsettled_holds_movements_back(subject: Subject) -> None:
    """Nobody knows how long the selected tool is then, nor where the robot was to go."""
    with left_unsettled(subject) as second:
        if second is not None:
            subject.prepare(second)
            promise = "nothing moves while something is unsettled"
            _refuses_to_move(second, subject, OutcomeUnknownError, promise)


def nothing_moves_that_cannot_be_recorded(subject: Subject) -> None:
    """A process that is killed in a movement without a marker leaves nothing that would block."""
    with subject.movable() as controller, full_record(controller):
        promise = "nothing moves that cannot be recorded"
        _refuses_to_move(controller, subject, JournalError, promise)


def a_stop_in_the_last_instant_holds_a_movement_back(subject: Subject) -> None:
    """Between the marker and the request nothing fits but a stop, and the stop comes first."""
    with subject.movable() as controller:
        with subject.releasing_stop(controller), stopped_when_marked(controller):
            promise = "nothing moves where a stop came before it left"
            _refuses_to_move(controller, subject, StoppedError, promise)
        require(not controller.outcomes.open_markers(), "it was not sent: nothing is open")


def nothing_is_written_while_it_moves(subject: Subject) -> None:
    """The movement would end somewhere else than its target says."""
    with subject.kept() as controller:
        subject.prepare(controller)
        tools, group = controller.tools, controller.groups[0]
        before, selected = defined(controller, subject.tool), tools.selected()
        acts = forbidden_acts(controller, subject.tool)
        start = group.pose()
        box = _around(start, subject)
        motion = group.move_to(_raised(start, subject.step_mm), _PROFILE, box=box)
        try:
            for name, act in acts.items():
                with refused((BusyError, NotReadyError), f"{name} is refused while it moves"):
                    act()
        finally:
            motion.wait(timeout_s=_TIMEOUT_S)
        require(tools.same(tools.read(subject.tool), before), "the old value is still there")
        require(tools.selected() == selected, "no tool was selected meanwhile")
        group.move_to(start, _PROFILE, box=box).wait(timeout_s=_TIMEOUT_S)


def _refuses_to_move(
    controller: Controller, subject: Subject, kind: type[RobolinkError], promise: str
) -> None:
    group = controller.groups[0]
    start = group.pose()
    with refused(kind, promise):
        target, box = _raised(start, subject.step_mm), _around(start, subject)
        group.move_to(target, _PROFILE, box=box).wait(timeout_s=_TIMEOUT_S)
    _is_at(controller, start, promise)


def _raised(pose: Pose, by_mm: float) -> Pose:
    return replace(pose, z_mm=pose.z_mm + by_mm)


def _around(pose: Pose, subject: Subject) -> WorkBox:
    reach_mm = 2 * subject.step_mm
    return WorkBox.around(pose, xy_mm=reach_mm, below_mm=reach_mm, above_mm=reach_mm)


def _stands(controller: Controller, start: Pose) -> None:
    _is_at(controller, start, "nothing has moved")


def _is_at(controller: Controller, wanted: Pose, promise: str) -> None:
    """Require a place in all directions, and the orientation there."""
    here, there = controller.groups[0].pose().coordinates(), wanted.coordinates()
    off = Jump.between(ToolOffset(*there), ToolOffset(*here))
    at = off.length_mm < _SLACK_MM and off.angle_deg < _SLACK_DEG
    require(at, f"{promise}: {off.length_mm:.3f} mm and {off.angle_deg:.3f} deg off")


MOVING_CHECKS: Final[tuple[Check, ...]] = (
    a_movement_arrives,
    nothing_moves_out_of_the_box,
    a_target_counts_for_its_own_tool,
    a_preview_of_a_movement_moves_nothing,
    a_stop_ends_a_movement,
    what_is_unsettled_holds_movements_back,
    nothing_moves_that_cannot_be_recorded,
    a_stop_in_the_last_instant_holds_a_movement_back,
)
"""Checks that move the robot, one step up and down again."""

WRITING_WHILE_MOVING_CHECKS: Final[tuple[Check, ...]] = (nothing_is_written_while_it_moves,)
"""Checks that move and write, so a tool that may be written must be given."""
