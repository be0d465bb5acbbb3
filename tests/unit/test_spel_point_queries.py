"""The statements that ask for a taught point."""

import pytest

from robolink.errors import LocalProtocolError
from robolink.protocols import spel


@pytest.mark.parametrize("number", [0, 1, 901, 999])
def test_a_point_is_named_by_its_number(number):
    assert spel.print_point(number) == f"Print P{number}"
    assert spel.print_point_defined(number) == f"Print PDef(P{number})"


@pytest.mark.parametrize("number", [-1, 1000, True, 1.0, "1"])
@pytest.mark.parametrize("build", [spel.print_point, spel.print_point_defined])
def test_another_point_is_never_asked_for(build, number):
    with pytest.raises(LocalProtocolError):
        build(number)
