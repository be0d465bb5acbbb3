"""The schemas of what acts answer, made from the dataclasses that describe it."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from inspect import cleandoc
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, Union, cast, get_args, get_origin, get_type_hints

from robolink_simulators.control.acts.answers import LEFT_OUT, Described

_PLAIN: Final = {bool: "boolean", int: "integer", float: "number", str: "string", NoneType: "null"}
_SECTION: Final = re.compile(r"\n\n(?=\w+:\n)")
_ATTRIBUTE: Final = re.compile(r"^    (?! )([\w, ]+): ((?:.|\n {8})+)", re.MULTILINE)


class AnswerSchemas:
    """Collects the schemas, one for each dataclass.

    Attributes:
        named: Those that were needed so far, by name.
    """

    def __init__(self) -> None:
        self.named: dict[str, Any] = {}

    def of(self, described: Described) -> dict[str, Any]:
        """Return the schema of a type; that of a dataclass is referred to.

        Raises:
            TypeError: It is none that JSON is made of.
        """
        if described in _PLAIN:
            return {"type": _PLAIN[described]}
        if is_dataclass(described):
            return self._referred(described)
        parts, origin = get_args(described), cast("object", get_origin(described))
        match origin:
            case _ if origin is Literal:
                return {"type": "string", "enum": list(parts)}
            case _ if origin in (Union, UnionType):
                return self._one_of(parts)
            case _ if origin is tuple:
                schema: dict[str, Any] = {"type": "array", "items": self.of(parts[0])}
                if parts[-1] is not Ellipsis:
                    schema |= {"minItems": len(parts), "maxItems": len(parts)}
                return schema
            case _ if origin is Mapping:
                return {"type": "object", "additionalProperties": self.of(parts[1])}
            case _:
                raise TypeError(described)

    def _one_of(self, parts: tuple[Any, ...]) -> dict[str, Any]:
        schemas = [self.of(part) for part in parts]
        if all(schema.keys() == {"type"} for schema in schemas):
            return {"type": [schema["type"] for schema in schemas]}
        return {"oneOf": schemas}

    def _referred(self, described: Any) -> dict[str, Any]:  # noqa: ANN401 - a dataclass
        name = described.__name__
        if name not in self.named:
            self.named[name] = {}  # so that one that holds its own kind would end
            says, about = _told(described)
            hints = get_type_hints(described, include_extras=True)
            properties, needed = {}, []
            for field in fields(described):
                hint = hints[field.name]
                if get_origin(hint) is Annotated and LEFT_OUT in get_args(hint):
                    hint = get_args(hint)[0]
                else:
                    needed.append(field.name)
                said = {"description": about[field.name]} if field.name in about else {}
                properties[field.name] = {**self.of(hint), **said}
            self.named[name] = {
                "description": says,
                "type": "object",
                "properties": properties,
                "required": needed,
            }
        return {"$ref": f"#/components/schemas/{name}"}


def _told(described: type) -> tuple[str, dict[str, str]]:
    """Return what the docstring of a dataclass says of it and of its attributes."""
    first, *sections = _SECTION.split(cleandoc(described.__doc__ or ""))
    section = next((it for it in sections if it.startswith("Attributes:")), "")
    return " ".join(first.partition("\n\n")[0].split()), dict(_attributes(section))


def _attributes(section: str) -> Iterator[tuple[str, str]]:
    for names, says in _ATTRIBUTE.findall(section):
        for name in names.split(", "):
            yield name, " ".join(says.split()).replace("``None``", "null")
