"""A method declares its parameters once: commands and recipes accept and refuse the same values."""

import json
import subprocess
import sys
import tomllib
from typing import cast

import pytest
from annotated_types import Ge, Le
from click.testing import CliRunner
from robolink_cli import main
from robolink_cli.commands.measure.calibrate.method_command import command_of

from robolink.calibration_run import usual_box
from robolink.errors import ConfigError
from robolink.methods import Site, StatedLimits, all_methods, fields_of, source_of
from robolink.model import Controller
from robolink.recipe._loading import _checked
from robolink.stations import Station

NOBODY = "epson+tcp://127.0.0.1:9"
"""No controller is needed: the value is refused before anything is sent."""


def beyond(field):
    """Yield values just outside the limits of a parameter."""
    for limit in field.metadata:
        if isinstance(limit, Ge):
            yield limit.ge - 1  # type: ignore[operator]
        if isinstance(limit, Le):
            yield limit.le + 1  # type: ignore[operator]


LIMITS = [
    (method, field, value)
    for method in all_methods()
    for field in fields_of(method.parameters)
    if field.kind in (float, int)
    for value in beyond(field)
]


def in_turn():
    """Yield each limit of :data:`LIMITS`; what another method has too is left to soak.

    Each method keeps one.
    """
    seen, kept = set(), set()
    for method, field, value in LIMITS:
        new = (field.name, value) not in seen or method.name not in kept
        seen.add((field.name, value))
        kept.add(method.name)
        yield pytest.param(
            method,
            field,
            value,
            marks=() if new else pytest.mark.soak,
            id=f"{method.name} {field.name} {value:g}",
        )


RELATIONS = [
    ("two-pose", {"clearance_mm": 8.2}, "clearance_mm", "must be more than 1.8 below"),
    ("pivot", {"clearance_mm": 12}, "clearance_mm", "must be more than 1.8 below"),
    ("n-angle", {"off_in_contact": True}, "off_in_contact", "goes with"),
    ("z-touch", {"clearance_mm": 12, "input": 5}, "clearance_mm", "must be smaller than"),
    ("z-touch", {"speeds_mm_s": (2, 2), "input": 5}, "speeds_mm_s", "must differ by a factor"),
    ("z-touch", {"test_speeds_mm_s": (2, 3), "input": 5}, "test_speeds_mm_s", "must hold speeds"),
    ("z-touch", {"until_mm": 0.1, "input": 5}, "until_mm", "has nothing to leave out"),
    ("beams", {"search_mm": 6}, "aside_mm", "must be larger than"),
    (
        "beams",
        {"repeats": 1, "shaft_mm": 0, "retake": True},
        "retake",
        "has no effect: nothing is repeated",
    ),
    ("beams", {"until_mm": 0.1}, "until_mm", "has nothing to leave out"),
    ("n-angle", {"angles_deg": (0, 90, 90)}, "angles_deg", "must not hold the same angle"),
    ("n-angle", {"angles_deg": (0, 90, 180), "count": 4}, "count", "excludes"),
    ("camera", {"turns_deg": (0, 10)}, "turns_deg", "must spread over at least 30 degrees"),
    (
        "camera",
        {"turns_deg": (0, 40, 80), "test_turns_deg": (10, 89)},
        "test_turns_deg",
        "must hold an angle that is at least 90 degrees from one of",
    ),
    ("camera-affine", {"turns_deg": (0,)}, "turns_deg", "must spread over at least 30 degrees"),
    ("board", {"turns_deg": (0, 120)}, "fiducials_mm", "is missing: say where the fiducials"),
]


def method_of(name):
    (method,) = (method for method in all_methods() if method.name == name)
    return method


def typed(method, values):
    """Return the options of a command that correspond to keys of a recipe."""
    flags = {field.name: field.flag for field in fields_of(method.parameters)}
    for name, value in values.items():
        if value is True:
            yield flags[name]
        else:
            texts = [f"{number:g}" for number in (value if isinstance(value, tuple) else (value,))]
            yield f"{flags[name]}={','.join(texts)}"


