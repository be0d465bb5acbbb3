"""What a recipe requires: of a controller or a kind of controllers, and of whoever runs it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from robolink.errors import DeclinedError
from robolink.messages import tr
from robolink.methods import PointsParameters
from robolink.methods.pivot import LEAST_AXES
from robolink.model import AnsweredBy, Capabilities
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.sensing import VISION_GUIDE

if TYPE_CHECKING:
    from robolink.recipe._recipe import Recipe
    from robolink.recipe._tables import Prompt


def beyond(
    recipe: "Recipe",
    able: Capabilities,
    *,
    other_sensor: bool = False,
    writes: bool = True,
    axes: int | None = None,
) -> tuple[str, ...]:
    """Return what a recipe requires and a controller cannot do, a sentence each.

    Args:
        recipe: The recipe.
        able: What the controller, or its kind, can be asked for.
        other_sensor: Whether another camera takes the place of the recipe's.
        writes: Whether the tools are written.
        axes: How many axes the robot has; ``None`` where nobody knows yet.

    Example:
        >>> from pathlib import Path
        >>> from robolink.controllers import capabilities_of_kind
        >>> from robolink.recipe import beyond, load_recipe
        >>> from robolink_simulators.testkit.operator import written_recipe
        >>> recipe = load_recipe(written_recipe(Path.cwd())).recipe
        >>> beyond(recipe, capabilities_of_kind("plc"))
        ('The recipe moves the robot, which this controller cannot be told to.',)
        >>> beyond(recipe, capabilities_of_kind("epson"))
        ()
    """
    parameters = recipe.source.parameters
    taught = isinstance(parameters, PointsParameters) and any(one.points for one in recipe.tools)
    camera = "" if other_sensor else str(getattr(parameters, "sensor", None) or "")
    looks = camera.partition("?")[0] == VISION_GUIDE
    found = []
    if recipe.source.of_method.needs.motion and not able.motion:
        found.append(tr("The recipe moves the robot, which this controller cannot be told to."))
    if recipe.source.of_method.needs.tilt and axes is not None and axes < LEAST_AXES:
        found.append(
            tr("The recipe tilts the tool, which a robot of {axes} axes cannot do.", axes=axes)
        )
    if taught and not able.points:
        found.append(tr("The recipe reads taught points, and this controller has none."))
    if looks and not able.looks:
        found.append(
            tr("The recipe looks with Vision Guide, and this controller has no vision system.")
        )
    if recipe.outputs and (able.inputs_only or not able.io):
        found.append(tr("The recipe switches outputs, and this controller has none."))
    if writes and not able.tool_write:
        found.append(tr("The recipe writes tools, and this controller lets nobody write any."))
    return tuple(found)


@dataclass(frozen=True, slots=True)
class Answers:
    """Answers given with the command.

    Attributes:
        yes: Whether every yes-or-no question is answered with yes.
        nozzle: Id of the nozzle or needle.
        lot: Its lot.
        texts: Answers to other questions, by the number of the prompt in the recipe, from 1.
        z_mm: Z of the new tips, by tool, for z = "typed".
        early: Ids that a person was asked for before anything moved, by the number of the prompt
            and the tool that it is asked for; ``None`` for one of the whole change.
    """

    yes: bool = False
    nozzle: str = ""
    lot: str = ""
    texts: Mapping[int, str] = field(default_factory=dict, hash=False)
    z_mm: Mapping[int, float] = field(default_factory=dict, hash=False)
    early: Mapping[tuple[int, int | None], str] = field(default_factory=dict, hash=False)

    def prepared(self, number: int, prompt: "Prompt", tool: int | None = None) -> str | None:
        """Return the answer given in advance, ``None`` if there is none.

        Args:
            number: Number of the prompt in the recipe, from 1.
            prompt: The prompt.
            tool: The tool that it is asked for, ``None`` for the whole change.

        Example:
            >>> from robolink.recipe import Answers, Prompt
            >>> answers = Answers(yes=True, nozzle="N-0815")
            >>> answers.prepared(1, Prompt(at="start", text="Is the cell clear?"))
            'yes'
            >>> answers.prepared(2, Prompt(at="start", text="Which nozzle?", answer="nozzle"))
            'N-0815'
        """
        if (number, tool) in self.early:
            return self.early[number, tool]
        if prompt.answer == "yes":
            return "yes" if self.yes else None
        if prompt.answer == "nozzle":
            return self.nozzle or None
        if prompt.answer == "lot":
            return self.lot or None
        return self.texts.get(number)

    def given_by(self, number: int, prompt: "Prompt", tool: int | None = None) -> AnsweredBy:
        """Return how a prompt was answered in advance.

        Args:
            number: Number of the prompt in the recipe, from 1.
            prompt: The prompt.
            tool: The tool that it is asked for, ``None`` for the whole change.

        Example:
            >>> from robolink.recipe import Answers, Prompt
            >>> str(Answers(yes=True).given_by(1, Prompt(at="start", text="Is the cell clear?")))
            '--yes'
        """
        if (number, tool) in self.early:
            return AnsweredBy.PERSON
        return AnsweredBy.YES if prompt.answer == "yes" else AnsweredBy.OPTION

    def ids_wanted(self, recipe: "Recipe") -> Iterator[tuple[int, "Prompt", int | None]]:
        """Yield the unanswered prompts for ids, with the tool that each is for."""
        for number, prompt in enumerate(recipe.prompts, start=1):
            if prompt.answer not in ("nozzle", "lot"):
                continue
            tools: list[int | None] = [None]
            if prompt.at == "before_measure":
                tools = [one.number for one in recipe.tools if prompt.tool in (None, one.number)]
            for tool in tools:
                if self.prepared(number, prompt, tool) is None:
                    yield number, prompt, tool

    def missing(self, recipe: "Recipe") -> Iterator[str]:
        """Yield what was not answered in advance, as the option that would answer it."""
        for number, prompt in enumerate(recipe.prompts, start=1):
            if self.prepared(number, prompt) is None:
                yield _option(number, prompt)
        if recipe.z == "kept" and not self.yes:
            yield remedy_word(RemedyWord.YES)
        if recipe.z == "typed":
            for tool in recipe.tools:
                if tool.number not in self.z_mm:
                    yield remedy_word(RemedyWord.HEIGHT, tool=tool.number)


def require_answers(answers: Answers, recipe: "Recipe") -> None:
    """Refuse, before anything is sent, to run if a question would find nobody.

    Raises:
        DeclinedError: Nobody is there to say it; names what is missing.
    """
    options = ", ".join(dict.fromkeys(answers.missing(recipe)))
    if options:
        raise DeclinedError(
            tr("The recipe asks questions, but there is nobody to ask."),
            remedy=tr("Run it on a terminal, or answer beforehand: {options}.", options=options),
        )


def _option(number: int, prompt: "Prompt") -> str:
    if prompt.answer == "yes":
        return remedy_word(RemedyWord.YES)
    if prompt.answer == "nozzle":
        return remedy_word(RemedyWord.NOZZLE)
    if prompt.answer == "lot":
        return remedy_word(RemedyWord.LOT)
    return remedy_word(RemedyWord.ANSWER, number=number)
