"""What a recipe does between the phases of a nozzle change: asks, switches, proposes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from robolink.calibration import VerifyResult
from robolink.errors import CalibrationError, ConfigError
from robolink.messages import tr
from robolink.model import AnsweredBy, Controller, Signature, ToolReceipt, answer_entry
from robolink.nozzle_change import Listener, Moment, Proposal, known_height
from robolink.procedures import MeasurementContext
from robolink.recipe._answers import (
    Answers,
    ask_height,
    ask_prompt,
    confirm_height,
    height_question,
    length_question,
)
from robolink.recipe._proposing import proposed
from robolink.recipe._reference import Reference
from robolink.recipe.file.recipe import Recipe
from robolink.recipe.file.tables import Output, Prompt
from robolink.runner import StepDone
from robolink.stations import Station


class RecipeListener(Listener):
    """Carries out the prompts, outputs, basis and Z of one recipe.

    Attributes:
        switched: The outputs that were switched, with their last state.

    Args:
        recipe: The recipe.
        controller: The controller, connected.
        answers: What was answered beforehand.
        references: The references of basis "difference", by tool.
        taking_reference: Whether this run only takes them.
        measure_only: Whether nothing follows from what is measured, so that no length is asked for.
        stated_pin: The pin as the cell file has it, ``None`` where it says nothing.
        audience: Told of everything as well.
    """

    def __init__(
        self,
        recipe: Recipe,
        controller: Controller,
        answers: Answers,
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
        """Ask what is to be asked, then switch what is to be switched."""
        self._audience.moment(moment, context, tool)
        if moment is Moment.AFTER_MEASURE:
            # The id belonged to that tool; the value that is kept says it again.
            self._sign(self._signature)
        for number, prompt in enumerate(self._recipe.prompts, start=1):
            if _meant(prompt, moment, tool):
                self._ask(context, number, prompt, tool)
        for output in self._recipe.outputs:
            if _meant(output, moment, tool):
                self._switch(output)

    def adjusted(self, proposal: Proposal, context: MeasurementContext) -> Proposal:
        """Return what the recipe proposes from a measurement."""
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
        """Tell whether the heights of the touches will show whether the tip is as long as before.

        Then that is asked once, with what they show, and only where the length changed.
        """
        recipe = self._recipe
        if not recipe.source.of_method.tells_height:
            return False
        pin = recipe.station.id
        return known_height(self._controller, tool, pin, self._stated_pin) is not None

    def _ask(
        self, context: MeasurementContext, number: int, prompt: Prompt, tool: int | None
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
        """Put on record what was answered beforehand; what is asked, the runner records."""
        entry = answer_entry(question, answer, by, tool=tool, given_beforehand=True)
        self._controller.outcomes.append(entry)

    def _sign(self, signature: Signature) -> None:
        self._controller.outcomes.signature = signature

    def _switch(self, output: Output) -> None:
        outputs = self._controller.io
        if outputs is None:
            raise ConfigError(
                tr("{controller} has no outputs.", controller=self._controller.identity),
                remedy=tr("Take [[outputs]] out of the recipe."),
            )
        # Ctrl-C waits until it is noted too: how the run ended names what it switched.
        with self._controller.uninterrupted():
            outputs.set_output(output.output, output.on)
            self.switched[output.output] = output.on


def _meant(asked: Prompt | Output, moment: Moment, tool: int | None) -> bool:
    return asked.at == moment and asked.tool in (None, tool)
