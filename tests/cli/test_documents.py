"""Every document that a command prints has a published schema and fits it.

``pytest_runtest_teardown`` in ``tests/conftest.py`` checks the documents of all other tests in this
process, including the errors of every command (``test_refusals_of_every_command``). The tests here
check that none is missing, and the documents that no other test prints.
"""

import json
import re
from pathlib import Path

import pytest
from robolink_cli import main

from tests._documents import DOCUMENTS, FILE, PUBLISHED, key_of, wrong_in
from tests.cli.test_command_names import OF_ITS_OWN, command_at
from tests.cli.test_refusals_of_every_command import leaves

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "json.md"
SHOWN = {key: described for key, described in PUBLISHED.items() if "x-commands" in described}
PRINTS_NO_DOCUMENT = {"expert completion"}
GROUPS_THAT_SHOW = {"cell accuracy", "panel"}
BEHIND_AN_EMIT = re.compile(r'(?<!events\.)(?<!self\.)\bemit\(\s*"([a-z-]+)"')
WHOLE = re.compile(r'"robolink/([a-z-]+)/(\d+)')
READ_NOT_PRINTED = {"line-job-1", "line-token-1", "panel-tablet-1", "sim-cells-1"}


def commands():
    """Return every command that takes --json or --jsonl, old names included."""
    names = {*leaves(main.cli), *OF_ITS_OWN, *GROUPS_THAT_SHOW}
    speaking = {"--json", "--jsonl"}
    options = {name: {it for one in command_at(name).params for it in one.opts} for name in names}
    return {name for name in names if options[name] & speaking}


def schemas_of(described):
    """Return the schemas that each form of a document names."""
    return {one["properties"]["schema"]["const"] for one in described.get("oneOf", [described])}


def printed():
    """Return the documents that the sources of the commands print."""
    found = set[str]()
    for path in (ROOT / "cli").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        found |= {f"{name}-1" for name in BEHIND_AN_EMIT.findall(text)}
        found |= {f"{name}-{version}" for name, version in WHOLE.findall(text)}
    return found


def test_every_command_that_speaks_json_has_a_published_document():
    told = {name for one in SHOWN.values() for name in one["x-commands"]} - {"*"}
    assert commands() - told == PRINTS_NO_DOCUMENT & commands()
    assert told - commands() == set()


def test_every_document_that_a_source_names_is_published_and_no_other():
    assert printed() - READ_NOT_PRINTED == set(SHOWN)


@pytest.mark.parametrize("key", SHOWN)
def test_a_document_names_its_schema_and_is_closed(key):
    described = SHOWN[key]
    assert {key_of(one) for one in schemas_of(described)} == {key}
    for one in described.get("oneOf", [described]):
        assert {"additionalProperties", "unevaluatedProperties"} & one.keys()
        assert "schema" in one["required"]


def test_the_whole_file_leads_to_each_document():
    whole = json.loads(FILE.read_text(encoding="utf-8"))
    assert whole["anyOf"] == [{"$ref": f"#/$defs/{key}"} for key in SHOWN]


def test_the_page_lists_every_document():
    rows = []
    for one in SHOWN.values():
        names = ["every command" if name == "*" else f"`{name}`" for name in one["x-commands"]]
        (schema,) = schemas_of(one)
        rows.append(f"| `{schema}` | {', '.join(names)} | {one['description']} |")
    page = PAGE.read_text(encoding="utf-8")
    assert [row for row in rows if row not in page] == []
    assert page.count("\n| `robolink/") == len(rows)


@pytest.mark.parametrize(
    ("spoilt", "wrong"),
    [
        ({"state": "ready", "more": 1}, "/more is not described"),
        ({"state": 1}, "/state is 1"),
        ({}, "/state is missing"),
    ],
)
def test_a_document_that_does_not_fit_is_found(spoilt, wrong):
    document = {"schema": "robolink/reset/1", **spoilt}
    assert any(wrong in found for found in wrong_in(document))
    DOCUMENTS.hear(json.dumps(document, indent=2))
    assert any(wrong in found for found in DOCUMENTS.wrong)
    DOCUMENTS.forgive()
    assert wrong_in({"schema": "robolink/nothing/1"}) == ["robolink/nothing/1 is not published"]


PLC = "softmotion+sim://documents?kinematics=Kin_Scara3_Z&seed=1"

MORE = {
    "execute-raw": ["expert", "execute-raw", "Print 1", "--yes"],
    "recipe-new": ["expert", "recipe", "new", "needle-beams", "own.toml"],
    "plc-export": ["expert", "plc", "export", "plc"],
    "tool-mode": ["-c", PLC, "tool", "get", "--mode", "set"],
    "group": ["-c", PLC, "enable", "--yes"],
    "ownership": ["-c", PLC, "robot", "take-ownership", "--yes"],
}
"""Documents that no other test of this process prints."""


@pytest.mark.parametrize("name", MORE)
def test_what_else_is_printed_fits(name, simulator, capsys):
    where = [] if MORE[name][0] == "-c" else ["-c", simulator.url]
    assert main.run([*where, *MORE[name], "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == f"robolink/{name}/1"
    assert wrong_in(document) == []


def test_an_export_fits(run):
    assert run("tool", "set", "1", "--x", "13", "--yes")[0] == 0
    assert run("journal", "export", "all.json")[0] == 0
    document = json.loads(Path("all.json").read_text(encoding="utf-8"))
    assert document["entries"]
    assert wrong_in(document) == []
