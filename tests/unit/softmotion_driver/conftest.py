"""Fixtures for the driver of a PLC mailbox over a scripted link."""

from collections.abc import Iterator

import pytest

from robolink.controllers import SoftMotionController
from robolink.model import MotionGroup
from tests.unit.softmotion_driver._cell import Cell
from tests.unit.softmotion_driver._plc import Plc


@pytest.fixture
def cell() -> Iterator[Cell]:
    """A PLC, the link to it and the record of open markers; closed at the end."""
    cell = Cell()
    yield cell
    cell.close()


@pytest.fixture
def plc(cell: Cell) -> Plc:
    """The PLC of the cell."""
    return cell.plc


@pytest.fixture
def controller(cell: Cell) -> SoftMotionController:
    """The controller, owned by the driver, with an empty record."""
    controller = cell.met()
    controller.take()
    cell.plc.executed.clear()
    cell.link.sent.clear()
    return controller


@pytest.fixture
def group(controller: SoftMotionController) -> MotionGroup:
    """The axis group of the controller."""
    return controller.groups[0]
