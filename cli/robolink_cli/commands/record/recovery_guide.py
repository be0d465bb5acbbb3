"""A recovery, step by step: findings, actions, and questions to a person."""

from collections.abc import Collection, Iterator
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from robolink.errors import ControllerError
from robolink.messages import declared, spoken, tr
from robolink.model import AnsweredBy, Controller, Finding, MarkerKind, Pose, begun_in_words
from robolink.stations import StationKind
from robolink.timing import local_label
from robolink.transaction import Recovery, Settler, look
from robolink_cli.console.person import person_here
from robolink_cli.console.render import json_is_on, note, say
from robolink_cli.prompts.operator import operator_at
from robolink_cli.prompts.questions import agree, asked, keep_answer
from robolink_cli.session.check_before_start import agree_to_procedure
from robolink_cli.views.documents import finding_payload, pose_payload

if TYPE_CHECKING:
    from robolink.calibration import VerifyResult
    from robolink.calibration_run import OpenTurnTest
    from robolink.inspection import CellRecovery

DECLINED: Final = 9
LEFT: Final = 6
_NOTHING: Final = declared("No job is left unfinished on this controller.")


class Guide:
    """One recovery on one controller.

    Attributes:
        declined: Whether a person looked at something and left it open.

    Args:
        controller: The controller, connected.
        keep: Whether new values that nobody verified stay.
        word: Whether a person's word is given in advance for what reading cannot settle.
        by: How that was given, for the record; ``None`` where it is on record already.
        tests: Whether a new value is kept only after its turn test, where one can be made: a
            person is at the robot who chose it.
    """

    def __init__(
        self,
        controller: Controller,
        *,
        keep: bool,
        word: bool,
        by: AnsweredBy | None = None,
        tests: bool = False,
    ) -> None:
        self._controller = controller
        self._tests = tests
        self._keep = keep
        self._word, self._by = word, by
        self._where: Pose | None = None
        self.declined = False

    def run(self) -> "Recovery | CellRecovery":
        """Recover what can be recovered; a turn test comes last, when nothing else is open.

        Raises:
            RobolinkError: A step failed; the rest stays open.
        """
        if self._keep:
            self._tell_untested()
        if not self._tests:
            return self._settled()
        with self._controller.outcomes.hold(tr("recover")), self._controller.signs_of_life():
            tests = TurnTests(self._controller)
            done = self._settled(later=tests.operations)
            if not done.left:
                return Recovery((*done.settled, *tests.made()), ())
            findings = look(self._controller, keep=True)
            return Recovery(done.settled, findings)

    def _tell_untested(self) -> None:
        """Show, for each new value that cannot get its turn test now, why, and what tests it."""
        from robolink.calibration_run import untested_sentences

        for sentence in untested_sentences(self._controller):
            note(sentence)

    def _settled(self, *, later: Collection[str] = ()) -> "CellRecovery":
        from robolink.inspection import recover_cell

        done = recover_cell(
            self._controller,
            keep=self._keep,
            judge=self._confirmed,
            answered_by=None,  # each question that is asked keeps its answer
            tell=self._ended,
            later=later,
        )
        if not done.settled and not done.left and not later:
            note(spoken(_NOTHING))
        return done

    def look(self) -> Recovery:
        """Show what is open; reads only."""
        findings = look(self._controller, keep=self._keep, tell=_foretell)
        note(tr("Nothing was done.") if findings else spoken(_NOTHING))
        return Recovery((), findings)

    def left_blocked(self, *, declined: bool) -> Recovery:
        """Do nothing about what is open.

        Args:
            declined: Whether a person at the terminal said so.
        """
        findings = look(self._controller, keep=self._keep)
        self.declined = declined
        return Recovery((), findings)

    def forget(self, *, yes: bool, dry_run: bool) -> int:
        """Remove all open markers at a person's confirmation; return how many.

        Raises:
            BusyError: Somebody else is changing this controller just now.
            DeclinedError: The answer was no.
        """
        markers = self._controller.outcomes.open_markers()
        self._controller.outcomes.look()
        agree(
            tr(
                "Unblock the robot WITHOUT a check? Unfinished jobs that are dropped: {count}.",
                count=len(markers),
            ),
            yes=yes,
        )
        if not dry_run:
            settler = Settler(self._controller)
            with self._controller.outcomes.hold(tr("recover")):
                for marker in markers:
                    settler.forget(marker)
        return len(markers)

    def payload(self, done: "Recovery | CellRecovery") -> dict[str, object]:
        """Return the document; a controller without an answer has no selected tool."""
        return {
            "settled": [finding_payload(finding) for finding in done.settled],
            "left": [finding_payload(finding) for finding in done.left],
            "selected_tool": self._selected() if isinstance(done, Recovery) else done.selected_tool,
            "pose": None if self._where is None else pose_payload(self._where),
        }

    def _selected(self) -> int | None:
        with suppress(ControllerError):
            return self._controller.tools.selected()
        return None

    def exit_code(self, done: "Recovery | CellRecovery") -> int:
        """Return the exit code: 0, or why something is still open."""
        if not done.left:
            return 0
        return DECLINED if self.declined else LEFT

    def _confirmed(self, finding: Finding) -> bool:
        _show(finding)
        if finding.marker.kind is MarkerKind.MOVE:
            self._show_where()
        question = tr("Is that right, and can work continue?")
        if self._word:
            if self._by is not None:
                keep_answer(question, True, self._by)
            return True
        if json_is_on() or not person_here():
            return False
        agreed = asked(question)
        self.declined = self.declined or not agreed
        return agreed

    def _show_where(self) -> None:
        """Show once where the robot is, with the tool that is selected by now."""
        if self._where is None:
            with suppress(ControllerError):
                here = self._where = self._controller.groups[0].pose()
                note(
                    tr(
                        "  It is at X {x:.3f} Y {y:.3f} Z {z:.3f} U {u:.3f} (tool {tool}).",
                        x=here.x_mm,
                        y=here.y_mm,
                        z=here.z_mm,
                        u=here.u_deg,
                        tool=here.tool,
                    )
                )

    def _ended(self, finding: Finding, settled: bool) -> None:
        if not finding.verdict.needs_a_person:
            _show(finding)
        if not settled:
            note(tr("  left open"))
        elif finding.action:
            note(tr("  done: {action}", action=finding.action))
        else:
            note(tr("  finished"))


