"""A plan: which cells do what, in which rings and when. Frozen when it is made."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Final

from robolink.config import names_meant
from robolink.errors import ConfigError
from robolink.files.key_problems import is_not_known, sentence
from robolink.files.toml import FileKind, Problem
from robolink.fleet.errors import PlanError
from robolink.fleet.states import PlanKind
from robolink.fleet.windows import Window
from robolink.journal import this_computer
from robolink.messages import tr
from robolink.timing import wall_label
from robolink.transaction import require_order_id

if TYPE_CHECKING:
    from pydantic import ValidationError

    from robolink.fleet.plan_tables import PlanFile
    from robolink.recipe import LoadedRecipe

SCHEMA: Final = "robolink/fleet-plan/1"
LONGEST_ID: Final = 12

_DEFAULT_RINGS: Final = (1, 4, "rest")
REST: Final = "rest"


@dataclass(frozen=True, slots=True)
class Plan:
    """What many cells are to do. Nothing of it changes once it is made.

    Attributes:
        id: Its id, 12 characters, made from all the rest.
        kind: What the cells do.
        name: What people call it.
        plant: The plant whose agent carries it out.
        rings: The cells, ring after ring.
        recipe: Path of the recipe; empty where the kind needs none.
        recipe_hash: SHA-256 of that file: a run with another content is refused.
        offsets: For the kind ``offset``: the tool and the components to write, by cell.
        window: The hours in which jobs begin; empty for any.
        permit: The group of permits that a job waits for, where its kind waits for one.
        at_once: How many cells may be at work at the same time.
        auto: Whether a ring begins without a person when the one before ended well.
        expected_refusals: Share of cells that are expected to refuse.
        author: Who made it.
        made_at: When, as a label: ISO 8601, UTC.
        homes: The home of each cell: the computer whose agent carries its job out. Empty where no
            cell file names one; then all of the plan is carried out on one computer, whichever.
    """

    id: str
    kind: PlanKind
    name: str
    plant: str
    rings: tuple[tuple[str, ...], ...]
    recipe: str = ""
    recipe_hash: str = ""
    offsets: Mapping[str, Mapping[str, float]] = field(default_factory=dict, hash=False)
    window: str = ""
    permit: str = ""
    at_once: int = 20
    auto: bool = False
    expected_refusals: float = 0.03
    author: str = ""
    made_at: str = ""
    homes: Mapping[str, str] = field(default_factory=dict, hash=False)

    @property
    def cells(self) -> tuple[str, ...]:
        """All cells, in the order in which they take their turn."""
        return tuple(cell for ring in self.rings for cell in ring)

    @property
    def sizes(self) -> tuple[int, ...]:
        """Number of cells in each ring."""
        return tuple(len(ring) for ring in self.rings)

    @property
    def needs_permit(self) -> bool:
        """Whether its jobs wait for a permit."""
        return not self.kind.reads

    def order(self, cell: str) -> str:
        """Return the id of the order of one cell: the same however often it is delivered."""
        return f"{self.id}/{cell}"

    def most_at_once(self, ring: int) -> int:
        """Return how many cells of a ring may be at work: of the first two, one after the other."""
        return 1 if ring < 2 and not self.kind.reads else self.at_once

    def window_open(self, now: datetime) -> bool:
        """Return whether jobs may begin at an instant.

        Args:
            now: With the zone of the agent's computer.
        """
        return not self.window or Window.parse(self.window).is_open(now)

    def require_recipe(self) -> "LoadedRecipe | None":
        """Return the recipe, which is the one that was frozen; ``None`` for a kind without one.

        Raises:
            PlanError: It is another one.
            ConfigError: It cannot be read, or is wrong.
        """
        from robolink.recipe import load_recipe

        loaded = load_recipe(Path(self.recipe)) if self.recipe else None
        if loaded is not None and loaded.sha256 != self.recipe_hash:
            raise PlanError(
                tr(
                    "The recipe {path} is not the one of plan {plan}.",
                    path=self.recipe,
                    plan=self.id,
                ),
                remedy=tr("Nothing was sent. Restore the file, or make a new plan with it."),
            )
        return loaded

    def document(self) -> dict[str, object]:
        """Return all of it as plain JSON."""
        return {
            "schema": SCHEMA,
            "plan": self.id,
            "kind": str(self.kind),
            "name": self.name,
            "plant": self.plant,
            "rings": [list(ring) for ring in self.rings],
            "recipe": self.recipe,
            "recipe_hash": self.recipe_hash,
            "offsets": {cell: dict(values) for cell, values in self.offsets.items()},
            "window": self.window,
            "permit": self.permit,
            "at_once": self.at_once,
            "auto": self.auto,
            "expected_refusals": self.expected_refusals,
            "author": self.author,
            "made_at": self.made_at,
            **({"homes": dict(self.homes)} if self.homes else {}),
        }

    @classmethod
    def from_document(cls, said: Mapping[str, object]) -> "Plan":
        """Return what :meth:`document` gave.

        Raises:
            PlanError: It was changed since: its id is made from all the rest.
        """
        values = {key: value for key, value in said.items() if key not in ("schema", "plan")}
        rings = values.pop("rings")
        assert isinstance(rings, list)  # noqa: S101 - as it was written
        kind = PlanKind(str(values.pop("kind")))
        plan = cls(str(said["plan"]), kind, rings=tuple(map(tuple, rings)), **values)  # type: ignore[arg-type]
        if plan.id != _id_of(said):
            raise PlanError(
                tr("Plan {plan} was changed after it was made.", plan=plan.id),
                remedy=tr("Nothing was sent. Make it anew from its file."),
            )
        return plan


def _id_of(document: Mapping[str, object]) -> str:
    """Return the id of a plan by its document: by all that is in it, whichever version made it."""
    said = {key: value for key, value in document.items() if key != "plan"}
    text = json.dumps(said, sort_keys=True, separators=(",", ":"))
    return sha256(text.encode()).hexdigest()[:LONGEST_ID]


PLAN_FILE: Final = FileKind(
    named=lambda path: tr("The plan {path}", path=path),
    unreadable_remedy=lambda: tr("Nothing was planned. Give a plan file; docs/fleet.md shows one."),
    wrong_remedy=lambda: tr("Nothing was planned. Correct it; docs/fleet.md explains every key."),
)


def load_plan(
    path: Path,
    *,
    cells: Sequence[str],
    author: str = "",
    made_at: str = "",
    groups: Mapping[str, Sequence[str]] | None = None,
    homes: Mapping[str, str] | None = None,
) -> Plan:
    r"""Return the plan that a file describes, frozen.

    Args:
        path: The file.
        cells: Names of all cells.
        author: Who makes it.
        made_at: When, as a label: ISO 8601, UTC; now unless given.
        groups: Groups of cells, by name.
        homes: Homes of the cells whose files name one, as ``load_cell_files().homes``. A cell
            without one has its home here, if another cell of the plan has one.

    Raises:
        ConfigError: The file, or its recipe, cannot be read or is wrong; every problem is told.

    Example:
        >>> from pathlib import Path
        >>> from robolink.fleet import load_plan
        >>> said = 'schema = "robolink/fleet-plan/1"\nkind = "check"\nname = "n"\ncells = ["a*"]'
        >>> _ = Path("plan.toml").write_text(said)
        >>> load_plan(Path("plan.toml"), cells=["a1", "a2", "b1"]).cells
        ('a1', 'a2')
    """
    table = PLAN_FILE.parse(path, PLAN_FILE.read(path))
    return plan_of(
        table,
        path=path,
        cells=cells,
        author=author,
        made_at=made_at,
        groups=groups,
        homes=homes,
    )


def plan_of(
    table: Mapping[str, object],
    *,
    cells: Sequence[str],
    author: str = "",
    made_at: str = "",
    groups: Mapping[str, Sequence[str]] | None = None,
    homes: Mapping[str, str] | None = None,
    path: Path = Path("plan.toml"),
) -> Plan:
    """Return the plan that a table describes, with the keys of a plan file, frozen.

    Args:
        table: The table.
        cells: Names of all cells.
        author: Who makes it.
        made_at: When, as a label: ISO 8601, UTC; now unless given.
        groups: Groups of cells, by name.
        homes: As of :func:`load_plan`.
        path: Where a recipe's path begins, and the name of the plan in errors.

    Raises:
        ConfigError: As of :func:`load_plan`.

    Example:
        >>> from robolink.fleet import plan_of
        >>> table = {"schema": "robolink/fleet-plan/1", "kind": "backup", "name": "nightly"}
        >>> cells = ["line3-a", "line3-b", "line4-a"]
        >>> plan = plan_of({**table, "cells": ["line3-*"]}, cells=cells, author="Li")
        >>> plan.rings, len(plan.id)
        ((('line3-a', 'line3-b'),), 12)
    """
    from pydantic import ValidationError

    from robolink.fleet.plan_tables import PlanFile

    try:
        said = PlanFile.model_validate(dict(table))
    except ValidationError as error:
        raise PLAN_FILE.refusal(path, _problems_of(error)) from error
    problems: list[Problem] = []
    rings = _rings(said, cells, groups or {}, problems)
    offsets = {cell: one.components() for cell, one in said.offsets.items()}
    problems += _of_kind(said, rings)
    if problems:
        raise PLAN_FILE.refusal(path, problems)
    recipe, recipe_hash = _recipe(said, path, rings)
    draft = Plan(
        "",
        said.kind,
        said.name,
        said.plant,
        rings,
        recipe=recipe,
        recipe_hash=recipe_hash,
        offsets=offsets,
        window=said.window,
        permit=said.permit,
        at_once=said.at_once,
        auto=said.auto,
        expected_refusals=said.expected_refusals,
        author=author,
        made_at=made_at or wall_label(),
        homes=_homes([cell for ring in rings for cell in ring], homes or {}),
    )
    plan = replace(draft, id=_id_of(draft.document()))
    for cell in plan.cells:
        require_order_id(plan.order(cell))
    return plan


def _homes(cells: Sequence[str], homes: Mapping[str, str]) -> dict[str, str]:
    """Return the home of each cell; nothing where none of them names one."""
    if not any(homes.get(cell) for cell in cells):
        return {}
    here = this_computer()
    return {cell: homes.get(cell) or here for cell in cells}


def _named(
    words: Sequence[str], cells: Sequence[str], groups: Mapping[str, Sequence[str]]
) -> tuple[tuple[str, ...], str]:
    """Return the cells that words name, and what is wrong with the words; empty for nothing."""
    try:
        return names_meant(words, cells, groups), ""
    except ConfigError as error:
        return (), str(error)


def _rings(
    said: "PlanFile",
    cells: Sequence[str],
    groups: Mapping[str, Sequence[str]],
    problems: list[Problem],
) -> tuple[tuple[str, ...], ...]:
    chosen: dict[str, None] = {}
    for word in said.cells:
        found, wrong = _named([word], cells, groups)
        if wrong:
            problems.append(Problem("cells", wrong))
        chosen |= dict.fromkeys(found)
    left, rings = list(chosen), list[tuple[str, ...]]()
    entries: Sequence[int | str] = said.rings or ((REST,) if said.kind.reads else _DEFAULT_RINGS)
    for number, entry in enumerate(entries, start=1):
        if isinstance(entry, int):
            ring = left[:entry]
        elif entry == REST:
            ring = list(left)
        else:
            found, wrong = _named([entry], cells, groups)
            if wrong and not problems:
                problems.append(Problem(f"rings.{number}", wrong))
            named = set(found)
            ring = [cell for cell in left if cell in named]
        taken = set(ring)
        left = [cell for cell in left if cell not in taken]
        if ring:
            rings.append(tuple(ring))
    if left and not problems:
        problems.append(
            Problem("rings", tr('leave {count} cells out; end with "rest"', count=len(left)))
        )
    return tuple(rings)


def _of_kind(said: "PlanFile", rings: Iterable[Sequence[str]]) -> list[Problem]:
    """Return what does not go with the kind of plan."""
    problems = []
    if said.kind.moves and not said.recipe:
        problems.append(Problem("recipe", tr("is missing")))
    if said.recipe and not said.kind.moves:
        problems.append(Problem("recipe", tr("does not go with the kind {kind}", kind=said.kind)))
    cells = [cell for ring in rings for cell in ring]
    wanted = cells if said.kind is PlanKind.OFFSET else []
    for cell in wanted:
        if cell not in said.offsets:
            problems.append(Problem(f"offsets.{cell}", tr("is missing")))
    for cell in said.offsets:
        if cell not in wanted:
            problems.append(Problem(f"offsets.{cell}", tr("is no cell of this plan")))
    return problems


def _recipe(said: "PlanFile", path: Path, rings: Iterable[Sequence[str]]) -> tuple[str, str]:
    if not said.recipe:
        return "", ""
    from robolink.recipe import load_recipe

    loaded = load_recipe((path.parent / said.recipe).absolute())
    others = [cell for ring in rings for cell in ring if not loaded.recipe.is_for(cell)]
    if others:
        names = ", ".join(others[:3]) + (" ..." if others[3:] else "")
        sentence_of = tr(
            "is not meant for {count} of the cells: {names}", count=len(others), names=names
        )
        raise PLAN_FILE.refusal(path, [Problem("recipe", sentence_of)])
    return str(loaded.path), loaded.sha256


def _problems_of(error: "ValidationError") -> list[Problem]:
    from robolink.fleet.plan_tables import OffsetTable, PlanFile

    problems = []
    for detail in error.errors(include_url=False, include_input=False):
        where = ".".join(str(part + 1 if isinstance(part, int) else part) for part in detail["loc"])
        if detail["type"] == "extra_forbidden":
            table = PlanFile if len(detail["loc"]) == 1 else OffsetTable
            names = [one.alias or name for name, one in table.model_fields.items()]
            problems.append(Problem(where, is_not_known(str(detail["loc"][-1]), names)))
        elif detail["type"] == "enum":
            kinds = ", ".join(f'"{kind}"' for kind in PlanKind)
            problems.append(Problem(where, tr("must be one of {values}", values=kinds)))
        else:
            problems.append(Problem(where, sentence(detail)))
    return problems
