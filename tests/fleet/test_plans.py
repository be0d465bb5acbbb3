"""Plan files: what is frozen, and every problem told."""

import json
import re
from pathlib import Path

import pytest

from robolink.errors import ConfigError
from robolink.fleet import Plan, PlanError, PlanKind, load_plan, plan_of
from robolink.fleet.plan_tables import PlanFile

ROOT = Path(__file__).parents[2]
CELLS = ("line3-a", "line3-b", "line3-c", "line4-a", "line4-b", "press", "old press")
HEAD = {"schema": "robolink/fleet-plan/1", "kind": "check", "name": "nightly"}


def made(**keys):
    return plan_of({**HEAD, **keys}, cells=CELLS[:6], author="Li", made_at="2026-11-30")


def refused(**keys):
    with pytest.raises(ConfigError) as error:
        made(**keys)
    return str(error.value)


def test_cells_are_named_by_names_and_patterns_each_once():
    assert made(cells=["press", "line3-*", "line*"]).cells == (
        *("press", "line3-a", "line3-b", "line3-c", "line4-a", "line4-b"),
    )


def test_cells_are_named_by_groups():
    table = {**HEAD, "cells": ["@south"]}
    groups = {"south": ["line4-*", "press"]}
    assert plan_of(table, cells=CELLS, groups=groups).cells == ("line4-a", "line4-b", "press")


def test_what_only_reads_has_one_ring_and_what_writes_grows_from_one_cell():
    assert made(cells=["*"]).sizes == (6,)
    offsets = {cell: {"tool": 1, "x_mm": 1.0} for cell in CELLS[:6]}
    assert made(kind="offset", cells=["*"], offsets=offsets).sizes == (1, 4, 1)


def test_rings_are_counts_patterns_and_the_rest():
    plan = made(cells=["*"], rings=[1, "line4-*", "rest"])
    assert plan.rings == (
        ("line3-a",),
        ("line4-a", "line4-b"),
        ("line3-b", "line3-c", "press"),
    )


def test_rings_without_cells_are_left_out():
    assert made(cells=["press"], rings=[1, 4, "rest"]).rings == (("press",),)


def test_the_id_is_made_from_all_of_the_plan():
    one, other = made(cells=["press"]), made(cells=["press"], window="22:00-05:00")
    assert one == made(cells=["press"])
    assert one.id != other.id
    assert len(one.id) == 12
    assert one.order("press") == f"{one.id}/press"


def test_a_document_that_was_changed_is_refused():
    plan = made(cells=["press"], window="22:00-05:00")
    document = json.loads(json.dumps(plan.document()))
    assert Plan.from_document(document) == plan
    with pytest.raises(PlanError, match="was changed after it was made"):
        Plan.from_document({**document, "window": ""})


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"cells": ["line9-*"]}, "No cell has a name like 'line9-*'"),
        ({"cells": ["@north"]}, "There is no group 'north'"),
        ({"cells": []}, "cells: must hold at least 1"),
        ({"cells": ["press"], "kind": "dance"}, 'kind: must be one of "backup"'),
        ({"cells": ["press"], "ringe": [1]}, "ringe: is not known; did you mean rings?"),
        ({"cells": ["*"], "rings": [1, 4]}, 'leave 1 cells out; end with "rest"'),
        ({"cells": ["*"], "rings": [0]}, "rings.1"),
        ({"cells": ["*"], "rings": ["line9-*"]}, "rings.1: No cell has a name like 'line9-*'"),
        ({"cells": ["press"], "window": "22-5"}, "two times of day"),
        ({"cells": ["press"], "window": "22:00-22:00"}, "two times of day"),
        ({"cells": ["press"], "kind": "recipe"}, "recipe: is missing"),
        ({"cells": ["press"], "recipe": "a.toml"}, "does not go with the kind check"),
        ({"cells": ["press"], "kind": "offset"}, "offsets.press: is missing"),
        (
            {"cells": ["press"], "offsets": {"press": {"tool": 1, "x_mm": 1.0}}},
            "offsets.press: is no cell of this plan",
        ),
        (
            {"cells": ["press"], "kind": "offset", "offsets": {"press": {"tool": 1}}},
            "has no component to write",
        ),
        ({"cells": ["press"], "expected_refusals": 0.0}, "expected_refusals: must be at least"),
        ({"cells": ["press"], "at_once": 0}, "at_once: must be at least 1"),
    ],
)
def test_every_problem_is_told_by_its_key(keys, words):
    assert words in refused(**keys)


def test_a_name_that_no_order_can_have_is_refused():
    with pytest.raises(ConfigError, match="is not the id of an order"):
        plan_of({**HEAD, "cells": ["*"]}, cells=["c" * 52])


def test_all_problems_are_told_at_once():
    said = refused(cells=["nowhere", "@nobody"], kind="recipe")
    assert "3 errors" in said


def test_the_file_of_the_page_is_right_as_it_stands_there(tmp_path):
    page = (ROOT / "docs" / "fleet.md").read_text(encoding="utf-8")
    _, _, rest = page.partition("```toml\n")
    (tmp_path / "plan.toml").write_text(rest.partition("```")[0], encoding="utf-8")
    recipe = ROOT / "examples" / "recipes" / "scara-pin.toml"
    (tmp_path / "needle.toml").write_bytes(recipe.read_bytes())
    cells = [f"line3-{name}" for name in "abcdefg"] + ["line4-a"]
    plan = load_plan(tmp_path / "plan.toml", cells=cells)
    assert plan.sizes == (1, 4, 2, 1)
    assert set(PlanFile.model_fields) - {"format"} == keys_told(page)


def keys_told(page: str) -> set[str]:
    """Return the keys that the page explains."""
    table = page.partition("| key | meaning |")[2].partition("\n\n")[0]
    return {word.split(".")[0] for word in re.findall(r"^\| `\[?([a-z_]+)", table, re.M)} | {
        "cells"
    }


def test_a_recipe_is_frozen_by_its_hash(tmp_path):
    recipe = tmp_path / "needle.toml"
    recipe.write_bytes((ROOT / "examples" / "recipes" / "scara-pin.toml").read_bytes())
    file = tmp_path / "plan.toml"
    file.write_text(
        'schema = "robolink/fleet-plan/1"\nkind = "recipe"\nname = "n"\ncells = ["press"]\n'
        'recipe = "needle.toml"\n'
    )
    plan = load_plan(file, cells=CELLS[:6])
    assert plan.kind is PlanKind.RECIPE
    plan.require_recipe()
    with recipe.open("a") as more:
        more.write("# a word more\n")
    with pytest.raises(PlanError, match="is not the one of plan"):
        plan.require_recipe()
