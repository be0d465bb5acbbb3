"""What a recipe adds between the phases of a nozzle change: questions, outputs, proposals."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from robolink.calibration import VerifyResult
from robolink.calibration_run._length import known_height
from robolink.calibration_run._proposal import Listener, Moment, Proposal
from robolink.calibration_run._recipe_plan import Reference, proposed
from robolink.errors import CalibrationError, ConfigError, DeclinedError
from robolink.messages import tr
from robolink.model import AnsweredBy, Controller, Signature, ToolReceipt, answer_entry
from robolink.procedures import MeasurementContext
from robolink.runner import MOST_REFUSED, StepDone, parse_decimal
from robolink.stations import Station

if TYPE_CHECKING:
    from robolink.recipe import Answers, Output, Prompt, Recipe


class RecipeListener(Listener):
    """Carries out the prompts, outputs, basis and Z of one recipe.

    Attributes:
        switched: The outputs that were switched, with their last state.

    Args:
        recipe: The recipe.
        controller: The controller, connected.
        answers: What was answered in advance.
        references: The references of basis "difference", by tool.
        taking_reference: Whether this run only takes them.
        measure_only: Whether nothing follows from what is measured, so that no length is asked for.
        stated_pin: The pin as the cell file has it, ``None`` where it says nothing.
        audience: Told of everything as well.
    """

    def __init__(
        self,
        recipe: "Recipe",
        controller: Controller,
        answers: "Answers",
        *,
        references: Mapping[int, Reference],
        taking_reference: bool = False,
        measure_only: bool = False,
        stated_pin: Station | None = None,
        audience: Listener,
    ) -> None:
        self._audience = audience
        self._recipe = recipe
        self._controller = controller
        self._answers = answers
        self._references = references
        self._taking_reference = taking_reference
        self._measure_only = measure_only
        self._stated_pin = stated_pin
        self._signature: Signature = controller.outcomes.signature
        self._nozzles: dict[int, str] = {}
        self._names = {tool.number: tool.name or "" for tool in recipe.tools}
        self.switched: dict[int, bool] = {}

    def moment(self, moment: Moment, context: MeasurementContext, tool: int | None = None) -> None:
        """Ask the questions of this moment, then switch its outputs."""
        self._audience.moment(moment, context, tool)
        if moment is Moment.AFTER_MEASURE:
            # The nozzle id belonged to that tool; it is recorded again with the value that is kept.
            self._sign(self._signature)
        for number, prompt in enumerate(self._recipe.prompts, start=1):
            if _meant(prompt, moment, tool):
                self._ask(context, number, prompt, tool)
        for output in self._recipe.outputs:
            if _meant(output, moment, tool):
                self._switch(output)

    def adjusted(self, proposal: Proposal, context: MeasurementContext) -> Proposal:
        """Return the recipe's proposal from a measurement."""
        tool = proposal.tool
        typed = None
        if not (self._taking_reference or self._measure_only):
            typed = self._height(context, tool)
        made = proposed(
            self._recipe,
            proposal,
            reference=self._references.get(tool),
            typed_z_mm=typed,
            taking_reference=self._taking_reference,
        )
        nozzle = self._nozzles.get(tool)
        return replace(made, kept_record={**made.kept_record, "nozzle": nozzle}) if nozzle else made

    def step(self, tool: int, done: StepDone) -> None:
        """Pass it on."""
        self._audience.step(tool, done)

    def refused(self, tool: int, error: CalibrationError, *, again: bool) -> None:
        """Pass it on."""
        self._audience.refused(tool, error, again=again)

    def proposed(self, proposals: Sequence[Proposal]) -> None:
        """Pass it on."""
        self._audience.proposed(proposals)

    def wrote(self, receipt: ToolReceipt) -> None:
        """Pass it on."""
        self._audience.wrote(receipt)

    def verified(self, tool: int, result: VerifyResult) -> None:
        """Pass it on."""
        self._audience.verified(tool, result)

    def told(self, sentence: str) -> None:
        """Pass it on."""
        self._audience.told(sentence)

    def _height(self, context: MeasurementContext, tool: int) -> float | None:
        name = self._names[tool]
        if self._recipe.z == "typed":
            given = self._answers.z_mm.get(tool)
            if given is None:
                return ask_height(context, tool, name)
            self._record(height_question(tool, name), f"{given:g}", AnsweredBy.OPTION, tool)
            return given
        if self._recipe.z == "kept" and not self._told_by_touches(tool):
            if self._answers.yes:
                self._record(length_question(tool, name), True, AnsweredBy.YES, tool)
            else:
                confirm_height(context, tool, name)
        return None

    def _told_by_touches(self, tool: int) -> bool:
        """Return whether the heights of the touches will show if the tip is as long as before.

        Then that is asked once, with what they show, and only where the length changed.
        """
        recipe = self._recipe
        if not recipe.source.of_method.tells_height:
            return False
        pin = recipe.station.id
        return known_height(self._controller, tool, pin, self._stated_pin) is not None

    def _ask(
        self, context: MeasurementContext, number: int, prompt: "Prompt", tool: int | None
    ) -> None:
        answer = self._answers.prepared(number, prompt, tool)
        if answer is None:
            answer = ask_prompt(context, prompt, tool)
        else:
            self._record(prompt.text, answer, self._answers.given_by(number, prompt, tool), tool)
        if prompt.answer == "nozzle" and tool is not None:
            self._nozzles[tool] = answer
            self._sign(replace(self._signature, nozzle=answer))
        elif prompt.answer in ("nozzle", "lot"):
            self._signature = replace(self._signature, **{prompt.answer: answer})
            self._sign(self._signature)

    def _record(self, question: str, answer: bool | str, by: AnsweredBy, tool: int | None) -> None:
        """Record what was answered in advance; the runner records what it asks."""
        entry = answer_entry(question, answer, by, tool=tool, given_beforehand=True)
        self._controller.outcomes.append(entry)

    def _sign(self, signature: Signature) -> None:
        self._controller.outcomes.signature = signature

    def _switch(self, output: "Output") -> None:
        outputs = self._controller.io
        if outputs is None:
            raise ConfigError(
                tr("{controller} has no outputs.", controller=self._controller.identity),
                remedy=tr("Remove [[outputs]] from the recipe."),
            )
        # Ctrl-C waits until the output is noted, so that the end of the run lists it.
        with self._controller.uninterrupted():
            outputs.set_output(output.output, output.on)
            self.switched[output.output] = output.on


