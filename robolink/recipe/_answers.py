"""What a person is asked, and what was answered beforehand."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from robolink.errors import ConfigError, DeclinedError
from robolink.messages import tr
from robolink.model import AnsweredBy
from robolink.procedures import MeasurementContext
from robolink.recipe.file.recipe import Recipe
from robolink.recipe.file.tables import Prompt
from robolink.runner import MOST_REFUSED, parse_decimal
from robolink.ways import Way, way


@dataclass(frozen=True, slots=True)
class Answers:
    """What was given with the command.

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
    texts: Mapping[int, str] = field(default_factory=dict)
    z_mm: Mapping[int, float] = field(default_factory=dict)
    early: Mapping[tuple[int, int | None], str] = field(default_factory=dict)

    def prepared(self, number: int, prompt: Prompt, tool: int | None = None) -> str | None:
        """Return the answer that was given beforehand, ``None`` when there is none.

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

    def given_by(self, number: int, prompt: Prompt, tool: int | None = None) -> AnsweredBy:
        """Return how a prompt was answered beforehand.

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

    def ids_wanted(self, recipe: Recipe) -> Iterator[tuple[int, Prompt, int | None]]:
        """Yield the prompts for ids that nobody has answered, with the tool each is asked for."""
        for number, prompt in enumerate(recipe.prompts, start=1):
            if prompt.answer not in ("nozzle", "lot"):
                continue
            tools: list[int | None] = [None]
            if prompt.at == "before_measure":
                tools = [one.number for one in recipe.tools if prompt.tool in (None, one.number)]
            for tool in tools:
                if self.prepared(number, prompt, tool) is None:
                    yield number, prompt, tool

    def missing(self, recipe: Recipe) -> Iterator[str]:
        """Yield what nobody answered beforehand, as what would."""
        for number, prompt in enumerate(recipe.prompts, start=1):
            if self.prepared(number, prompt) is None:
                yield _option(number, prompt)
        if recipe.z == "kept" and not self.yes:
            yield way(Way.YES)
        if recipe.z == "typed":
            for tool in recipe.tools:
                if tool.number not in self.z_mm:
                    yield way(Way.HEIGHT, tool=tool.number)


def require_answers(answers: Answers, recipe: Recipe) -> None:
    """Refuse, before anything is sent, to run where a question would find nobody.

    Raises:
        DeclinedError: Nobody is there to say it; names what is missing.
    """
    options = ", ".join(dict.fromkeys(answers.missing(recipe)))
    if options:
        raise DeclinedError(
            tr("The recipe asks questions, but there is nobody to ask."),
            remedy=tr("Run it on a terminal, or answer beforehand: {options}.", options=options),
        )


def ask_prompt(context: MeasurementContext, prompt: Prompt, tool: int | None = None) -> str:
    """Put a question of the recipe to the person and return the answer, which is on record then.

    Args:
        context: What asks.
        prompt: The question.
        tool: The tool that it is asked for, ``None`` for the whole change.

    Raises:
        DeclinedError: A yes was needed.

    Example:
        >>> from robolink.nozzle_change import Limits
        >>> from robolink.procedures import MeasurementContext
        >>> from robolink.recipe import Prompt
        >>> from robolink.recipe._answers import ask_prompt
        >>> from robolink.testing import MemoryController
        >>> class Person:  # implements robolink.Operator
        ...     def ask(self, question, kind): ...
        ...     def poll(self, wait_s):
        ...         return "N-0815"
        >>> with MemoryController() as controller:
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
            tr("{question!r} was answered with no.", question=prompt.text),
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
            "No number was typed for Z of tool {tool}, although it was asked several times.",
            tool=tool,
        ),
        remedy=tr("Nothing was written. Start again with the length of the new tip at hand."),
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


def _option(number: int, prompt: Prompt) -> str:
    if prompt.answer == "yes":
        return way(Way.YES)
    if prompt.answer == "nozzle":
        return way(Way.NOZZLE)
    if prompt.answer == "lot":
        return way(Way.LOT)
    return way(Way.ANSWER, number=number)
