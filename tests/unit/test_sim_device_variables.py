"""Global Preserve variables over the wire."""

import pytest
from robolink_simulators.epson import EpsonSimulator

from robolink.errors import ConfigError
from robolink.protocols.epson_text import VariableType


@pytest.fixture
def simulator():
    return EpsonSimulator()


@pytest.fixture
def client(simulator, login):
    return login(simulator)


@pytest.mark.parametrize(
    ("kind", "written", "read"),
    [
        (VariableType.BOOLEAN, "True", "-1"),
        (VariableType.BYTE, "-128", "-128"),
        (VariableType.INTEGER, "32767", "32767"),
        (VariableType.LONG, "-2147483648", "-2147483648"),
        (VariableType.REAL, "1.23456789", "1.23457"),
        (VariableType.DOUBLE, "1.23456789", "1.23456789"),
    ],
)
def test_a_variable_keeps_what_its_type_can_hold(client, kind, written, read):
    assert client.ask(f"$SetVariable,g_{kind},{written},{kind}") == "#SetVariable,0"
    assert client.ask(f"$GetVariable,G_{kind}") == f"#GetVariable,{read}"
    assert client.ask(f"$GetVariable,g_{kind},{kind}") == f"#GetVariable,{read}"


@pytest.mark.parametrize(
    ("rest", "code"),
    [
        ("g_Byte,128", 12),
        ("g_Byte,1.5", 12),
        ("g_Boolean,maybe", 12),
        ("g_Real,nan", 12),
        ("g_Real,1e999", 12),
        ("g_Long,99999999999999999999", 12),
        ("g_Nothing,1", 15),
        ("g_Byte,1,Long", 14),
        ("g_Byte_table(16,0),1,Byte", 15),
        ("g_Byte_table,1,Byte", 15),
    ],
)
def test_a_value_that_does_not_fit_is_refused(client, rest, code):
    assert client.ask(f"$SetVariable,{rest}") == f"!SetVariable,{code}"


def test_elements_are_read_along_the_last_subscript(client):
    for j in range(3):
        client.ask(f"$SetVariable,g_Byte_table(3,{j}),{10 + j},Byte")
    assert client.ask("$GetVariable,g_Byte_table(3,0),Byte,3") == "#GetVariable,10,11,12"


@pytest.mark.parametrize(
    ("rest", "code"),
    [
        ("g_Byte_table(3,0)", 14),
        ("g_Byte_table(3,0),Byte", 14),
        ("g_Byte_table(3,0),Byte,0", 14),
        ("g_Byte_table(3,0),Byte,101", 14),
        ("g_Byte_table(3,0),Byte,x", 14),
        ("names$(0),String,1", 14),
        ("g_Byte_table(3,4),Byte,3", 15),
        ("g_Byte_table(3),Byte,1", 15),
        ("g_Byte,Long", 14),
        ("g_Nothing", 15),
        ("1bad", 15),
    ],
)
def test_a_query_that_fits_no_variable_is_refused(simulator, client, rest, code):
    simulator.variables.declare("names$", VariableType.STRING, 3)
    assert client.ask(f"$GetVariable,{rest}") == f"!GetVariable,{code}"


def test_a_text_keeps_its_blanks_and_its_255_characters(simulator, client):
    simulator.variables.declare("note$", VariableType.STRING)
    assert client.ask("$SetVariable,note$, a b ,String") == "#SetVariable,0"
    assert client.ask("$GetVariable,note$") == "#GetVariable, a b "
    assert client.ask("$SetVariable,note$," + "x" * 256) == "!SetVariable,12"


def test_an_array_is_declared_without_a_value(simulator):
    with pytest.raises(ConfigError, match="no single value"):
        simulator.variables.declare("table", VariableType.LONG, 3, value=1)
