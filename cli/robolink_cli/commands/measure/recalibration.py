"""One run of a recipe from the command line: events for a script, headings for a person."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import click

from robolink.backup import keep_first_backup
from robolink.calibration import VerifyResult
from robolink.calibration_run import ChangeReport, Listener, Moment, Proposal, RecipeRun, preview
from robolink.errors import CalibrationError, DeclinedError
from robolink.messages import joined, tr
from robolink.model import AnsweredBy, Controller, ToolReceipt, json_fields
from robolink.procedures import MeasurementContext
from robolink.recipe import Answers, LoadedRecipe, require_answers
from robolink.runner import Ask, Confirm, Notify, StepDone, TakenStep
from robolink.timing import NS_PER_S
from robolink.transaction import Order
from robolink_cli.access.capabilities import io_of
from robolink_cli.console.exit_codes import error_body, exit_code
from robolink_cli.console.output import drawn_elsewhere, hand_over
from robolink_cli.console.person import person_here
from robolink_cli.console.render import emit, note, say, switch_json_on
from robolink_cli.prompts.current_desk import current_desk
from robolink_cli.prompts.operator import operator_at
from robolink_cli.prompts.questions import asked, keep_answer
from robolink_cli.session.check_before_start import check_before_start, name_the_needle
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import CliContext
from robolink_cli.session.motion_consent import agree_to_motion, motion_question
from robolink_cli.session.order import ordered, show_done, with_order
from robolink_cli.views.documents import (
    pose_payload,
    proposal_payload,
    receipt_payload,
    verification_payload,
)
from robolink_cli.views.fit import report_payload, show_report, steps_payload


class EventStream:
    """Writes one JSON line for each event, if requested.

    Args:
        context: Click's, so that text for people goes to stderr.
        on: Whether it is wanted.
    """

    def __init__(self, context: click.Context, *, on: bool) -> None:
        self.on = on
        if on:
            switch_json_on(context)

    def emit(self, event: str, **payload: object) -> None:
        """Write one event."""
        if self.on:
            line = {"schema": "robolink/recalibration-event/1", "event": event, **payload}
            hand_over(json.dumps(line, allow_nan=False))

    @contextmanager
    def closing(self) -> Iterator[None]:
        """End the stream with ``error`` when the block does; ``result`` is the block's own."""
        try:
            yield
        except (Exception, KeyboardInterrupt) as error:
            self.emit("error", error=error_body(error), exit_code=exit_code(error))
            raise


class Progress(Listener):
    """Reports the events to a person and a script.

    Attributes:
        tool: Number of the tool at work.

    Args:
        events: The stream of a script.
        tools: How many tools the recipe has.
    """

    def __init__(self, events: EventStream, tools: int) -> None:
        self._events, self._tools = events, tools
        self.tool = 0

    def moment(self, moment: Moment, bench: MeasurementContext, tool: int | None = None) -> None:  # noqa: ARG002 - a phase is a phase
        """Show which phase begins."""
        if tool is not None:
            self.tool = tool
        if not drawn_elsewhere():
            heading = _heading(moment, self.tool)
        elif self._tools > 1 and moment is Moment.BEFORE_MEASURE:
            heading = tr("Measuring tool {tool}.", tool=self.tool)
        else:
            heading = ""  # the screen has a heading
        if heading:
            note(heading)
        self._events.emit("phase", phase=moment, tool=tool)

    def step(self, tool: int, done: StepDone) -> None:
        """Report one step."""
        self.tool = tool
        kind, text = _in_words(done.step)
        pose = pose_payload(done.pose) if done.pose else None
        self._events.emit("step", tool=tool, kind=kind, text=text, pose=pose)

    def refused(self, tool: int, error: CalibrationError, *, again: bool) -> None:
        """Report a measurement that is not believed."""
        if again:
            note(tr("Tool {tool}: {error} Measuring it again.", tool=tool, error=error))
        self._events.emit(
            "refused", tool=tool, code=error.code, what=error.what, remedy=error.remedy, again=again
        )

    def proposed(self, proposals: Sequence[Proposal]) -> None:
        """Show the measured value next to the stored one."""
        from robolink_cli.views.fit import show_proposal

        for proposal in proposals:
            show_proposal(proposal)
            self._events.emit("proposal", **proposal_payload(proposal))

    def wrote(self, receipt: ToolReceipt) -> None:
        """Report a write."""
        from robolink_cli.views.fit import tell_written

        tell_written(receipt)
        self.tool = receipt.tool
        self._events.emit("write", **receipt_payload(receipt))

    def verified(self, tool: int, result: VerifyResult) -> None:
        """Report a turn test."""
        self._events.emit("verification", tool=tool, **(verification_payload(result) or {}))

    def told(self, sentence: str) -> None:
        """Pass on a message to the person."""
        self._events.emit("note", text=sentence)


