"""One run of a recipe from the command line."""

from collections.abc import Callable, Mapping

from robolink.backup import keep_first_backup
from robolink.errors import DeclinedError
from robolink.messages import tr
from robolink.model import AnsweredBy, Controller
from robolink.nozzle_change import ChangeReport, preview
from robolink.recipe import Answers, LoadedRecipe, RecipeRun, require_answers
from robolink.transaction import Order
from robolink_cli.access.capabilities import io_of
from robolink_cli.commands.measure.recipe_events import EventStream, Progress
from robolink_cli.console.render import note, say
from robolink_cli.prompts.operator import operator_at
from robolink_cli.prompts.present import present_desk
from robolink_cli.prompts.questions import asked, keep_answer, on_terminal
from robolink_cli.session.check_before_start import check_before_start, name_the_needle
from robolink_cli.session.context import CliContext
from robolink_cli.session.motion_consent import agree_to_motion, motion_question
from robolink_cli.session.opening import open_controller
from robolink_cli.session.ordering import ordered, show_done, with_order
from robolink_cli.views.fit import report_payload, show_report
from robolink_cli.views.planned_steps import steps_payload

_Show = Callable[[dict[str, object]], None]
"""Shows a document to a person."""


class Recalibration:
    """Runs one recipe on the controller of a command.

    Args:
        context: What the command was told.
        loaded: The recipe.
        answers: What was answered beforehand.
        events: Where events go.
        assist_url: A simulator's stand-in for the person.
        take_reference: Whether only a reference is taken.
        accepted_change_mm: A larger jump that an engineer accepts this time.
        sensor: The camera, in place of the recipe's.
        order: Id of the line computer's order; ``None`` without one.
    """

    def __init__(
        self,
        context: CliContext,
        loaded: LoadedRecipe,
        answers: Answers,
        *,
        events: EventStream,
        assist_url: str | None,
        take_reference: bool,
        accepted_change_mm: float | None,
        sensor: str | None,
        order: str | None = None,
    ) -> None:
        self._context = context
        self._loaded = loaded
        self._answers = answers
        self._events = events
        self._assist_url = assist_url
        self._take_reference = take_reference
        self._accepted_change_mm = accepted_change_mm
        self._sensor = sensor
        self._order = order

    def run(self, *, dry_run: bool) -> None:
        """Carry the recipe out, or only show it.

        Raises:
            RobolinkError: It ended early; the old values are in force, or it says which are not.
        """
        if not dry_run and self._assist_url is None and not on_terminal():
            require_answers(self._answers, self._loaded.recipe)
        progress = Progress(self._events, len(self._loaded.recipe.tools))
        answers, loaded = self._answers, self._loaded
        with (
            open_controller(
                self._context,
                changes=not dry_run,
                usual_change_mm=loaded.recipe.tolerances.jump_mm,
            ) as controller,
            ordered(
                controller,
                self._order,
                "change",
                recipe=loaded.sha256,
                nozzle=answers.nozzle,
                lot=answers.lot,
            ) as order,
        ):
            if order is not None and order.done is not None:
                done: tuple[Mapping[str, object], _Show] = (order.done.result, _nothing)
                show_done(order)
            else:
                done = self._run(controller, order, progress, dry_run=dry_run)
        payload, show = with_order(done[0], order), done[1]
        self._events.emit("result", **payload)
        if not self._events.on:
            self._context.emit("recalibration", payload, lambda: show(payload))

    def _run(
        self, controller: Controller, order: Order | None, progress: Progress, *, dry_run: bool
    ) -> tuple[Mapping[str, object], _Show]:
        """Return the document of the run, and how a person is shown it."""
        with operator_at(self._assist_url, lambda: progress.tool, controller.clock) as operator:
            run = RecipeRun(
                controller,
                self._loaded,
                operator=operator,
                answers=self._answers,
                audience=progress,
                take_reference=self._take_reference,
                accepted_change_mm=self._accepted_change_mm,
                ask_before_write=not self._answers.yes,
                sensor=self._sensor,
                cell=self._context.cell,
                order=order,
                describe=lambda report: self._document(controller, report),
            )
            run.preflight()
            self._start(controller, run)
            if dry_run:
                return self._dry_run(controller, run), _shown_plan
            self._consent(controller, run)
            return self._carry_out(controller, run), _nothing

    def _start(self, controller: Controller, run: RecipeRun) -> None:
        for change in run.changed:
            note(change.sentence)
        self._events.emit(
            "start",
            recipe=self._loaded.name,
            recipe_hash=self._loaded.sha256,
            controller=controller.identity,
            tools=[plan.tool for plan in run.plan.tools],
            takes_reference=run.takes_reference,
            changed_by_others=[change.sentence for change in run.changed],
        )

    def _consent(self, controller: Controller, run: RecipeRun) -> None:
        """Have the person agree to what is about to happen; back up before it does.

        Raises:
            NotReadyError: Nothing can move now; nobody was asked anything.
            DeclinedError: The answer was no, or nobody could be asked.
        """
        moves = run.plan.moves
        question = None if not moves or self._at_desk else self._question(controller, run)
        if run.takes_reference:
            if self._take_reference:
                keep_answer(_which_is_mounted(), True, AnsweredBy.OPTION)
            else:
                self._explain_reference()
        keep_first_backup(controller, tell=note)
        if not moves:
            self._require_writer(run)
            return
        if question is not None:
            agree_to_motion(question, yes=self._answers.yes)
            return
        name_the_needle(controller, run.ask_ids)
        steps = preview(controller, run.plan)
        check_before_start(
            controller,
            self._purpose(run),
            moves=sum(step.target is not None for step in steps),
            speed_mm_s=run.plan.limits.speed_mm_s,
            box_mm=run.plan.limits.box.x_max_mm,
            at=self._loaded.recipe.source.of_method.needs.station,
            tools=[plan.tool for plan in run.plan.tools],
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
        return present_desk() is not None and not self._answers.yes

    def _purpose(self, run: RecipeRun) -> str:
        return tr(
            "as {recipe!r} says for tool {tools}",
            recipe=self._loaded.name,
            tools=", ".join(str(plan.tool) for plan in run.plan.tools),
        )

    def _explain_reference(self) -> None:
        note(
            tr(
                "There is no reference yet. Taught points fit only the tool value that they "
                "were taught with. So this first run measures and writes nothing: it records "
                "where that tip is. Later changes are measured against it."
            )
        )
        if not on_terminal():
            raise DeclinedError(
                tr("A reference is needed first, but there is nobody to ask."),
                remedy=tr(
                    "Mount the nozzle that the points were taught with, then give --reference."
                ),
            )
        if not asked(_which_is_mounted()):
            raise DeclinedError(
                tr("The reference was not taken."),
                remedy=tr("Mount that nozzle, or restore the tool value that fits this one."),
            )

    def _require_writer(self, run: RecipeRun) -> None:
        """Refuse to write values that nobody watched being measured without a yes."""
        nobody = not self._answers.yes and self._assist_url is None and not on_terminal()
        if nobody and not run.takes_reference:
            raise DeclinedError(
                tr("Tools would be written, but there is nobody to ask."),
                remedy=tr("Nothing was written. Add --yes, or run it on a terminal."),
            )

    def _dry_run(self, controller: Controller, run: RecipeRun) -> dict[str, object]:
        recipe = self._loaded.recipe
        return {
            "dry_run": True,
            "recipe": self._loaded.name,
            "tools": [plan.tool for plan in run.plan.tools],
            "takes_reference": run.takes_reference,
            "old_names": list(self._loaded.notes),
            "steps": steps_payload(controller, preview(controller, run.plan)),
            "prompts": [{"at": prompt.at, "text": prompt.text} for prompt in recipe.prompts],
            "outputs": [
                {
                    "at": output.at,
                    "output": output.output,
                    "on": output.on,
                    "requests": list(io_of(controller).preview_output(output.output, output.on)),
                }
                for output in recipe.outputs
            ],
        }

    def _carry_out(self, controller: Controller, run: RecipeRun) -> dict[str, object]:
        report = run.run()
        # Now, because Ctrl-C may come before the logout is answered.
        desk = present_desk()
        if desk is not None:
            desk.regard(report)
        for one in report.tools if desk is None else ():
            show_report(one)
        if run.takes_reference:
            say(tr("The reference was recorded; nothing was written."))
        say(
            tr(
                "On record as change {change}: robolink journal report {change}",
                change=report.change[:8],
            )
        )
        return self._document(controller, report, reference_taken=run.takes_reference)

    def _document(
        self, controller: Controller, report: ChangeReport, *, reference_taken: bool = False
    ) -> dict[str, object]:
        return {
            "recipe": self._loaded.name,
            "recipe_hash": self._loaded.sha256,
            "controller": controller.identity,
            **_payload(report),
            "old_names": list(self._loaded.notes),
            "reference_taken": reference_taken,
        }


def _payload(report: ChangeReport) -> dict[str, object]:
    return {
        "change": report.change,
        "simulated": report.simulated,
        "tools": [report_payload(one) for one in report.tools],
    }


def _which_is_mounted() -> str:
    return tr("Is the nozzle mounted that the points were taught with?")


def _nothing(_payload: dict[str, object]) -> None:
    """Everything was said as it happened."""


def _shown_plan(payload: dict[str, object]) -> None:
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