def in_recipe(method, values, *tables):
    """Return the error for a recipe of that method."""
    z = "measured" if method.only_z else "kept"
    lines = [
        'schema = "robolink/recipe/1"',
        'name = "Needle"',
        'basis = "absolute"',
        f'z = "{z}"',
        "[station]",
        'id = "S"',
        "[source]",
        f'kind = "{method.name}"',
        *(f"{name} = {json.dumps(value)}" for name, value in values.items()),
        *tables,
        "[[tools]]",
        "number = 1",
    ]
    return {one.where: one.what for one in _checked(tomllib.loads("\n".join(lines)))[1]}


def refused(method, values, capsys, *more):
    """Return the error for a command of that method."""
    station = ("--station", "S") if method.needs.named else ()
    where = station if method.needs.motion else ("--points", "901,902")
    words = ("calibrate", method.name, "--tool", "1", *where, *typed(method, values), *more)
    assert main.run(["-c", NOBODY, *words]) == 2
    return " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(("method", "field", "value"), list(in_turn()))
def test_a_limit_is_refused_in_the_same_words_before_anything_is_sent(method, field, value, capsys):
    found = in_recipe(method, {field.name: value})[f"source.{field.name}"]
    said = refused(method, {field.name: value}, capsys)
    assert found in said
    assert field.flag in said


@pytest.mark.parametrize(
    ("name", "values", "where", "words"), RELATIONS, ids=[f"{r[0]} {r[2]}" for r in RELATIONS]
)
def test_what_does_not_go_together_is_refused_in_the_same_words(name, values, where, words, capsys):
    method = method_of(name)
    assert in_recipe(method, values)[f"source.{where}"].startswith(words)
    flags = {field.name: field.flag for field in fields_of(method.parameters)}
    assert f"{flags[where]}: {words}" in refused(method, values, capsys)


HALVES = {"board": {"spacing_mm": 40.0, "turns_deg": (0.0,)}, "camera": {"turns_deg": (0.0,)}}
HALVES |= {"z-touch": {"speeds_mm_s": (2.0, 1.0)}, "beams": {"repeats": 1, "shaft_mm": 0.0}}
"""A measurement with these leaves no residual; two-pose, points and one-touch never do."""

NO_RESIDUAL = ("two-pose", "one-touch", "points", *HALVES)
TYPED = {"rms_mm": "--max-rms", "max_mm": "--max-residual", "interval_mm": "--max-interval"}
UNKNOWN_SIGMA = "is missing: the measurement cannot check itself"


def of_the_library(method, values, **more):
    """Return the error for a script that asks for the source of measurements."""
    station = Station(id="S", kind=method.needs.station)
    site = Site(controller=cast(Controller, None), tool=1, station=station)
    with pytest.raises(ConfigError) as caught:
        source_of(method, method.parameters(**values), site, **more)
    return caught.value.what


@pytest.mark.parametrize(
    ("name", "limit"),
    # One touch may take its standard deviation from the calibration before.
    [(n, t) for n in NO_RESIDUAL for t in TYPED if (n, t) != ("one-touch", "interval_mm")],
)
def test_what_leaves_no_residual_is_judged_by_none_wherever_one_asks(name, limit, capsys):
    method, values = method_of(name), HALVES.get(name, {})
    where = "sigma_mm" if limit == "interval_mm" else limit
    what = in_recipe(method, values, "[tolerances]", f"{limit} = 0.1")[f"tolerances.{where}"]
    assert what.startswith(UNKNOWN_SIGMA if where == "sigma_mm" else "cannot be judged: ")
    option = {**TYPED, "sigma_mm": "--sigma"}[where]
    said = refused(method, values, capsys, TYPED[limit], "0.1")
    assert f"{option}: {what}." in said
    said = of_the_library(method, values, limits=StatedLimits(**{limit: 0.1}))
    assert f"{where}: {what}." in said