def _in_words(step: TakenStep) -> tuple[str, str]:
    """Return what kind of step it is, and what it says."""
    match step:
        case Ask():
            return "touch", step.instruction
        case Notify():
            return "remark", step.text
        case Confirm():
            return "offer", step.question
        case _:
            return "move", step.purpose


def _heading(moment: Moment, tool: int) -> str:
    """Return the heading of what comes next, empty for none."""
    if moment is Moment.BEFORE_MEASURE:
        return tr("-- tool {tool}: measure", tool=tool)
    if moment is Moment.BEFORE_WRITE:
        return tr("-- propose and write")
    return tr("-- done") if moment is Moment.END else ""


@dataclass(frozen=True, slots=True)
class RunOptions:
    """The typed options of one run of a recipe.

    Attributes:
        answers: What was answered in advance.
        assist_url: A simulator's stand-in for the person.
        take_reference: Whether only a reference is taken.
        accepted_change_mm: A larger jump that an engineer accepts this time.
        sensor: The camera, in place of the recipe's.
        order: Id of the line computer's order; ``None`` without one.
        dry_run: Whether the run is only shown.
    """

    answers: Answers
    assist_url: str | None = None
    take_reference: bool = False
    accepted_change_mm: float | None = None
    sensor: str | None = None
    order: str | None = None
    dry_run: bool = False

    @property
    def alone(self) -> bool:
        """Whether nobody, not even a simulator, could answer a question."""
        return self.assist_url is None and not person_here()


