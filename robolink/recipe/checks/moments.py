"""Whether prompts and outputs of a recipe come when and for whom they can."""

from collections.abc import Iterator
from typing import Final

from robolink.files.toml import Problem
from robolink.messages import tr
from robolink.recipe.checks.draft import Draft
from robolink.recipe.file.tables import Output, Prompt

_OF_ONE_TOOL: Final = frozenset({"before_measure", "after_measure"})
_FOR_THE_RECORD: Final = frozenset({"nozzle", "lot"})
_TOO_LATE: Final = frozenset({"before_write", "end"})


def moments(draft: Draft) -> Iterator[Problem]:
    """Check the tools that prompts and outputs name."""
    known = None if draft.tools is None else {tool.number for tool in draft.tools}
    for where, entry in _entries(draft):
        if entry.tool is None:
            continue
        if entry.at not in _OF_ONE_TOOL:
            yield Problem(
                where, tr('means nothing here: "{at}" comes once for all tools', at=entry.at)
            )
        elif known is not None and entry.tool not in known:
            yield Problem(
                where,
                tr("is not a tool of this recipe; write one of its [[tools]], or leave it out"),
            )


def answers(draft: Draft) -> Iterator[Problem]:
    """Check that a nozzle and its lot are asked once, and before they are put on record."""
    asked: set[tuple[str, int | None]] = set()
    for number, prompt in enumerate(draft.prompts or (), start=1):
        if prompt.answer not in _FOR_THE_RECORD:
            continue
        if prompt.at in _TOO_LATE:
            yield Problem(
                f"prompts#{number}.at",
                tr(
                    "is too late for this answer: the measurement is on record by then; write "
                    '"start" or "before_measure"'
                ),
            )
        if asked & {(prompt.answer, prompt.tool), (prompt.answer, None)}:
            yield Problem(f"prompts#{number}.answer", tr("is asked already; ask once"))
        asked.add((prompt.answer, prompt.tool))


def _entries(draft: Draft) -> Iterator[tuple[str, Prompt | Output]]:
    for number, prompt in enumerate(draft.prompts or (), start=1):
        yield f"prompts#{number}.tool", prompt
    for number, output in enumerate(draft.outputs or (), start=1):
        yield f"outputs#{number}.tool", output
