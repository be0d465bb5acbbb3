"""``connect(url, kind=...)`` is typed as that kind, or refused before anything is connected."""

from typing import assert_type

import pytest

import robolink
from robolink import Controller
from robolink.controllers import (
    EpsonController,
    PlcMapController,
    SimpleController,
    SoftMotionController,
)
from robolink.errors import ConfigError
from robolink.model import new_operation
from robolink.transport import LinkUrl


def test_a_controller_is_of_the_kind_that_was_asked_for():
    name = new_operation()
    with robolink.connect(f"epson+sim://{name}", kind=EpsonController) as epson:
        assert_type(epson, EpsonController)
        assert epson.robot_number() == 1
        assert robolink.connect(epson, kind=EpsonController) is epson
    with robolink.connect(f"softmotion+sim://{name}", kind=SoftMotionController) as plc:
        assert_type(plc, SoftMotionController)
        assert plc.mailbox_facts().version
    with robolink.connect(f"epson+sim://{name}") as controller:
        assert_type(controller, Controller)


@pytest.mark.parametrize("kind", [SoftMotionController, PlcMapController, SimpleController])
def test_a_url_of_another_kind_is_refused_before_anything_is_connected(kind):
    url = "epson+tcp://192.0.2.1:5000"  # there is no controller, and none is asked
    with pytest.raises(ConfigError, match=f"EpsonController, not {kind.__name__}") as refusal:
        robolink.connect(url, kind=kind)
    assert url in refusal.value.what
    assert "EpsonController" in refusal.value.remedy


def test_an_open_controller_of_another_kind_is_refused_and_stays_open():
    with robolink.connect(f"epson+sim://{new_operation()}") as epson:
        with pytest.raises(ConfigError, match="EpsonController, not SoftMotionController"):
            robolink.connect(epson, kind=SoftMotionController)
        assert epson.status().ready


def test_a_controller_of_somebody_elses_kind_is_closed_when_it_is_not_the_one_asked_for(
    monkeypatch,
):
    opened: list[SimpleController] = []

    def opener(_url: LinkUrl, _terms: object) -> SimpleController:
        opened.append(SimpleController())
        return opened[-1]

    monkeypatch.setattr("robolink.controllers.registry.find_plug_in", lambda _group, _name: opener)
    with robolink.connect("acme+usb://0", kind=SimpleController) as controller:
        assert_type(controller, SimpleController)
    with pytest.raises(ConfigError, match="SimpleController, not EpsonController"):
        robolink.connect("acme+usb://0", kind=EpsonController)
    assert "closed" in repr(opened[1])