@dataclass(frozen=True, slots=True)
class Recalibration:
    """Runs one recipe on the controller of a command.

    Attributes:
        context: What the command was told.
        loaded: The recipe.
        options: What was typed for this run.
        events: Where events go.
    """

    context: CliContext
    loaded: LoadedRecipe
    options: RunOptions
    events: EventStream

    def run(self) -> None:
        """Carry the recipe out, or only show it.

        Raises:
            RobolinkError: It ended early; the old values are in force, or it says which are not.
        """
        dry_run = self.options.dry_run
        if not dry_run and self.options.alone:
            require_answers(self.options.answers, self.loaded.recipe)
        with self._opened() as (controller, order):
            if order is not None and order.done is not None:
                document = dict(order.done.result)
                show_done(order)
            else:
                with self._prepared(controller, order) as run:
                    if dry_run:
                        document = self._plan(controller, run)
                    else:
                        self._consent(controller, run)
                        document = self._carried_out(controller, run, order)
        payload = with_order(document, order)
        self.events.emit("result", **payload)
        if not self.events.on:
            emit("recalibration", payload, lambda: _show_plan(payload) if dry_run else None)

    @contextmanager
    def _opened(self) -> Iterator[tuple[Controller, Order | None]]:
        """Give the controller, and the order that the run carries out."""
        answers, loaded = self.options.answers, self.loaded
        with (
            open_controller(
                self.context,
                changes=not self.options.dry_run,
                usual_change_mm=loaded.recipe.tolerances.jump_mm,
            ) as controller,
            ordered(
                controller,
                self.options.order,
                "change",
                recipe=loaded.sha256,
                nozzle=answers.nozzle,
                lot=answers.lot,
            ) as order,
        ):
            yield controller, order

    @contextmanager
    def _prepared(self, controller: Controller, order: Order | None) -> Iterator[RecipeRun]:
        """Give the run, with whoever answers it, once nothing forbids it."""
        options = self.options
        progress = Progress(self.events, len(self.loaded.recipe.tools))
        with operator_at(options.assist_url, lambda: progress.tool, controller.clock) as operator:
            run = RecipeRun(
                controller,
                self.loaded,
                operator=operator,
                answers=options.answers,
                audience=progress,
                take_reference=options.take_reference,
                accepted_change_mm=options.accepted_change_mm,
                ask_before_write=not options.answers.yes,
                sensor=options.sensor,
                cell=self.context.cell,
                order=order,
                describe=lambda report: self._document(controller, report),
            )
            run.preflight()
            self._start(controller, run)
            yield run

    def _start(self, controller: Controller, run: RecipeRun) -> None:
        for change in run.changed:
            note(change.sentence)
        self.events.emit(
            "start",
            recipe=self.loaded.name,
            recipe_hash=self.loaded.sha256,
            controller=controller.identity,
            tools=[plan.tool for plan in run.plan.tools],
            takes_reference=run.takes_reference,
            changed_by_others=[change.sentence for change in run.changed],
            robot_time=_robot_time(run),
        )
        if run.forecast is not None and not self._at_desk:
            note(run.forecast.sentence)

    def _consent(self, controller: Controller, run: RecipeRun) -> None:
        """Let the person agree to what is about to happen; back up before it does.

        Raises:
            NotReadyError: Nothing can move now; nobody was asked anything.
            DeclinedError: The answer was no, or nobody could be asked.
        """
        moves = run.plan.moves
        question = None if not moves or self._at_desk else self._question(controller, run)
        if run.takes_reference:
            if self.options.take_reference:
                keep_answer(_which_is_mounted(), True, AnsweredBy.OPTION)
            else:
                self._explain_reference()
        keep_first_backup(controller, tell=note)
        if not moves:
            self._require_writer(run)
            return
        if question is not None:
            agree_to_motion(question, yes=self.options.answers.yes)
            return
        name_the_needle(controller, run.ask_ids)
        steps = preview(controller, run.plan)
        check_before_start(
            controller,
            self._purpose(run),
            moves=sum(step.target is not None for step in steps),
            speed_mm_s=run.plan.limits.speed_mm_s,
            box_mm=run.plan.limits.box.x_max_mm,
            at=self.loaded.recipe.source.of_method.needs.station,
            tools=[plan.tool for plan in run.plan.tools],
            takes="" if run.forecast is None else run.forecast.sentence,
        )

    def _question(self, controller: Controller, run: RecipeRun) -> str:
        limits = run.plan.limits
        return motion_question(
            controller,
            self._purpose(run),
            speed_mm_s=limits.speed_mm_s,
            box_mm=limits.box.x_max_mm,
        )

    @property
    def _at_desk(self) -> bool:
        return current_desk() is not None and not self.options.answers.yes

    def _purpose(self, run: RecipeRun) -> str:
        return tr(
            "as {recipe!r} says for tool {tools}",
            recipe=self.loaded.name,
            tools=", ".join(str(plan.tool) for plan in run.plan.tools),
        )

    def _explain_reference(self) -> None:
        note(
            tr(
                "There is no reference yet. Taught points fit only the tool value that "
                "they were taught with. So this first run only records where that tip is, "
                "and writes nothing. Later changes are measured against it."
            )
        )
        if not person_here():
            raise DeclinedError(
                tr("This needs a reference first, but there is nobody to ask."),
                remedy=tr(
                    "Mount the nozzle with which the points were taught, then add --reference."
                ),
            )
        if not asked(_which_is_mounted()):
            raise DeclinedError(
                tr("No reference was recorded."),
                remedy=tr("Mount that nozzle, or restore the tool value that fits this one."),
            )

    def _require_writer(self, run: RecipeRun) -> None:
        """Refuse to write values without a yes if nobody watched the measurement."""
        nobody = not self.options.answers.yes and self.options.alone
        if nobody and not run.takes_reference:
            raise DeclinedError(
                tr("This writes tools, but there is nobody to ask."),
                remedy=tr("Nothing was written. Add --yes, or run it on a terminal."),
            )

    def _plan(self, controller: Controller, run: RecipeRun) -> dict[str, object]:
        recipe = self.loaded.recipe
        return {
            "dry_run": True,
            "recipe": self.loaded.name,
            "tools": [plan.tool for plan in run.plan.tools],
            "takes_reference": run.takes_reference,
            "robot_time": _robot_time(run),
            "old_names": list(self.loaded.notes),
            "steps": steps_payload(controller, preview(controller, run.plan)),
            "prompts": [{"at": prompt.at, "text": prompt.text} for prompt in recipe.prompts],
            "outputs": [
                {
                    **json_fields(output, "at", "output", "on"),
                    "requests": list(io_of(controller).preview_output(output.output, output.on)),
                }
                for output in recipe.outputs
            ],
        }

    def _carried_out(
        self, controller: Controller, run: RecipeRun, order: Order | None
    ) -> dict[str, object]:
        """Run the recipe; return its document, with how long it took by the controller's clock.

        The result of an order is what its record holds, the same however often it is delivered: the
        record is made before the robot has come to its end.
        """
        clock, answered = controller.clock, controller.exchanges
        carried = controller.traffic_bytes
        began_ns = clock.now_ns()
        report = run.run()
        took_s = round((clock.now_ns() - began_ns) / NS_PER_S, 1)
        exchanges = controller.exchanges - answered
        traffic = controller.traffic_bytes
        document = self._told(controller, run, report)
        robot_s = None if run.robot_s is None else round(run.robot_s, 1)
        say(_took(took_s, robot_s, exchanges))
        if order is not None:
            return document
        return {
            **document,
            "took_s": took_s,
            "robot_s": robot_s,
            "exchanges": exchanges,
            "traffic_bytes": None if traffic is None else traffic - (carried or 0),
            "robot_time": _robot_time(run),
        }

    def _told(
        self, controller: Controller, run: RecipeRun, report: ChangeReport
    ) -> dict[str, object]:
        """Show a person what was done; return its document."""
        # Now, because Ctrl-C may come before the logout is confirmed.
        desk = current_desk()
        if desk is not None:
            desk.regard(report)
        for one in report.tools if desk is None else ():
            show_report(one)
        if run.takes_reference:
            say(tr("The reference was recorded; nothing was written."))
        say(
            tr(
                "Recorded as change {change}: robolink journal report {change}",
                change=report.change[:8],
            )
        )
        return self._document(controller, report, reference_taken=run.takes_reference)

    def _document(
        self, controller: Controller, report: ChangeReport, *, reference_taken: bool = False
    ) -> dict[str, object]:
        return {
            "recipe": self.loaded.name,
            "recipe_hash": self.loaded.sha256,
            "controller": controller.identity,
            "change": report.change,
            "simulated": report.simulated,
            "tools": [report_payload(one) for one in report.tools],
            "old_names": list(self.loaded.notes),
            "reference_taken": reference_taken,
        }


