"""A simulated axis group, powered and in Standby, for the tests of its behaviour."""

from robolink_simulators.softmotion import (
    AxisGroup,
    CoordRef,
    CoordSystem,
    Dynamics,
    GroupOptions,
    SmcGroupState,
    Target,
    machine_named,
)

S = 1_000_000_000
CYCLE_NS = 4_000_000

LINE = Dynamics(100.0, 1000.0, 1000.0, 10000.0)
FACTORS = Dynamics(0.5, 0.5, 0.5, 0.5)


def standing(kinematics="Kin_Scara3_Z", at=None, options=None):
    """Return a group in Standby."""
    model = machine_named(kinematics)
    group = AxisGroup(model.kinematics, model.limits, options or GroupOptions())
    group.place(at or (30.0, 45.0, 15.0, -20.0, 10.0, 5.0)[: len(group.axes)])
    group.power(on=True)
    assert group.enable().outputs.done
    return group


def passing(group, seconds):
    """Let time pass."""
    group.advance(group.now_ns + round(seconds * S))


def at_cycle(group, count=1):
    """Let whole cycles pass."""
    group.advance((group.now_ns // CYCLE_NS + count) * CYCLE_NS)


def settled(group):
    """Let time pass until nothing happens any more by itself."""
    while (change := group.next_change()) is not None:
        assert change < group.now_ns + 600 * S
        group.advance(change)


def shifted(group, x_mm=0.0, y_mm=0.0, z_mm=0.0, c_deg=0.0):
    """Return a target beside the present TCP, in MCS."""
    x, y, z, a, b, c = group.read_actual_position().values
    return Target((x + x_mm, y + y_mm, z + z_mm, a, b, c + c_deg))


def in_axes(*values):
    """Return a target in axis values."""
    return Target((*values, *(0.0,) * (6 - len(values))), CoordSystem.ACS)


def state_of(group):
    """Return the state of the group."""
    return group.state


def in_error(**options):
    """Return a group in ErrorStop."""
    group = standing(options=GroupOptions(**options))
    group.fail_axis(1)
    assert group.state is SmcGroupState.ERROR_STOP
    return group


def way(group):
    """Return the axis values, cycle by cycle, until everything has ended."""
    places = [group.values]
    while group.next_change() is not None:
        group.advance(group.now_ns + CYCLE_NS)
        places.append(group.values)
    return places


def tcp_mm(group):
    """Return the TCP's place, in MCS."""
    return group.read_actual_position().values[:3]


def kind(execution):
    """Return the error class of an execution."""
    error = execution.outputs.error
    return None if error is None else error.kind


def moved(group, x_mm=0.0, y_mm=0.0, z_mm=0.0, **more):
    """Command a straight move beside the present TCP and expect its acceptance."""
    execution = group.move_linear_absolute(shifted(group, x_mm, y_mm, z_mm), LINE, **more)
    assert execution.outputs.busy
    return execution


MACHINES = (
    "Kin_Scara2_Z",
    "Kin_Scara2_Z+Kin_CAxis",
    "Kin_Scara3_Z",
    "Kin_Polar_Z",
    "Kin_Gantry3+Kin_CAxis",
    "Kin_5Axes",
    "Kin_Pos_RRR",
    "Kin_ArticulatedRobot_6DOF",
    "Kin_4AxisPalletizer",
    "Kin_Tripod_Rotary",
)
"""Kinematics with different conditions for movements and people."""

NOZZLE = CoordRef(10.0, -5.0, 40.0, 0.0, 0.0, 20.0)