def test_an_interval_that_is_never_met_is_refused_in_the_same_words(capsys):
    method, tables = method_of("two-pose"), ("[tolerances]", "sigma_mm = 0.1", "interval_mm = 0.1")
    what = in_recipe(method, {}, *tables)["tolerances.interval_mm"]
    assert what.startswith("can never be met")
    typed_too = ("--sigma", "0.1", "--max-interval", "0.1")
    assert f"--max-interval: {what}." in refused(method, {}, capsys, *typed_too)
    limits = StatedLimits(sigma_mm=0.1, interval_mm=0.1)
    assert f"interval_mm: {what}." in of_the_library(method, {}, limits=limits)


def test_what_a_cell_allows_every_method_is_no_reason_to_refuse_one(tmp_path, monkeypatch, capsys):
    """A cell's limits apply to methods that can be judged by them; they were not typed here."""
    (tmp_path / "robolink.toml").write_text(
        f'[cells.a]\nurl = "{NOBODY}"\nrms_tolerance_mm = 0.1\n', encoding="utf-8"
    )
    monkeypatch.setenv("ROBOLINK_CONFIG", str(tmp_path / "robolink.toml"))
    code = main.run(["-c", "a", "calibrate", "two-pose", "--tool", "1", "--dry-run"])
    assert code == 3, capsys.readouterr().err


LIFTING = [
    method
    for method in all_methods()
    if "lift_mm" in {field.name for field in fields_of(method.parameters)}
]


@pytest.mark.parametrize("method", LIFTING, ids=lambda method: method.name)
def test_a_lift_that_the_box_has_no_room_for_is_refused_wherever_one_asks(method, capsys):
    values = {"lift_mm": 81.0, **({"spacing_mm": 40.0} if method.name == "board" else {})}
    what = in_recipe(method, values)["source.lift_mm"]
    assert what.startswith("must leave room: ")
    assert what.endswith("and the box is 80 mm high")
    assert f"--lift: {what}." in refused(method, values, capsys)
    assert f"lift_mm: {what}." in of_the_library(method, values, box=usual_box())


def test_a_limit_is_refused_in_the_same_words_to_a_script(capsys):
    method, values = method_of("two-pose"), {"turn_deg": 5}
    what = in_recipe(method, values)["source.turn_deg"]
    assert of_the_library(method, values) == f"turn_deg: {what}."


def test_a_turn_that_tells_nothing_is_refused_before_the_robot_has_moved(capsys):
    assert "must be at least 30" in refused(method_of("two-pose"), {"turn_deg": 5}, capsys)


@pytest.mark.parametrize("method", all_methods(), ids=lambda method: method.name)
def test_every_parameter_is_an_option_and_a_key(method):
    keys = {field.name for field in fields_of(method.parameters) if field.in_recipe}
    source = {"kind": method.name, **dict.fromkeys((*keys, "nothing"), "")}
    unknown = {
        p.where for p in _checked({"source": source})[1] if p.what.startswith("is not known")
    }
    assert unknown == {"source.nothing"}
    shown = CliRunner().invoke(command_of(method), ["--help"]).output
    for field in fields_of(method.parameters):
        assert field.flag in shown


def test_help_asks_for_no_mathematics_and_no_recipes():
    code = (
        "import sys\n"
        "from click.testing import CliRunner\n"
        "from robolink_cli.commands.measure.calibrate import calibrate\n"
        "from robolink.methods import all_methods\n"
        "commands = [[method.name] for method in all_methods()]\n"
        "for words in [[], *commands]:\n"
        "    shown = CliRunner().invoke(calibrate, [*words, '--help'])\n"
        "    assert shown.exit_code == 0, shown.output\n"
        "late = {'numpy', 'pydantic', 'sqlite3', 'pymodbus', 'can', 'rich'}\n"
        "assert not late & {*sys.modules}, late & {*sys.modules}"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=30)
