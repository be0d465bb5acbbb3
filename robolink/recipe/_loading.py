"""From a file to a recipe, or to all its errors."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from robolink.files.key_problems import is_not_known, one_of, sentence
from robolink.files.toml import FileKind, Problem
from robolink.messages import tr
from robolink.methods import AnyMethod, Former, all_methods, method_names
from robolink.model import method_name_now
from robolink.recipe._checks import Draft, problems_together
from robolink.recipe._recipe import Recipe, json_schema, recipe_of_all_methods


def with_names_of_now(document: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return a recipe with the present names, and the warnings about former ones.

    What is no name of before is left for the checks to find.
    """
    source = document.get("source")
    if not isinstance(source, Mapping):
        return dict(document), ()
    if source.get("kind") == "points":
        now, notes = _points(source)
    else:
        now, notes = _kind(source)
    return {**document, "source": now}, notes


def _points(source: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    method = source.get("method")
    if not isinstance(method, str) or method_name_now(method) == method:
        return dict(source), ()
    now = method_name_now(method)
    return {**source, "method": now}, (_note("method", method, now),)


def _kind(source: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    found = next(_meant(source), None)
    if found is None:
        return dict(source), ()
    method, former = found
    now = {key: value for key, value in source.items() if not former.method or key != "method"}
    return {**now, "kind": method.name}, (_note("kind", former.kind, method.name),)


def _meant(source: Mapping[str, Any]) -> Iterator[tuple[AnyMethod, Former]]:
    for method in all_methods():
        for former in method.formerly:
            if former.kind == source.get("kind") and (
                not former.method
                or source.get("method", former.method if former.usual else None) == former.method
            ):
                yield method, former


def _note(key: str, before: str, now: str) -> str:
    return tr(
        'source.{key}: "{before}" is an old name, which the next version does not know; write '
        '{key} = "{now}".',
        key=key,
        before=before,
        now=now,
    )


@cache
def _known_schema(_methods: tuple[str, ...]) -> dict[str, Any]:
    """Return the schema, only to be read; making it takes longer than checking a recipe."""
    return json_schema()


def problems_of(error: ValidationError) -> list[Problem]:
    """Return everything that pydantic reports."""
    schema = _known_schema(method_names())
    details = error.errors(include_url=False, include_input=False)
    return [_problem(detail, schema) for detail in details if not _follows(detail, details)]


@dataclass(frozen=True, slots=True)
class _Place:
    """A place in a recipe.

    Attributes:
        path: Path of the key.
        key: The key itself.
        table: The keys that are known beside it.
    """

    path: str
    key: str
    table: tuple[str, ...]

    @classmethod
    def of(cls, location: Sequence[int | str], schema: dict[str, Any]) -> "_Place":
        """Follow pydantic's location through the schema.

        A kind of source stands in the location, too, and in no path.
        """
        path, key, table, node = "", "", (), schema
        for step in location:
            node = _resolved(node, schema)
            if isinstance(step, int):
                path, node = f"{path}#{step + 1}", node["items"]
            elif "discriminator" in node:
                node = {"$ref": node["discriminator"]["mapping"][step]}
            else:
                key, table = step, tuple(node["properties"])
                path, node = f"{path}.{key}" if path else key, node["properties"].get(key, {})
        return cls(path, key, table)


def _resolved(node: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    reference: str = node.get("$ref", "")
    named: dict[str, Any] = schema["definitions"].get(reference.rpartition("/")[2], node)
    return named


def _follows(detail: Any, details: Sequence[Any]) -> bool:  # noqa: ANN401 - pydantic's own form
    """Return whether a list is reported as too short only because its content is wrong."""
    place = detail["loc"]
    return detail["type"] == "too_short" and any(
        len(other["loc"]) > len(place) and other["loc"][: len(place)] == place for other in details
    )


def _problem(detail: Any, schema: dict[str, Any]) -> Problem:  # noqa: ANN401 - pydantic's own form
    place = _Place.of(detail["loc"], schema)
    match detail["type"]:
        case "extra_forbidden":
            return Problem(place.path, _unknown(place, tuple(schema["properties"])))
        case "missing":
            return Problem(place.path, _missing(place.key))
        case "union_tag_invalid" | "union_tag_not_found":
            kinds = schema["properties"][place.key]["discriminator"]["mapping"]
            return Problem(f"{place.path}.kind", one_of(kinds))
        case "string_pattern_mismatch":
            said = tr("must not hold control characters or, except in notes, line breaks")
            return Problem(place.path, said)
    return Problem(place.path, sentence(detail))


def _unknown(place: _Place, top: Sequence[str]) -> str:
    """Return the sentence for a key that does not exist in its place.

    Args:
        place: Where it stands.
        top: The keys that are known at the top of the file.
    """
    if place.key in top:
        return tr("must be at the top of the file, above the first line with a [table]")
    return is_not_known(place.key, place.table)


def _missing(key: str) -> str:
    """Return the sentence for a required key."""
    match key:
        case "basis":
            return tr(
                'is missing: write "difference" where taught points have to stay right, else '
                '"absolute"'
            )
        case "z":
            return tr(
                'is missing: write "kept" (as long as before), "typed" (a person enters it) or '
                '"measured"'
            )
        case "tools":
            return tr("is missing: write one [[tools]] table for each tool")
        case "schema":
            return tr('is missing: begin the file with schema = "robolink/recipe/1"')
    return tr("is missing")


RECIPE_FILE: Final = FileKind(
    named=lambda path: tr("The recipe {path}", path=path),
    unreadable_remedy=lambda: tr(
        "Nothing was sent. Give a recipe file; docs/recipes.md shows one."
    ),
    wrong_remedy=lambda: tr("Nothing was sent. Correct it; docs/recipes.md explains every key."),
)


@dataclass(frozen=True, slots=True)
class LoadedRecipe:
    """A correct recipe, and the file it came from.

    Attributes:
        recipe: What the file says.
        path: The file.
        sha256: Hash of the bytes that were read, hexadecimal; the journal keeps it, so that a
            change of the recipe shows.
        notes: What to tell whoever wrote it: former names, with those of now.
    """

    recipe: Recipe
    path: Path
    sha256: str
    notes: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """What people call the recipe."""
        return self.recipe.name


def load_recipe(path: Path) -> LoadedRecipe:
    """Return the recipe in a file.

    Raises:
        ConfigError: It cannot be read, is no TOML, or is wrong; every problem is told with
            its path.
    """
    content = RECIPE_FILE.read(path)
    document, notes = with_names_of_now(RECIPE_FILE.parse(path, content))
    recipe, problems = _checked(document)
    if recipe is None or problems:
        raise RECIPE_FILE.refusal(path, problems)
    return LoadedRecipe(recipe, path, hashlib.sha256(content).hexdigest(), notes)


def check_recipe(path: Path) -> tuple[Problem, ...]:
    """Return all errors in a recipe; none if it is right.

    Raises:
        ConfigError: It cannot be read, or is no TOML.
    """
    return _checked(RECIPE_FILE.parse(path, RECIPE_FILE.read(path)))[1]


def _checked(document: dict[str, object]) -> tuple[Recipe | None, tuple[Problem, ...]]:
    sound: dict[str, object] = {}
    recipe, problems = None, []
    document, _ = with_names_of_now(document)
    try:
        recipe = recipe_of_all_methods().model_validate(document, context=sound)
    except ValidationError as error:
        problems = problems_of(error)
    draft = Draft.of(sound, given=document)
    return recipe, (*problems, *problems_together(draft))