def _took(seconds: float, robot_s: float | None, exchanges: int) -> str:
    """Return how long a run took, and how long of it the robot needed if a person did the rest."""
    took = tr(
        "It took {seconds:.1f} s and {exchanges} requests.", seconds=seconds, exchanges=exchanges
    )
    if robot_s is None or robot_s >= seconds:
        return took
    return joined(" ", (took, tr("The robot needed {seconds:.1f} s of it.", seconds=robot_s)))


def _robot_time(run: RecipeRun) -> dict[str, object] | None:
    return None if run.forecast is None else run.forecast.as_json()


def _which_is_mounted() -> str:
    return tr("Is the nozzle mounted with which the points were taught?")


def _show_plan(payload: dict[str, object]) -> None:
    from robolink_cli.views.fit import show_steps

    say(tr("Dry run; nothing is sent. The recipe {recipe!r}:", recipe=payload["recipe"]))
    prompts, outputs = payload["prompts"], payload["outputs"]
    assert isinstance(prompts, list) and isinstance(outputs, list)  # noqa: S101, PT018 - made above
    for prompt in prompts:
        say(tr("  {at}: ask {text!r}", at=prompt["at"], text=prompt["text"]))
    for output in outputs:
        state = tr("on") if output["on"] else tr("off")
        number, at = output["output"], output["at"]
        say(tr("  {at}: switch output {number} {state}", at=at, number=number, state=state))
    show_steps(payload["steps"])