def show_end(payload: dict[str, object]) -> None:
    """Show how it ended."""
    left, tool = payload["left"], payload["selected_tool"]
    if left:
        say(
            tr(
                "Only you can decide the rest. Look at the robot and the controller, then "
                "run 'robolink recover' again on a terminal, or with --yes."
            )
        )
    elif payload["settled"]:
        say(
            tr("All jobs are finished or undone.")
            if tool is None
            else tr("All jobs are finished or undone; tool {tool} is selected.", tool=tool)
        )


def _foretell(finding: Finding) -> None:
    _show(finding)
    if finding.action:
        note(tr("  to do: {action}", action=finding.action))
    elif finding.verdict.needs_a_person:
        note(tr("  to do: you decide"))


def _show(finding: Finding) -> None:
    when, begun = local_label(finding.marker.begun_at), begun_in_words(finding.marker)
    note(f"{when}  {begun}\n  {finding.sentence}")


class TurnTests:
    """The turn tests that the open changes of a controller still lack.

    Args:
        controller: The controller, connected.
    """

    def __init__(self, controller: Controller) -> None:
        from robolink.calibration_run import open_turn_tests

        self._controller = controller
        self._tests = open_turn_tests(controller)

    @property
    def operations(self) -> tuple[str, ...]:
        """Of the markers of those changes."""
        return tuple(self._tests)

    def made(self) -> Iterator[Finding]:
        """Make them one by one when a person agrees; yields what each one closes.

        Raises:
            DeclinedError: The answer was no; the change stays open.
            VerifyError: One did not pass; the old values are back.
            RobolinkError: Anything else that ended it.
        """
        from robolink.calibration_run import finish_by_turn_test

        for operation, tests in self._tests.items():
            self._agreed(tests)
            tool, clock = tests[0].test.tool, self._controller.clock
            with operator_at(None, lambda: tool, clock) as person:  # noqa: B023 - used inside the turn
                yield finish_by_turn_test(
                    self._controller, operation, person, attended=True, tell=_tell
                )

    def _agreed(self, tests: "tuple[OpenTurnTest, ...]") -> None:
        settings = tests[0].settings
        box, here = settings.box, self._controller.groups[0].pose()
        tools = ", ".join(str(one.test.tool) for one in tests)
        agree_to_procedure(
            self._controller,
            tr("to test tool {tool}, from where you jog the tip into contact", tool=tools)
            if tests[0].test.by_touch
            else tr("to test tool {tool}, first straight up from where it is", tool=tools),
            moves=sum(one.test.moves(here) for one in tests),
            speed_mm_s=settings.speed_mm_s,
            box_mm=box.x_max_mm - box.x_min_mm,
            yes=False,
            at=StationKind.PIN if tests[0].test.by_touch else None,
        )


def _tell(tool: int, result: "VerifyResult") -> None:
    from robolink.calibration import turn_test_headline, turn_test_sentences  # numpy, late

    note(tr("Tool {tool}: {said}", tool=tool, said=turn_test_headline(result)))
    for sentence in turn_test_sentences(result.judgement):
        note(sentence)
