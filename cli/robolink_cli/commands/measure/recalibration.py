"""One run of a recipe from the command line: events for a script, headings for a person."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Protocol

from robolink.backup import keep_first_backup
from robolink.calibration_run import ChangeReport, RecipeRun, preview
from robolink.errors import DeclinedError
from robolink.messages import joined, tr
from robolink.model import AnsweredBy, Controller, json_fields
from robolink.recipe import Answers, LoadedRecipe, require_answers
from robolink.timing import NS_PER_S
from robolink.transaction import Order
from robolink_cli.access.capabilities import io_of
from robolink_cli.commands.measure.run_events import EventStream, Progress
from robolink_cli.console.person import person_here
from robolink_cli.console.render import emit, note, say
from robolink_cli.prompts.current_desk import current_desk
from robolink_cli.prompts.operator import operator_at
from robolink_cli.prompts.questions import asked, keep_answer
from robolink_cli.session.check_before_start import check_before_start, name_the_needle
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import CliContext
from robolink_cli.session.motion_consent import agree_to_motion, motion_question
from robolink_cli.session.order import ordered, show_done, with_order
from robolink_cli.views.fit import report_payload, show_report, steps_payload


class OrderGate(Protocol):
    """Whose turn an ordered run is, asked once a person has agreed to it."""

    def carrying_out(self, controller: Controller) -> AbstractContextManager[Order]:
        """Keep the lease, and look the order up."""

    def begin(self) -> None:
        """Begin; nothing was moved or written before.

        Raises:
            RobolinkError: It is not its turn any more.
        """


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
        gate: Asked whether the run may begin, where its order comes from a plan.
    """

    answers: Answers
    assist_url: str | None = None
    take_reference: bool = False
    accepted_change_mm: float | None = None
    sensor: str | None = None
    order: str | None = None
    dry_run: bool = False
    gate: OrderGate | None = None

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
        """Carry the recipe out, or only show it, and give the result.

        Raises:
            RobolinkError: It ended early; the old values are in force, or it says which are not.
        """
        payload = self.carry_out()
        self.events.emit("result", **payload)
        dry_run = self.options.dry_run
        if not self.events.on:
            emit("recalibration", payload, lambda: _show_plan(payload) if dry_run else None)

    def carry_out(self) -> dict[str, object]:
        """Carry the recipe out, or only show it; return the document of the result.

        Raises:
            RobolinkError: As :meth:`run`.
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
                        if self.options.gate is not None:
                            self.options.gate.begin()
                        document = self._carried_out(controller, run, order)
        return with_order(document, order)

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
            self.options.gate.carrying_out(controller)
            if self.options.gate is not None
            else ordered(
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
