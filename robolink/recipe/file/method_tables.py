"""The table ``[source]`` of a recipe: one for each method, made from its declaration."""

import dataclasses
import functools
from typing import Annotated, Any, ClassVar, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, create_model
from pydantic_core import CoreSchema

from robolink.methods import AnyMethod, Help, MethodParameters, Unit, all_methods, fields_of
from robolink.methods.parameter_checks import ParameterField as Parameter
from robolink.methods.parameter_checks import bare
from robolink.recipe.file.tables import Table

_DESCRIBED = ConfigDict(use_attribute_docstrings=False)
"""Their keys bring their sentences: pydantic need not look through every module for a source."""


class MethodTable(Table):
    """What the tables of all methods have in common."""

    model_config = _DESCRIBED

    of_method: ClassVar[AnyMethod]

    kind: str
    """The method."""

    @property
    def parameters(self) -> MethodParameters:
        """The parameters of the method."""
        made: MethodParameters = self.of_method.parameters(
            **{
                one.name: _plain(getattr(self, one.name))
                for one in fields_of(self.of_method.parameters)
                if one.in_recipe
            }
        )
        return made


class _Line(Table):
    """A table inside of one, such as a light beam."""

    model_config = _DESCRIBED

    of_class: ClassVar[type[Any]]


class AnyKind:
    """Stands for the table of whatever method ``kind`` names."""

    def __get_pydantic_core_schema__(
        self, _source: object, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Return the union of the tables of all methods that there are now."""
        tables = tuple(map(method_table, all_methods()))
        return handler.generate_schema(
            Annotated[Union[tables], Field(discriminator="kind")]  # noqa: UP007 - made at run time
        )


_tables: dict[str, type[MethodTable]] = {}
_lines: dict[type[Any], type[_Line]] = {}


def method_table(method: AnyMethod) -> type[MethodTable]:
    """Return the table of a method."""
    made = _tables.get(method.name)
    if made is None or made.of_method is not method:
        made = _tables[method.name] = _made_of(method)
    return made


def _made_of(method: AnyMethod) -> type[MethodTable]:
    keys: dict[str, Any] = {
        one.name: (_annotation(one), _default(one))
        for one in fields_of(method.parameters)
        if one.in_recipe
    }
    name = "".join(part.title() for part in method.name.split("-"))
    made = create_model(
        f"{name}Source",
        __base__=MethodTable,
        __doc__=method.summary,
        **{"kind": (Literal[method.name], Field(description=method.summary)), **keys},
    )
    made.of_method = method
    return made


def _default(one: Parameter) -> Any:  # noqa: ANN401 - pydantic's own form
    meaning = f"{one.help} [{one.unit}]" if one.unit else one.help
    return Field(... if one.required else one.default, description=meaning)


def _annotation(one: Parameter) -> Any:  # noqa: ANN401 - a type
    made = _typed(one.kind, one.metadata)
    return made if one.required or one.default is not None else made | None


def _typed(kind: Any, limits: tuple[object, ...]) -> Any:  # noqa: ANN401 - types
    """Return a type with its limits, for pydantic; a list in TOML is a tuple here."""
    limits = tuple(limit for limit in limits if not isinstance(limit, (Help, Unit)))
    if get_origin(kind) is tuple:
        inner, *more = get_args(kind)
        if more != [Ellipsis]:
            limits = (*limits, Field(min_length=len(more) + 1, max_length=len(more) + 1))
        element = _typed(*bare(inner))
        kind, limits = tuple[element, ...], (Field(strict=False), *limits)  # type: ignore[valid-type]
    elif isinstance(kind, type) and dataclasses.is_dataclass(kind):
        kind = _line(kind)
    return functools.reduce(lambda made, limit: Annotated[made, limit], limits, kind)


def _line(kind: type[Any]) -> type[_Line]:
    if kind in _lines:
        return _lines[kind]
    keys: dict[str, Any] = {one.name: (_annotation(one), _default(one)) for one in fields_of(kind)}
    made = create_model(kind.__name__, __base__=_Line, __doc__=kind.__doc__, **keys)
    made.of_class = kind
    _lines[kind] = made
    return made


def _plain(value: object) -> object:
    """Return a value of a table as the parameters hold it."""
    if isinstance(value, tuple):
        return tuple(map(_plain, value))
    if isinstance(value, _Line):
        return value.of_class(
            **{name: _plain(getattr(value, name)) for name in type(value).model_fields}
        )
    assert not isinstance(value, BaseModel)  # noqa: S101 - there are no other tables inside
    return value
