"""Whatever stands in a file, ``solve`` answers, refuses or names the slip; it never breaks."""

import json
import math
import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from robolink_cli import main
from robolink_cli.commands.measure.solve.answer import METHODS

ODD: st.SearchStrategy[object] = st.sampled_from(
    [0, -1, 1, 2.5, 1e-9, 1e9, 1e11, 1e308, -0.0, True, None, "x", "", [], {}]
)
NUMBERS = st.one_of(ODD, st.floats(-400, 400), st.integers(-400, 400))
ANGLES = st.one_of(st.sampled_from([0, 90, 180, -90, 45, 360]), NUMBERS)
POSES = st.fixed_dictionaries(
    {"x": NUMBERS, "y": NUMBERS, "u": ANGLES},
    optional={
        "z": NUMBERS,
        "v": ANGLES,
        "w": ANGLES,
        "qs": NUMBERS,
        "tool": st.sampled_from([0, 1, 3, "1"]),
        "local": st.sampled_from([0, 2, -1]),
    },
)
PLACES = st.fixed_dictionaries({"x": NUMBERS, "y": NUMBERS}, optional={"z": NUMBERS})
SOUND = st.builds(
    lambda x, y, z, u, v, w: {"x": 300 + x, "y": y, "z": z, "u": u, "v": v, "w": w},
    *[st.integers(-20, 20)] * 3,
    *[st.sampled_from([0, 90, 180, -45])] * 2,
    st.sampled_from([0, 30, 180]),
)
"""A pose that a robot could take: lists of them reach the mathematics."""

VALUES = st.one_of(
    *(NUMBERS, POSES, PLACES),
    *(st.lists(POSES, max_size=9), st.lists(SOUND, max_size=9), st.lists(NUMBERS, max_size=5)),
)
ROWS = st.dictionaries(
    st.sampled_from(
        ["name", "u_mm", "u_deg", "lever_mm", "half_width_mm", "distribution", "dof", "alpha_per_K"]
    ),
    st.one_of(NUMBERS, st.just("rectangular")),
)
NAMES = (
    *("poses", "tools", "locals", "sigma_mm", "jog_grid_mm", "inlier_threshold", "seeds", "seed"),
    *("robot", "stored", "live", "min_delta_u_deg", "rows", "probability", "flange", "tip", "pin"),
)


def named(name: str) -> st.SearchStrategy[object]:
    known = {
        "poses": st.one_of(st.lists(SOUND, min_size=2, max_size=12), st.lists(POSES, max_size=4)),
        "rows": st.lists(ROWS, max_size=3),
        "tools": st.dictionaries(st.sampled_from(["1", "3", "x"]), PLACES, max_size=2),
        "locals": st.dictionaries(st.sampled_from(["2", ""]), PLACES, max_size=2),
        "robot": st.dictionaries(st.sampled_from(["reach_mm", "inner_mm", "kind"]), NUMBERS),
        "stored": PLACES,
        "live": POSES,
    }
    return st.one_of(known.get(name, VALUES), VALUES)


INPUTS = st.sets(st.sampled_from(NAMES), max_size=5).flatmap(
    lambda names: st.fixed_dictionaries({name: named(name) for name in sorted({*names, "poses"})})
)
CASES = st.fixed_dictionaries(
    {"method": st.sampled_from([*METHODS, "nothing"]), "input": st.one_of(INPUTS, ODD)}
)


def all_finite(value: object) -> bool:
    if isinstance(value, dict):
        return all(map(all_finite, value.values()))
    if isinstance(value, list):
        return all(map(all_finite, value))
    return not isinstance(value, float) or math.isfinite(value)


FILES = st.lists(CASES, min_size=1, max_size=6)
A_FEW = settings(
    max_examples=20,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)


@A_FEW
@given(FILES)
def test_any_file_is_answered(capsys, cases):
    check_answered(capsys, cases)


@pytest.mark.soak
@pytest.mark.timeout(600)
@settings(A_FEW, max_examples=1000)
@given(FILES)
def test_any_of_many_files_is_answered(capsys, cases):
    check_answered(capsys, cases)


def check_answered(capsys, cases):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "case.json"
        path.write_text(json.dumps({"vectors": cases}))
        code = main.run(["solve", str(path), "--json"])
        shown = json.loads(capsys.readouterr().out)
        assert code in (0, 7), shown
        assert len(shown["results"]) == len(cases)
        assert all_finite(shown)
        assert main.run(["solve", str(path)]) == code
        capsys.readouterr()
