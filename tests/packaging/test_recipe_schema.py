"""The schema for editors is the one that the loader uses, and the page explains all of it."""

import json
import re
from pathlib import Path

import pytest

from robolink.methods import all_methods
from robolink.methods.page import method_page
from robolink.recipe import json_schema, method_table
from robolink.recipe.page import recipe_page

ROOT = Path(__file__).parents[2]
SHIPPED = ROOT / "docs" / "recipe.schema.json"
PAGE = ROOT / "docs" / "recipe-keys.md"
AGAIN = (
    'run: python -c "import json, robolink.recipe as r; print(json.dumps(r.json_schema(), '
    'indent=2))" > docs/recipe.schema.json'
)
LATER_THAN_DRAFT_4 = {"const", "$defs", "exclusiveMinimum", "if", "contains", "propertyNames"}
HEADINGS = {
    "Recipe": "The top of the file",
    "BeamLine": "`[[source.beams]]`",
    "StationTable": "`[station]`",
    "Poses": "`[poses]`",
    "FlangePose": "A pose",
    "Tool": "`[[tools]]`",
    "PoseFile": "`[tools.poses]`",
    "Speeds": "`[speeds]`",
    "Box": "`[box]`",
    "Tolerances": "`[tolerances]`",
    "AccuracyTable": "`[accuracy]`",
    "RefusalTable": "`[refusal]`",
    "Prompt": "`[[prompts]]`",
    "Output": "`[[outputs]]`",
}


def tables(schema):
    return {"Recipe": schema, **schema["definitions"]}


def spelled(value, *, required):
    """Yield the page's required words about a key: required, its default, its limits."""
    if required:
        yield "required"
    for number in (value.get("default"), value.get("minimum"), value.get("maximum")):
        if isinstance(number, (int, float)) and not isinstance(number, bool):
            yield f"{number:g}"
    for name in ("minItems", "maxItems", "maxLength"):
        if name in value:
            yield str(value[name])
    yield from (f'"{word}"' for word in value.get("enum", ()))


def test_the_shipped_schema_is_not_stale():
    assert json.loads(SHIPPED.read_text(encoding="utf-8")) == json_schema(), AGAIN


def test_only_keywords_of_draft_4_are_used():
    def keywords(node):
        if isinstance(node, list):
            return set().union(*map(keywords, node))
        if not isinstance(node, dict):
            return set()
        inner = [keywords(value) for value in node.values()]
        return set(node).union(*inner)

    assert keywords(json_schema()) & LATER_THAN_DRAFT_4 == set()


def test_every_key_is_described_to_the_editor():
    schema = json_schema()
    for name, table in tables(schema).items():
        assert table["additionalProperties"] is False
        for key, value in table["properties"].items():
            assert "$ref" in value or value.get("description"), f"{name}.{key}"


def test_no_key_allows_null_which_toml_does_not_have():
    assert "null" not in json.dumps(json_schema())


@pytest.mark.parametrize("table", HEADINGS)
def test_the_page_explains_every_key_with_its_default_and_limits(table):
    _, heading, rest = PAGE.read_text(encoding="utf-8").partition(f"\n## {HEADINGS[table]}\n")
    assert heading
    rows = dict(re.findall(r"^\| `(\w+)` \| (.*)$", rest.partition("\n#")[0], re.M))
    schema = tables(json_schema())[table]
    assert rows.keys() >= schema["properties"].keys()
    for key, value in schema["properties"].items():
        for words in spelled(value, required=key in schema.get("required", ())):
            assert re.search(rf"(?<![\w.]){re.escape(words)}(?![\w.])", rows[key]), (key, words)


def test_the_page_of_the_keys_is_not_stale():
    again = "run: python -m robolink.recipe.page > docs/recipe-keys.md"
    assert PAGE.read_text(encoding="utf-8") == recipe_page(), again


def test_every_table_has_its_place_on_the_page():
    of_methods = {method_table(method).__name__ for method in all_methods()}
    assert HEADINGS.keys() | of_methods == tables(json_schema()).keys()


def test_the_page_of_the_methods_is_not_stale():
    shipped = (ROOT / "docs" / "methods.md").read_text(encoding="utf-8")
    assert shipped == method_page(), "run: python -m robolink.methods.page > docs/methods.md"


@pytest.mark.parametrize("method", all_methods(), ids=lambda method: method.name)
def test_the_page_of_the_methods_shows_every_key_with_its_limits(method):
    _, _, rest = method_page().partition(f"\n## `{method.name}`\n")
    lines = rest.partition("\n## ")[0]
    schema = tables(json_schema())[method_table(method).__name__]
    for key, value in schema["properties"].items():
        if key == "kind":
            continue
        (row,) = (line for line in lines.splitlines() if f"| `{key}` |" in line)
        for words in spelled(value, required=False):
            assert re.search(rf"(?<![\w.]){re.escape(words)}(?![\w.])", row), (key, words)


@pytest.mark.parametrize(
    "path", sorted((ROOT / "examples" / "recipes").iterdir()), ids=lambda path: path.stem
)
def test_every_example_leads_an_editor_to_the_schema(path):
    first = path.read_text(encoding="utf-8").splitlines()[0]
    directive, _, where = first.partition(" ")
    assert directive == "#:schema"
    assert (path.parent / where).resolve() == SHIPPED
