"""Options of the simulator, written as text."""

from dataclasses import fields

import pytest
from robolink_simulators.epson import EpsonOptions
from robolink_simulators.epson.options import option_names, options_from_text

from robolink.errors import ConfigError


def test_nothing_given_is_the_defaults():
    assert options_from_text({}) == EpsonOptions()


@pytest.mark.parametrize("field", fields(EpsonOptions), ids=lambda field: field.name)
def test_every_option_can_be_written_as_text(field):
    if field.name == "numbers":
        assert options_from_text({"numbers.aborted": "77"}).numbers.aborted == 77
    else:
        text = str(field.default)
        assert field.name in option_names()
        assert options_from_text({field.name: text}) == EpsonOptions()


def test_values_take_the_type_of_their_option():
    options = options_from_text(
        {
            "terminator": "lf",
            "status_flags": "10",
            "monitoring_only": "yes",
            "remote_timeout_s": "2.5",
            "execute_failure_code": "20",
        }
    )
    assert (options.terminator, options.status_flags) == ("lf", 10)
    assert options.monitoring_only is True
    assert (options.remote_timeout_s, options.execute_failure_code) == (2.5, 20)


def test_an_unknown_option_lists_the_known_ones():
    with pytest.raises(ConfigError, match=r"no option 'colour'.*terminator.*tool_undefined"):
        options_from_text({"colour": "red"})


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("terminator", "tab"),
        ("status_flags", "12"),
        ("monitoring_only", "perhaps"),
        ("remote_timeout_s", "soon"),
        ("remote_timeout_s", "nan"),
        ("remote_timeout_s", "-1"),
        ("execute_failure_code", "2.5"),
        ("numbers.aborted", "x"),
    ],
)
def test_a_value_that_does_not_fit_is_named(name, text):
    with pytest.raises(ConfigError, match=f"{name} cannot be '{text}'"):
        options_from_text({name: text})
