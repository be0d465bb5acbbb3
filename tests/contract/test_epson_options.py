"""The driver works with every option of a controller that the documents leave open."""

from dataclasses import fields, replace
from typing import Any

import pytest
from robolink_simulators.cell.tip_switches import TouchPlate
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions

from robolink import ANY, ToolOffset
from robolink.errors import (
    ControllerFaultError,
    NotReadyError,
    StoppedError,
    UnclearAnswerError,
    UndefinedToolError,
)
from robolink.model import InputEdge, MotionOutcome, MotionProfile, Path, WorkBox
from robolink.protocols import spel
from tests.contract.conftest import served

HABITS: list[dict[str, Any]] = [
    {},
    {"terminator": "cr"},
    {"terminator": "lf"},
    {"status_flags": 10},
    {"print_crlf_inside_quotes": False},
    {"abort_reply_first": False},
    {"second_client": "closed"},
    {"execute_on_disconnect": "stops"},
    {"logout_while_running": "refused"},
    {"execute_failure_code": 20},
    {"flags_during_execute": "ready"},
    {"monitoring_refusal": 11},
    {"point_coordinates": "given"},
    {"true_value": 1},
    {"comma_blank": "always"},
    {"comma_blank": "nothing"},
    {"comma_blank": "comma"},
    {"comma_blank": "tab"},
    {"tool_listing": "padded"},
    {"tool_listing": "four"},
    {"tlset_of_undefined": "error"},
    {"where_width": 8},
    {"reset_outputs_off": False},
    {"extended_queries": False},
    {"rc_plus": 5},
    {"rc_plus": 8},
    {"real_pos_noise_mm": 0.0},
    {"till_already_met": "starts"},
    {"angle_wrap": True},
    {"execute_failure": "text"},
    {"number_lead_blank": True, "requests_end_with_silence": False, "terminator": "lf"},
    {"error_state_after_failed_execute": False, "clear_selected_tool": "keeps"},
    {
        "clear_selected_tool": "error",
        "xylim_counts": "flange",
        "login_without_parameter": "error_12",
        "missing_robot_number": "current",
        "robot_zero": "error_12",
        "accel_max": 100,
        "outputs_off_at_estop": False,
        "maintenance_data": True,
        "variable_assignment": "refused",
        "single_line_if": "runs",
    },
]


def name_of(habit):
    return ",".join(f"{key}={value}" for key, value in habit.items()) or "defaults"


def test_every_option_with_named_values_is_varied_here():
    varied = {key for habit in HABITS for key in habit}
    settled_elsewhere = {
        "monitoring_only",
        "monitoring_timeout",
        "companion",
        "dry_run",
        "virtual_io",
        "login_timeout_s",
        "remote_timeout_s",
        "numbers",
        # On the serial line only: tests/contract/test_epson_serial_line.py.
        *(field.name for field in fields(EpsonOptions) if field.name.startswith("rs232_")),
        # Settling of the servo: tests/unit/test_sim_drives.py.
        "servo_lag_ms",
        "servo_unrest_pulses",
        # Programs only: tests/unit/spel_programs.
        "vision_acquisition_ms",
        "vision_object_ms",
        "vision_not_found",
        "uncalibrated_robot_result",
        "statement_us",
        "loop_passes",
        "for_test",
        "integer_overflow",
        "undeclared",
        "background_tasks",
        "advanced_task_commands",
        "windows_status",
        "globals_at_start",
        "ports_of_ended_task",
        "input_blank",
        "blank_before_dollar",
        "old_here",
        "io_bits",
    }
    assert {field.name for field in fields(EpsonOptions)} == varied | settled_elsewhere


ON_THE_WIRE = {
    *("terminator", "requests_end_with_silence", "second_client", "execute_on_disconnect"),
    *("abort_reply_first", "flags_during_execute", "logout_while_running"),
}
"""Options that affect bytes and connections; the others are alike on every link."""


SOAK = pytest.mark.soak


def together(habits, most=6):
    """Return habits that a controller has at the same time: each is met in few cells."""
    met = [dict[str, Any]()]
    for habit in filter(None, habits):
        row = next((it for it in met[1:] if len(it) < most and not it.keys() & habit.keys()), None)
        if row is None:
            met.append(dict(habit))
        else:
            row.update(habit)
    return met


TOGETHER = together(HABITS)


def link_for(habit):
    return "tcp" if not habit or ON_THE_WIRE & habit.keys() else "sim"


