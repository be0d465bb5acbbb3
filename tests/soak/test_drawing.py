"""The draws of a seed can occur: in its kind of cell, on its link, within its deed."""

import pytest
from robolink_simulators.faults import FaultAction, LinkKind, PlcFaultAction, links_of

from tests.soak.adversary import CellKind, drawn_history
from tests.soak.adversary.deed_lengths import length_of
from tests.soak.adversary.drawn_hours import LINE_KINDS, MAILBOX_KINDS, deeds_of
from tests.soak.adversary.history import Hindrance
from tests.soak.adversary.instants import INSTANTS, RARE
from tests.soak.adversary.plant.lines import LineBend

pytestmark = pytest.mark.soak

LINKS = {
    CellKind.EPSON: LinkKind.EPSON_SIM,
    CellKind.EPSON_SERIAL: LinkKind.EPSON_SERIAL,
    CellKind.SOFTMOTION: LinkKind.MAILBOX_SIM,
    CellKind.MODBUS_TCP: LinkKind.MODBUS_TCP,
    CellKind.MODBUS_RTU: LinkKind.MODBUS_RTU,
    CellKind.CANOPEN: LinkKind.CAN,
    CellKind.OPCUA: LinkKind.OPCUA,
    CellKind.REGISTER_MAP: LinkKind.PLC_RTU,
}
BY_REQUEST = {Hindrance.WIRE, Hindrance.LINE, Hindrance.MACHINE, Hindrance.PRODUCTION}


def disturbances(kind, seeds=range(25)):
    for seed in seeds:
        for hour in drawn_history(seed, 20, kind).hours:
            for one in hour.disturbances:
                yield hour, one


def is_told_instant(one):
    """Return whether a disturbance is one of those placed at a significant instant."""
    return any(
        (instant.kind, instant.what, instant.match) == (one.kind.value, one.what, one.match)
        and one.at in range(instant.first, instant.first + instant.count)
        for instants in (*INSTANTS.values(), *RARE.values())
        for instant in instants
    )


def test_twenty_seeds_bring_every_kind_of_cell_that_is_not_asked_for_by_name():
    drawn = {drawn_history(seed, 1).kind for seed in range(20)}
    assert drawn == {*CellKind} - {CellKind.OPCUA}


@pytest.mark.parametrize("kind", CellKind)
def test_what_is_drawn_lies_within_the_measured_deed(kind):
    assert {hour.deed for hour, _ in disturbances(kind)} == {*deeds_of(kind)}
    for hour, one in disturbances(kind):
        length = length_of(kind, hour.deed)
        if is_told_instant(one):
            continue
        if one.kind is Hindrance.DISK:
            assert one.at < max(1, length.commits)
            continue
        counts = dict(length.requests if one.kind in BY_REQUEST else length.points)
        if one.kind is not Hindrance.PENDANT:
            assert one.at < counts[one.match]


@pytest.mark.parametrize("kind", LINKS)
def test_a_fault_of_the_wire_can_happen_on_the_link(kind):
    family = PlcFaultAction if kind in MAILBOX_KINDS else FaultAction
    drawn = {one.what for _, one in disturbances(kind) if one.kind is Hindrance.WIRE}
    assert len(drawn) > 5
    assert all(LINKS[kind] in links_of(family[name]) for name in drawn)


def test_segments_toggles_and_foreign_nodes_are_of_can_alone():
    of_can = {"LOSE_SEGMENT", "WRONG_TOGGLE", "FOREIGN_NODE", "ECHO"}
    for kind in LINKS:
        drawn = {one.what for _, one in disturbances(kind) if one.kind is Hindrance.WIRE}
        assert drawn & of_can == (of_can if kind is CellKind.CANOPEN else set())


@pytest.mark.parametrize("kind", CellKind)
def test_bytes_are_bent_on_serial_lines_alone(kind):
    bends = {one.what for _, one in disturbances(kind) if one.kind is Hindrance.LINE}
    assert bends == ({bend.name for bend in LineBend} if kind in LINE_KINDS else set())
