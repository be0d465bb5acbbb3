"""The whole recipe. Imported when one is loaded, for pydantic."""

from dataclasses import replace
from typing import Annotated, Any, Literal, TypeVar

from pydantic import ConfigDict, Field, ValidationInfo, field_validator
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from robolink.methods import MethodParameters, fields_of, method_names
from robolink.recipe._tables import (
    AccuracyTable,
    AnyKind,
    Box,
    Line,
    MethodTable,
    Note,
    Output,
    Poses,
    Prompt,
    RefusalTable,
    Speeds,
    StationTable,
    Table,
    Tolerances,
    Tool,
)

Basis = Literal["difference", "absolute"]
HeightRule = Literal["measured", "typed", "kept"]
T = TypeVar("T")


class Recipe(Table):
    """A nozzle change: the integrator writes it once, the person who changes nozzles runs it."""

    model_config = ConfigDict(validate_default=True)

    format: Annotated[Literal["robolink/recipe/1"], Field(alias="schema")]
    """Format of the file and its version."""
    name: Line
    """Name of the recipe for people. Everything that the recipe does is recorded with it."""
    notes: Note = ""
    """Notes for people."""
    cells: Annotated[tuple[Line, ...], Field(strict=False)] = ()
    """Names of the cells for which the recipe is meant; without names, any cell. At another cell
    robolink neither offers nor runs the recipe, because its poses would lead elsewhere."""
    numbers: Literal["simulated"] | None = None
    """In a copy of a recipe that comes with robolink this is "simulated": the recipe runs only on
    simulated controllers. Enter the stations, poses, box and limits of your cell, then delete the
    line."""
    basis: Basis
    """Value that robolink writes. "difference": the stored offset, shifted by the difference
    between the new tip and the reference of the same tool at the same station. "absolute": the
    measured offset."""
    z: HeightRule
    """Source of the offset's Z: "measured" by the touch, "typed" by the person each time, or
    "kept"."""
    verify: bool | None = None
    """Whether the robot makes the turn test after the write. A robot that moves at all makes the
    test unless this is false."""
    source: Annotated[MethodTable, AnyKind()]
    """Method of measurement, and its parameters."""
    station: StationTable
    """Place where the tools are measured."""
    poses: Poses = Field(default_factory=Poses)
    """Poses of the whole change."""
    tools: Annotated[tuple[Tool, ...], Field(strict=False, min_length=1)]
    """Tools, in the order in which they are measured. robolink writes all of them or none."""
    speeds: Speeds = Field(default_factory=Speeds)
    """Speeds of the robot, in Power Low."""
    box: Box = Field(default_factory=Box)
    """Largest distance of the flange from its position at the start of the recipe."""
    tolerances: Tolerances = Field(default_factory=Tolerances)
    """Acceptance limits."""
    accuracy: AccuracyTable = Field(default_factory=AccuracyTable)
    """Known sizes of errors that no measurement shows by itself."""
    refusal: RefusalTable = Field(default_factory=RefusalTable)
    """Action after a refused measurement."""
    prompts: Annotated[tuple[Prompt, ...], Field(strict=False)] = ()
    """Questions to a person, in this order."""
    outputs: Annotated[tuple[Output, ...], Field(strict=False)] = ()
    """Outputs that robolink switches, in this order."""

    @property
    def verifies(self) -> bool:
        """Whether the new tips get a turn test."""
        return self.source.of_method.needs.motion and self.verify is not False

    @property
    def parameters(self) -> MethodParameters:
        """The parameters of its method, with the values from the top of the recipe."""
        parameters = self.source.parameters
        for one in fields_of(type(parameters)):
            if one.option.from_recipe:
                value = getattr(self, one.option.from_recipe)
                parameters = replace(parameters, **{one.name: value})
        return parameters

    def is_for(self, cell: str) -> bool:
        """Return whether it may be run at a cell; ``""`` stands for one that has no name."""
        return not self.cells or cell in self.cells

    @property
    def attempts(self) -> int:
        """How often a tool is measured before a refusal ends the change."""
        return 1 if self.refusal.action == "stop" else self.refusal.attempts or 2

    @field_validator("*")
    @classmethod
    def _hand_on(cls, value: T, info: ValidationInfo) -> T:
        """Pass on what is right by itself: how it goes with the rest is checked in any case."""
        if isinstance(info.context, dict):
            info.context[info.field_name] = value
        return value


_made_for: tuple[str, ...] = method_names()


def recipe_of_all_methods() -> type[Recipe]:
    """Return the recipe, rebuilt if the set of methods has changed."""
    global _made_for  # noqa: PLW0603 - one registry of methods, one recipe
    if method_names() != _made_for:
        Recipe.model_rebuild(force=True)
        _made_for = method_names()
    return Recipe


class _ForToml(GenerateJsonSchema):
    def nullable_schema(self, schema: core_schema.NullableSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        if schema.get("default") is None:
            return self.generate_inner(schema["schema"])
        return super().default_schema(schema)

    def literal_schema(self, schema: core_schema.LiteralSchema) -> JsonSchemaValue:
        generated = super().literal_schema(schema)
        if "const" in generated:
            generated["enum"] = [generated.pop("const")]
        return generated

    def field_title_should_be_set(self, schema: Any) -> bool:  # noqa: ANN401, ARG002 - pydantic's
        return False


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a recipe: keys, types, units and limits.

    How the tables go together is beyond a schema; :func:`check_recipe` looks at that.
    """
    generated = recipe_of_all_methods().model_json_schema(
        ref_template="#/definitions/{model}", schema_generator=_ForToml
    )
    return {
        "$schema": "http://json-schema.org/draft-04/schema#",
        **{key: value for key, value in generated.items() if key != "$defs"},
        "definitions": generated["$defs"],
    }