def _meant(asked: "Prompt | Output", moment: Moment, tool: int | None) -> bool:
    return asked.at == moment and asked.tool in (None, tool)


def ask_prompt(context: MeasurementContext, prompt: "Prompt", tool: int | None = None) -> str:
    """Ask a person a question of the recipe and return the answer, which is then recorded.

    Args:
        context: What asks.
        prompt: The question.
        tool: The tool that it is asked for, ``None`` for the whole change.

    Raises:
        DeclinedError: A yes was needed.

    Example:
        >>> from robolink.calibration_run import Limits
        >>> from robolink.procedures import MeasurementContext
        >>> from robolink.recipe import Prompt
        >>> from robolink.calibration_run._recipe_listener import ask_prompt
        >>> from robolink.controllers import SimpleController
        >>> class Person:  # implements robolink.Operator
        ...     def ask(self, question, kind): ...
        ...     def poll(self, wait_s):
        ...         return "N-0815"
        >>> with SimpleController() as controller:
        ...     settings = Limits().settings
        ...     context = MeasurementContext(controller, Person(), start=None, settings=settings)
        ...     ask_prompt(context, Prompt(at="start", text="Which nozzle?", answer="nozzle"))
        'N-0815'
    """
    runner = context.runner(tool=tool)
    if prompt.answer != "yes":
        return runner.ask_text(prompt.text)
    if not runner.confirm(prompt.text):
        raise DeclinedError(
            tr("The answer to {question!r} was no.", question=prompt.text),
            remedy=tr("Nothing was written. Start again when the answer is yes."),
        )
    return "yes"


def ask_height(context: MeasurementContext, tool: int, name: str) -> float:
    """Ask for Z of a new tip, mm from the flange.

    Raises:
        DeclinedError: No number was typed, however often it was asked.
    """
    runner = context.runner(tool=tool)
    for _ in range(MOST_REFUSED):
        text = runner.ask_text(height_question(tool, name))
        try:
            return parse_decimal(text)
        except ConfigError as error:
            context.operator.tell(str(error))
    raise DeclinedError(
        tr(
            "No number was typed for Z of tool {tool}, after several questions.",
            tool=tool,
        ),
        remedy=tr("Nothing was written. Have the length of the new tip at hand, then start again."),
    )


def height_question(tool: int, name: str) -> str:
    """Return the question for Z of a new tip."""
    return tr("Z of the new tip of tool {tool} {name} in mm from the flange?", tool=tool, name=name)


def length_question(tool: int, name: str) -> str:
    """Return the question whether Z may stay as it is."""
    return tr(
        "Z of tool {tool} {name} is not measured and stays. Is the new tip exactly as long "
        "as the old one?",
        tool=tool,
        name=name,
    )


def confirm_height(context: MeasurementContext, tool: int, name: str) -> None:
    """Ask whether the new tip is as long as the old one.

    Raises:
        DeclinedError: It is not.
    """
    if not context.runner(tool=tool).confirm(length_question(tool, name)):
        raise DeclinedError(
            tr("The new tip of tool {tool} is not as long as the old one.", tool=tool),
            remedy=tr('Nothing was written. Use a recipe with z = "typed" or "measured".'),
        )
