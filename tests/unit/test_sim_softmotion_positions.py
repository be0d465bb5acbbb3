"""Positions of a simulated axis group in other coordinate systems and with other tools."""

import pytest
from robolink_simulators.softmotion import (
    BlockRefused,
    CoordRef,
    CoordSystem,
    ErrorKind,
    GroupOptions,
    JogCommand,
    SmcBufferMode,
    Target,
)
from robolink_simulators.softmotion.group.movement import EdgeWatch

from tests.unit._softmotion_machine import (
    FACTORS,
    LINE,
    NOZZLE,
    kind,
    moved,
    passing,
    settled,
    standing,
)

ACS, MCS, WCS = CoordSystem.ACS, CoordSystem.MCS, CoordSystem.WCS
PCS_1, TCS = CoordSystem.PCS_1, CoordSystem.TCS


def test_a_position_is_converted_by_the_tool_that_is_set_and_not_by_the_active_one():
    group = standing()
    group.set_tool(NOZZLE)
    axes = group.values
    moved(group, x_mm=-30)
    passing(group, 0.05)
    group.set_tool(CoordRef())
    flange = group.kinematics.flange(axes)
    found = group.convert_position(axes, ACS, MCS)
    assert found[:3] == pytest.approx(flange.shift_mm)
    with_nozzle = group.convert_position(axes, ACS, MCS, tool=NOZZLE)
    assert with_nozzle[:3] == pytest.approx((flange @ NOZZLE.frame()).shift_mm)
    assert group.read_tool().frame == CoordRef().frame()


@pytest.mark.parametrize("tool", [None, NOZZLE, CoordRef(1, 2, 3, 4, 5, 6)])
@pytest.mark.parametrize("system", [WCS, PCS_1, TCS])
def test_there_and_back_is_where_it_was(system, tool):
    group = standing()
    group.set_coordinate_transform(MCS, CoordRef(10, 20, 30, 40, 0, 0))
    group.set_coordinate_transform(PCS_1, CoordRef(-5, 6, 7, 0, 0, 15))
    there = group.convert_position(group.values, ACS, system, tool=tool)
    back = group.convert_position(there, system, ACS, tool=tool)
    assert back == pytest.approx(group.values)
    if system is TCS:
        assert there[:3] == pytest.approx((0, 0, 0), abs=1e-9)


def test_other_axes_as_reference_take_the_other_elbow():
    group = standing()
    place = group.convert_position(group.values, ACS, MCS)
    mirrored = group.convert_position(place, MCS, ACS, near=(30.0, -45.0, 15.0, -20.0))
    assert mirrored[1] == pytest.approx(-45.0)


@pytest.mark.parametrize(
    ("kinematics", "position", "tool", "because"),
    [
        ("Kin_Scara3_Z", (9e3, 0, 0, 0, 0, 0), None, ErrorKind.UNREACHABLE),
        ("Kin_Scara3_Z", (float("nan"), 0, 0, 0, 0, 0), None, ErrorKind.PARAMETER),
        ("Kin_Scara2_Z", (300, 0, 0, 0, 0, 0), CoordRef(10), ErrorKind.TOOL_INCOMPATIBLE),
    ],
)
def test_what_cannot_be_converted_is_refused(kinematics, position, tool, because):
    with pytest.raises(BlockRefused) as refused:
        standing(kinematics).convert_position(position, MCS, ACS, tool=tool)
    assert refused.value.kind is because


def in_pcs(group):
    here = group.convert_position(group.values, ACS, PCS_1)
    return Target((here[0] - 30, *here[1:]), PCS_1)


@pytest.mark.parametrize("how", ["line", "direct", "interrupted", "jog"])
def test_a_coordinate_system_in_use_is_not_moved(how):
    group = standing()
    if how == "jog":
        group.jog(JogCommand(1, 0, PCS_1, LINE))
    elif how == "direct":
        group.move_direct_absolute(in_pcs(group), FACTORS)
    else:
        group.move_linear_absolute(in_pcs(group), LINE)
    passing(group, 0.05)
    if how == "interrupted":
        group.interrupt()
        settled(group)
    refused = group.set_coordinate_transform(PCS_1, CoordRef(1))
    assert kind(refused) is ErrorKind.PCS_STILL_IN_USE
    assert refused.outputs.error.symbol == "SMC_AXIS_GROUP_PCS_STILL_IN_USE"
    assert group.set_coordinate_transform(CoordSystem.PCS_2, CoordRef(1)).outputs.done
    assert group.transforms.placed(PCS_1) == CoordRef().frame()


def test_whether_it_is_refused_is_an_option_and_at_rest_it_never_is():
    group = standing(options=GroupOptions(coordinate_transform_in_use="accepted"))
    group.move_linear_absolute(in_pcs(group), LINE)
    assert group.set_coordinate_transform(PCS_1, CoordRef(1)).outputs.done
    group = standing()
    group.move_linear_absolute(in_pcs(group), LINE)
    settled(group)
    assert group.set_coordinate_transform(PCS_1, CoordRef(1)).outputs.done


@pytest.mark.parametrize(
    ("mode", "because", "symbol"),
    [
        (
            SmcBufferMode.BLENDING_LOW,
            ErrorKind.BLENDING_NOT_SUPPORTED,
            "SMC_BLENDING_NOT_SUPPORTED_BY_PREVIOUS_MOVEMENT",
        ),
        (SmcBufferMode.BUFFERED, ErrorKind.WRONG_STATE, "SMC_AXIS_GROUP_WRONG_STATE"),
    ],
)
def test_nothing_blends_with_a_movement_that_may_end_anywhere(mode, because, symbol):
    group = standing()
    moved(group, x_mm=-30, watch=EdgeWatch(3))
    x, y, z, *abc = group.read_actual_position().values
    follower = group.move_linear_absolute(Target((x - 40, y, z, *abc)), LINE, mode=mode)
    assert kind(follower) is because
    assert follower.outputs.error.symbol == symbol


def test_outside_of_the_motion_task_no_block_moves_anything():
    group = standing(options=GroupOptions(program_task="other"))
    x, y, z, *abc = group.read_actual_position().values
    for block in (
        group.move_linear_absolute(Target((x - 40, y, z, *abc)), LINE),
        group.move_direct_absolute(Target(group.values, ACS), FACTORS),
        group.jog(JogCommand(1, 0, MCS, LINE)),
    ):
        assert kind(block) is ErrorKind.OUTSIDE_MOTION_TASK
        assert block.outputs.error.number == 12108
    assert group.set_tool(NOZZLE).outputs.done
    assert group.next_change() is None


def test_the_symbol_of_a_reset_with_nothing_to_reset_is_told():
    error = standing().reset().outputs.error
    assert (error.number, error.symbol) == (120, "SMC_R_NO_ERROR_TO_RESET")
