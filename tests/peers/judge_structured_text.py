"""Two third-party compilers execute the exported core: their words equal our interpreter's."""

from contextlib import ExitStack

import pytest

from robolink.protocols.mailbox import ExportProfile
from robolink.protocols.mailbox.exports import program_texts
from tests.peers._compiled_plc import CompiledCore, compiled_plc
from tests.peers._iec_compilers import COMPILERS, IecCompiler
from tests.unit.structured_text import _behaviours as b
from tests.unit.structured_text._drawn import drawn_commands

CORE = "robolink_core.st"
ANY = "Kin_Scara3_Z"
"""Any kinematics: to the core it matters only whether one is exported."""


@pytest.fixture(scope="module", params=COMPILERS, ids=lambda compiler: compiler.name)
def compiler(request) -> IecCompiler:
    given: IecCompiler = request.param
    absent = given.missing()
    if absent:
        pytest.skip(absent)
    return given


@pytest.fixture(scope="module")
def bench_program(compiler, tmp_path_factory):
    core = program_texts(ExportProfile.FULL, kinematics=ANY)[CORE]
    return compiler.compiled(core, tmp_path_factory.mktemp("full"))


def test_the_core_of_profile_tools_becomes_a_program_too(compiler, tmp_path):
    core = program_texts(ExportProfile.TOOLS)[CORE]
    assert compiler.compiled(core, tmp_path).is_file()


def compared(program, folder, behaviour, kinematics):
    """Return the words of the interpreted core and of the compiled one."""
    cores: list[CompiledCore] = []
    with ExitStack() as served:
        theirs = b.taken(folder, behaviour, kinematics, compiled_plc(program, served, cores))
        assert min(core.calls for core in cores) > 20
    return b.taken(folder, behaviour, kinematics, b.of_program()), theirs


@pytest.mark.timeout(300)
@pytest.mark.parametrize(("behaviour", "kinematics"), b.RUNS, ids=b.named)
def test_the_compiled_core_gives_the_words_of_the_interpreted_one(
    bench_program, tmp_path, behaviour, kinematics
):
    ours, theirs = compared(bench_program, tmp_path, behaviour, kinematics)
    assert len(ours) > 1
    assert theirs == ours


@pytest.mark.timeout(300)
@pytest.mark.parametrize("seed", range(100, 104))
def test_it_gives_the_same_words_for_drawn_commands(bench_program, tmp_path, seed):
    ours, theirs = compared(bench_program, tmp_path, drawn_commands(seed, 40), ANY)
    assert theirs == ours


def test_words_the_other_way_round_are_found_by_the_driver_and_here(compiler, tmp_path):
    core = b.high_first(program_texts(ExportProfile.FULL, kinematics=ANY)[CORE])
    program = compiler.compiled(core, tmp_path)
    states = tmp_path / "states"
    states.mkdir()
    with ExitStack() as served:
        b.b16_words_the_other_way_round(states, compiled_plc(program, served, []))
    ours, theirs = compared(program, states, b.b03_scara2_keeps_its_tool, "Kin_Scara2_Z")
    assert theirs != ours
