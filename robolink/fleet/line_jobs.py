"""Jobs that a line computer orders for one cell each: what it may ask for, and which plan that is.

The order's id is the line computer's own. It becomes a plan of one cell, whose name is that id; in
the cell's journal the change has the order ``PLAN/CELL``, as every job of a plan. The posted id
could not be that order: two line computers may count alike, and an order of the journal must never
mean two jobs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from robolink.errors import ConfigError
from robolink.files.key_problems import is_not_known, one_of, sentence
from robolink.files.toml import Problem
from robolink.fleet.errors import PlanError
from robolink.fleet.plans import SCHEMA, Plan, plan_of
from robolink.fleet.states import PlanKind
from robolink.messages import known_names, listed, tr
from robolink.transaction import require_order_id

if TYPE_CHECKING:
    from pydantic import BaseModel


class LineJobError(PlanError):
    """A line computer asked for what cannot be ordered.

    Attributes:
        problems: What is wrong, by field.
    """

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__(
            listed(tr("This cannot be ordered:"), [str(one) for one in self.problems]),
            remedy=tr("Nothing was kept. Correct it, then post it again."),
        )


class OpenLineJobsError(PlanError):
    """A line computer has so many jobs that have not ended that it may order no more."""

    def __init__(self, line: str, most: int) -> None:
        super().__init__(
            tr("{line} has {most} jobs that have not ended.", line=line, most=most),
            remedy=tr(
                "Nothing was kept. Order it again when one has ended, or cancel the plans of those "
                "that nobody needs."
            ),
        )


@dataclass(frozen=True, slots=True)
class LineOrder:
    """What a line computer asks for.

    Attributes:
        order: Its own id of the job.
        cell: Name of the cell.
        kind: What the cell is to do.
        recipe: Name of the recipe; empty where the kind needs none.
        offset: For the kind ``offset``: the tool and the components to write.
        window: The hours in which it may begin; empty for any.
        permit: The group of permits that it waits for, where its kind waits for one; its token
            says which it may name.
    """

    order: str
    cell: str
    kind: PlanKind
    recipe: str = ""
    offset: Mapping[str, float] = field(default_factory=dict, hash=False)
    window: str = ""
    permit: str = ""

    def fields(self) -> dict[str, object]:
        """Return what makes it this job, as plain JSON: all but its id."""
        return {
            "cell": self.cell,
            "kind": str(self.kind),
            "recipe": self.recipe,
            "offset": dict(self.offset),
            "window": self.window,
            "permit": self.permit,
        }

    def plan(
        self,
        line: str,
        *,
        cells: Sequence[str],
        recipes: Mapping[str, Path],
        home: str = "",
        plant: str = "plant",
    ) -> Plan:
        """Return it as a plan of its cell, frozen.

        Args:
            line: The line computer.
            cells: Names of all cells.
            recipes: Files of the recipes that the cell may use, by their names.
            home: The computer where the cell is at home; empty where no file names one.
            plant: The plant whose agent carries it out.

        Raises:
            LineJobError: There is no such cell or recipe; every problem is told.

        Example:
            >>> from robolink.fleet import line_order_of
            >>> said = {"order": "A-17/3", "cell": "line3-a", "kind": "check"}
            >>> plan = line_order_of(said).plan("mes", cells=["line3-a"], recipes={})
            >>> plan.name, plan.rings, plan.author
            ('A-17/3', (('line3-a',),), 'mes (line computer)')
        """
        problems = []
        if self.cell not in cells:
            problems.append(Problem("cell", _unknown(self.cell, cells)))
        elif self.recipe and self.recipe not in recipes:
            problems.append(Problem("recipe", _unknown(self.recipe, tuple(recipes))))
        if problems:
            raise LineJobError(problems)
        table: dict[str, object] = {
            "schema": SCHEMA,
            "kind": str(self.kind),
            "name": self.order,
            "plant": plant,
            "cells": [self.cell],
            "window": self.window,
            "permit": self.permit,
        }
        if self.recipe:
            table["recipe"] = str(recipes[self.recipe])
        if self.offset:
            table["offsets"] = {self.cell: dict(self.offset)}
        author = f"{line} (line computer)"
        try:
            homes = {self.cell: home} if home else None
            return plan_of(table, cells=[self.cell], author=author, homes=homes)
        except ConfigError as error:
            raise LineJobError([Problem("recipe" if self.recipe else "", error.what)]) from error


@dataclass(frozen=True, slots=True)
class LineJob:
    """A job that a line computer ordered, as it is on record.

    Attributes:
        line: The line computer.
        order: Its own id of the job.
        plan: Id of the plan that it became.
        cell: Name of the cell.
        posted_at: When, as a label: ISO 8601, UTC.
        fields: What was asked for.
    """

    line: str
    order: str
    plan: str
    cell: str
    posted_at: str
    fields: Mapping[str, object] = field(default_factory=dict, hash=False)

    def differs(self, asked: LineOrder) -> tuple[str, ...]:
        """Return the fields in which another order of the same id differs; empty for none."""
        return tuple(
            name for name, value in asked.fields().items() if self.fields.get(name) != value
        )


def line_order_of(said: Mapping[str, object]) -> LineOrder:
    """Return what the body of a post asks for.

    Args:
        said: The body.

    Raises:
        LineJobError: It is not as it has to be; every problem is told.
    """
    from pydantic import ValidationError

    table = line_order_table()
    try:
        found: Any = table.model_validate(dict(said))
    except ValidationError as error:
        details = error.errors(include_url=False, include_input=False)
        raise LineJobError([_problem(detail, table) for detail in details]) from error
    offset = {} if found.offset is None else found.offset.components()
    asked = LineOrder(
        found.order,
        found.cell,
        found.kind,
        found.recipe or "",
        offset,
        found.window,
        found.permit,
    )
    if problems := _of_kind(asked):
        raise LineJobError(problems)
    return asked


@cache
def line_order_table() -> "type[BaseModel]":
    """Return the keys and limits of a body. pydantic is imported with the first one."""
    from pydantic import BaseModel, Field, field_validator

    from robolink.fleet.plan_tables import STRICT, Hours, Line, OffsetTable

    class LineOrderTable(BaseModel):
        """What a line computer posts.

        Attributes:
            order: Its id of the job, 1 to 64 printable ASCII characters.
            cell: Name of the cell.
            kind: What the cell is to do.
            recipe: Name of a recipe that the cell may use.
            offset: The tool and the components to write.
            window: The hours in which it may begin: ``22:00-05:00``, local time of the agent.
            permit: The group of permits that it waits for: that of the token, which need not be
                named.
        """

        model_config = STRICT

        order: str
        cell: Line
        kind: Annotated[PlanKind, Field(strict=False)]
        recipe: Line | None = None
        offset: OffsetTable | None = None
        window: Hours = ""
        permit: Annotated[str, Field(max_length=200)] = ""

        @field_validator("order")
        @classmethod
        def _is_an_order(cls, order: str) -> str:
            try:
                return require_order_id(order)
            except ConfigError:
                raise ValueError(tr("must be 1 to 64 printable ASCII characters")) from None

    return LineOrderTable


def _problem(detail: Any, table: "type[BaseModel]") -> Problem:  # noqa: ANN401 - pydantic's form
    from robolink.fleet.plan_tables import OffsetTable

    where = ".".join(str(part) for part in detail["loc"])
    if detail["type"] == "extra_forbidden":
        names = (table if len(detail["loc"]) == 1 else OffsetTable).model_fields
        return Problem(where, is_not_known(str(detail["loc"][-1]), names))
    if detail["type"] == "enum":
        return Problem(where, one_of(PlanKind))
    return Problem(where, sentence(detail))


def _of_kind(asked: LineOrder) -> list[Problem]:
    """Return what does not go with the kind of job."""
    wanted = {"recipe": asked.kind.moves, "offset": asked.kind is PlanKind.OFFSET}
    given = {"recipe": asked.recipe, "offset": asked.offset}
    problems = []
    for name, needed in wanted.items():
        if needed and not given[name]:
            problems.append(Problem(name, tr("is missing")))
        elif given[name] and not needed:
            does_not = tr("does not go with the kind {kind}", kind=asked.kind)
            problems.append(Problem(name, does_not))
    return problems


def _unknown(name: str, names: Sequence[str]) -> str:
    known = known_names(names, name) if names else ""
    return " ".join(filter(None, (tr("there is no {name!r} here.", name=name), known)))