@pytest.fixture(params=[*TOGETHER, *(pytest.param(it, marks=SOAK) for it in HABITS)], ids=name_of)
def habit(request):
    return request.param


ON_EVERY_LINK = pytest.mark.parametrize(
    ("serve", "habit"),
    [
        *(pytest.param(link_for(it), it, id=f"{link_for(it)}-{name_of(it)}") for it in TOGETHER),
        *(
            pytest.param(link, it, marks=SOAK, id=f"{link}-{name_of(it)}-alone")
            for it in HABITS
            for link in ("sim", "tcp", "pty")
        ),
    ],
    indirect=True,
)


@pytest.mark.moves
@ON_EVERY_LINK
def test_tools_and_motion_work_with_every_habit(serve, habit):
    simulator = EpsonSimulator(seed=11, options=EpsonOptions(**habit))
    with serve(simulator) as cell, cell.connect() as controller:
        controller.motors(True)
        tools, group = controller.tools, controller.groups[0]
        assert controller.status().ready
        listed = tools.read_all()
        assert listed[1].matches(tools.read(1), 0.0005)
        assert tools.read(2) is None
        value = ToolOffset(10.5, -2.25, -19.125, 12.5)
        assert tools.write(2, value, expected=None).read_back.matches(value, 0.0005)
        assert tools.clear(2, expected=value).read_back is None
        with pytest.raises(UndefinedToolError):
            tools.select(2)
        with controller.preserved("a test"):
            tools.select(0)
            here = group.pose()
            target = replace(here, z_mm=here.z_mm + 3)
            profile = MotionProfile(Path.STRAIGHT, 5, 20.0)
            motion = group.move_to(target, profile, box=WorkBox())
            assert motion.wait(timeout_s=60) is MotionOutcome.ARRIVED
            assert group.pose().z_mm == pytest.approx(target.z_mm, abs=0.05)
        assert tools.selected() == 1
        assert len(group.joints().world) == 6


@pytest.mark.moves
@ON_EVERY_LINK
def test_an_abort_and_a_failed_statement_are_understood_with_every_habit(serve, habit):
    simulator = EpsonSimulator(seed=11, options=EpsonOptions(**habit))
    with serve(simulator) as cell, cell.connect() as controller:
        controller.motors(True)
        group = controller.groups[0]
        here = group.pose()
        target = replace(here, z_mm=here.z_mm + 30)
        motion = group.move_to(target, MotionProfile(Path.STRAIGHT, 1, 1.0), box=WorkBox())
        controller.stop()
        with pytest.raises(StoppedError):
            motion.wait(timeout_s=60)
        controller.release_stop()
        beyond = replace(group.pose(), x_mm=5000.0)
        with pytest.raises((ControllerFaultError, UnclearAnswerError)) as caught:
            group.move_to(beyond, MotionProfile(), box=WorkBox()).wait(timeout_s=60)
        assert "Go XY(5000.000" in str(caught.value)
        assert controller.outcomes.open_markers() == ()
        if controller.status().fault:
            controller.reset_fault()
        assert controller.tools.write(1, ToolOffset(12), expected=ANY).read_back


@pytest.mark.moves
def test_a_movement_until_an_input_is_understood_with_every_habit(habit):
    simulator = EpsonSimulator(seed=11, options=EpsonOptions(**habit))
    touch_mm = simulator.machine.tip().z_mm - 1.0
    simulator.world.connect(3, TouchPlate(simulator.world.tip_mm()[2] - 1.0))
    with served("sim", simulator) as cell, cell.connect() as controller:
        controller.motors(True)
        group = controller.groups[0]
        here = group.pose()
        for run_on in (False, True):
            edge = InputEdge(3, run_on=run_on)
            below = replace(here, z_mm=here.z_mm - 2)
            motion = group.move_until_input(below, edge, speed_mm_s=5, box=WorkBox())
            assert motion.wait(timeout_s=60).z_mm == pytest.approx(touch_mm, abs=0.1)
            with pytest.raises(NotReadyError):
                group.move_until_input(below, edge, speed_mm_s=5, box=WorkBox())
            group.move_to(here, MotionProfile(Path.STRAIGHT), box=WorkBox()).wait(timeout_s=60)


def test_the_listing_with_four_columns_means_no_v_and_no_w():
    assert spel.parse_tool_listing("Tool 1: 1.000, 2.000, 3.000, 4.000\r\n") == {
        1: ToolOffset(1, 2, 3, 4)
    }
