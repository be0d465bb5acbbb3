"""A recipe of which some tables may be wrong: what is checked for going together."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields
from typing import Any

from robolink.recipe.file.method_tables import MethodTable
from robolink.recipe.file.recipe import Basis, HeightRule
from robolink.recipe.file.tables import (
    Box,
    Output,
    Poses,
    Prompt,
    RefusalTable,
    StationTable,
    Tolerances,
    Tool,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Draft:
    """What of a recipe is right in itself; ``None`` for the rest, which is told already.

    Attributes:
        given: The keys at the top of the file, right or wrong.
    """

    given: Collection[str]
    basis: Basis | None = None
    z: HeightRule | None = None
    verify: bool | None = None
    source: MethodTable | None = None
    station: StationTable | None = None
    poses: Poses | None = None
    tools: tuple[Tool, ...] | None = None
    box: Box | None = None
    tolerances: Tolerances | None = None
    refusal: RefusalTable | None = None
    prompts: tuple[Prompt, ...] | None = None
    outputs: tuple[Output, ...] | None = None

    @classmethod
    def of(cls, sound: Mapping[str, Any], *, given: Collection[str]) -> "Draft":
        """Return the draft made of the tables that are right in themselves."""
        names = {field.name for field in fields(cls)}
        return cls(given=given, **{name: sound[name] for name in sound if name in names})
