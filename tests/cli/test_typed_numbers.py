"""Numbers that only Python calls numbers are refused wherever a person types one."""

import re

import pytest
from robolink_cli.options.numbers import decimal

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
