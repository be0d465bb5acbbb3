"""The JSON Schema of a recipe, for editors.

Editors that know TOML follow draft 4, so only keywords are used that mean the same in draft 4
and in later drafts. TOML has no null: what may be left out is simply not required.
"""

from typing import Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from robolink.recipe.file.recipe import recipe_of_all_methods


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
