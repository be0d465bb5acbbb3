"""Numbers that only Python accepts are refused wherever a person types one."""

import re

import click
import pytest
from robolink_cli import main
from robolink_cli.commands.measure.calibrate.values import type_of
from robolink_cli.console.numbers import decimal

from robolink.methods.parameter_checks import fields_of
from robolink.methods.shared_parameters import LookParameters

STRANGE = [
    "\uff11\uff12.\uff15",
    "\u0661\u0662",
    "1_0",
    "1__0",
    " 5\n",
    "\u00a05",
    "5 ",
    "0x10",
    "1,5",
    "+-1",
    "1e",
    "",
    "in",
]


@pytest.mark.fault("F38")
@pytest.mark.parametrize("text", STRANGE)
def test_f38_what_only_python_calls_a_number_is_none(text):
    with pytest.raises(ValueError, match=re.escape(repr(text))):
        decimal(text)


@pytest.mark.parametrize(
    ("text", "value"), [("-120.35", -120.35), (".5", 0.5), ("5.", 5.0), ("+1e-3", 0.001)]
)
def test_a_plain_number_is_read(text, value):
    assert decimal(text) == value


@pytest.mark.fault("F38")
@pytest.mark.parametrize("text", STRANGE[:5])
def test_f38_such_a_number_is_refused_as_an_offset_and_nothing_is_written(simulator, run, text):
    before = simulator.machine.tools.get(1)
    code, _, err = run("tool", "set", "1", f"--x={text}", "--yes")
    assert code == 2, err
    assert "is not a decimal number" in err
    assert simulator.machine.tools.get(1) == before
    assert simulator.exchanges == 0


def options(command, path=()):
    """Yield the options of a command and of those below it, each with its name."""
    yield from ((" ".join((*path, option.opts[0])), option) for option in command.params)
    if isinstance(command, click.Group):
        context = click.Context(command)
        besides = ["expert"] if command is main.cli else []
        for name in command.list_commands(context) + besides:
            inner = command.get_command(context, name)
            assert inner is not None
            yield from options(inner, (*path, name))


@pytest.mark.fault("F38")
def test_f38_no_option_takes_a_limit_that_nothing_exceeds():
    """Nothing is greater than nan: as a limit it would let every value pass."""
    limits = dict(options(main.cli))
    taking = {
        name: option
        for name, option in limits.items()
        if isinstance(option.type, click.types.FloatParamType)
    }
    assert {"calibrate two-pose --tolerance", "sim epson --idle-exit"} <= set(taking)
    for name, option in taking.items():
        for text in ("nan", "inf", "-nan", *STRANGE[:3]):
            with pytest.raises(click.BadParameter):
                option.type.convert(text, option, None)
                pytest.fail(f"{name} takes {text!r}")


def test_a_time_that_is_none_is_a_mistake_of_usage(run):
    code, _, err = run("status", "--timeout", "nan")
    assert code == 2
    assert "must be a finite number" in err


@pytest.mark.parametrize(
    ("typed", "read"),
    [
        ("0.02,0,0,-0.02", ((0.02, 0.0), (0.0, -0.02))),
        ("0.02,0,0", None),
        ("0.02,0,0,-0.02,1", None),
    ],
)
def test_a_matrix_has_as_many_numbers_as_it_has_places(typed, read):
    (field,) = (one for one in fields_of(LookParameters) if one.name == "mm_per_px")
    kind = type_of(field)
    if read is None:
        with pytest.raises(click.BadParameter, match="4"):
            kind.convert(typed, None, None)
    else:
        assert kind.convert(typed, None, None) == read
