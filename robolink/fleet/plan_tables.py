"""The tables of a plan file: keys and limits. Imported when one is read, for pydantic."""

from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from robolink.fleet.states import PlanKind
from robolink.fleet.windows import Window
from robolink.messages import tr
from robolink.model import COMPONENTS

Line = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$")]
"""One line for people. No control characters: they would reach a terminal."""


def _hours(window: str) -> str:
    if window:
        try:
            Window.parse(window)
        except ValueError:
            raise ValueError(tr("must be two times of day: 22:00-05:00")) from None
    return window


Hours = Annotated[str, AfterValidator(_hours)]
"""Two times of day, ``22:00-05:00``; empty for any hour."""

STRICT = ConfigDict(
    extra="forbid", frozen=True, strict=True, allow_inf_nan=False, hide_input_in_errors=True
)


class OffsetTable(BaseModel):
    """What is written at one cell; a missing component stays as it is.

    Attributes:
        tool: Number of the tool.
        x_mm, y_mm, z_mm, u_deg, v_deg, w_deg: Components of its offset.
    """

    model_config = STRICT

    tool: Annotated[int, Field(ge=1, le=15)]
    x_mm: float | None = None
    y_mm: float | None = None
    z_mm: float | None = None
    u_deg: float | None = None
    v_deg: float | None = None
    w_deg: float | None = None

    @model_validator(mode="after")
    def _writes_something(self) -> "OffsetTable":
        if len(self.components()) == 1:
            raise ValueError(tr("has no component to write: {names}", names=", ".join(COMPONENTS)))
        return self

    def components(self) -> dict[str, float]:
        """Return the tool, and the components that are given."""
        return self.model_dump(exclude_none=True)


class PlanFile(BaseModel):
    """One whole plan file.

    Attributes:
        format: Form of the file and its version.
        kind: What the cells do.
        name: What people call the plan.
        cells: Names, patterns such as ``line3-*``, and groups such as ``@line3``.
        rings: How many cells each ring has, or which of those left; ``rest`` for all that are left.
        plant: The plant whose agent carries it out.
        recipe: Path of the recipe, seen from the plan file.
        offsets: What is written, by cell.
        window: The hours in which jobs begin: ``22:00-05:00``, local time.
        permit: The group of permits that the jobs wait for.
        at_once: How many cells may be at work at the same time.
        auto: Whether a ring begins without a person when the one before ended well.
        expected_refusals: Share of cells that are expected to refuse.
    """

    model_config = STRICT

    format: Annotated[Literal["robolink/fleet-plan/1"], Field(alias="schema")]
    kind: Annotated[PlanKind, Field(strict=False)]
    name: Line
    cells: Annotated[tuple[Line, ...], Field(strict=False, min_length=1)]
    rings: Annotated[tuple[Annotated[int, Field(ge=1)] | Line, ...], Field(strict=False)] = ()
    plant: Line = "plant"
    recipe: Line | None = None
    offsets: dict[Line, OffsetTable] = Field(default_factory=dict)
    window: Hours = ""
    permit: str = ""
    at_once: Annotated[int, Field(ge=1, le=1000)] = 20
    auto: bool = False
    expected_refusals: Annotated[float, Field(ge=0.001, le=0.5)] = 0.03
