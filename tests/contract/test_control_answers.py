"""The OpenAPI document describes the answer of each act, for clients in other languages."""

import json
from contextlib import ExitStack
from importlib.resources import files
from pathlib import Path
from urllib.parse import urlencode, urlsplit

import pytest
from robolink_simulators.cell.clock import ManualClock, SteeredClock
from robolink_simulators.control.acts import ACTS
from robolink_simulators.control.cell import AnySimulator, ControlledCell
from robolink_simulators.control.server import ControlServer
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.faults import FaultAction, PlcFaultAction
from robolink_simulators.plc import PlcSimulator
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

from robolink.register_maps import load_map
from tests._json_schema import Schemas
from tools.openapi import AnswerSchemas

MAP = Path(__file__).parents[2] / "examples/plc-maps/commit-bit.toml"
DOCUMENT = json.loads(files("robolink_simulators.control").joinpath("openapi.json").read_bytes())
SCHEMAS = Schemas(DOCUMENT)

GIVEN = {
    "add_fault": {"action": "delay", "match": "x", "seconds": 1.5, "times": 2},
    "fail_axis": {"number": 0},
    "lay_words": {"order": "low_first"},
    "mount_beam": {"number": 1, "x_mm": 300, "y_mm": 0, "z_mm": 10, "heading_deg": 0},
    "mount_plate": {"number": 2, "z_mm": -150},
    "move_axis": {"number": 0, "target": 1},
    "push": {"text": "hello"},
    "raise_alarm": {"number": 1},
    "raise_error": {"number": 4002},
    "raise_warning": {"number": 700},
    "restore": {"name": "a"},
    "set_clock": {"factor": 0},
    "set_input": {"number": 3},
    "set_monitoring_only": {"on": False},
    "shift_map": {"words": 1},
    "snapshot": {"name": "a"},
    "step": {"seconds": 0.5},
    "teach_point": {"number": 1, "u_deg": 10},
    "way_along": {"axis": "x", "length_mm": 5},
}
"""The parameters of acts that need some."""

FIRST = ("snapshot", "teach", "jog_onto_pin", "teach_point", "auto", "move_axis")
"""Acts that come first because earlier acts by name would block them."""


@pytest.fixture(params=["epson", "softmotion", "plc"])
def at(request):
    """Runs acts on a simulator of each kind by GET and POST, and checks each answer."""
    simulator: AnySimulator
    if request.param == "epson":
        simulator = EpsonSimulator("T6-602S,C8-C901S", seed=3)
    elif request.param == "softmotion":
        simulator = SoftMotionSimulator(seed=3)
    else:
        simulator = PlcSimulator(load_map(MAP), seed=3)
    with ExitStack() as stack:
        cell = ControlledCell(simulator, SteeredClock(20))
        served = stack.enter_context(ControlServer({"cell": cell}))
        yield Asked(served, cell)


class Asked:
    """A client in another language that follows the document."""

    def __init__(self, server, cell):
        self.server, self.cell, self.simulator = server, cell, cell.simulator

    def told(self, path, method, given=None):
        target = urlsplit(self.server.url).path + path.replace("{cell}", "cell").rstrip("/")
        if method == "get" and given:
            target += f"?{urlencode(given)}"
        body = json.dumps(given).encode() if method == "post" and given is not None else b""
        status, document, _ = self.server.answered(method.upper(), target, body)
        answer = json.loads(json.dumps(document, allow_nan=False))
        assert SCHEMAS.wrong(SCHEMAS.answer_to(path, method, status), answer) == []
        return int(status), answer

    def act(self, name, given=None):
        """Run an act by each method in the document, and return the last answer."""
        path = f"/cells/{{cell}}/{name}"
        for method in ("get", "post"):
            if method in DOCUMENT["paths"][path]:
                status, answer = self.told(path, method, given)
                assert status == 200, (name, answer)
        return answer


def test_every_act_of_every_kind_answers_what_is_described(at):
    acts = ACTS[at.simulator.kind]
    assert set(at.told("/", "get")[1]["cells"]["cell"]["acts"]) == set(acts)
    assert at.told("/cells/{cell}", "get")[0] == 200
    for name in (*(it for it in FIRST if it in acts), *sorted(acts.keys() - set(FIRST))):
        at.act(name, GIVEN.get(name))


def test_what_is_told_of_the_past_is_described(at):
    simulator = at.simulator
    simulator.log.add(5, ">", "$GetStatus")
    assert at.act("log")["lines"]
    if simulator.kind != "plc":
        simulator._motion_log().add(5, lambda: (1.0, 2.0, 3.0))
        simulator._motion_log().add(5)
        assert [it["flange_mm"] for it in at.act("motions")["motions"]] == [[1, 2, 3], None]
    actions = PlcFaultAction if simulator.kind == "softmotion" else FaultAction
    planned = 0
    for action in actions:
        order = {"order": "low_first"} if action.name == "WORD_ORDER" else {}
        number = {"code": 30} if action.name in ("AXIS_ERROR", "DEVICE_FAULT") else {}
        whole = {"on_exchange": 1, "position": 2, "bit": 3, "match": "x", "seconds": 2.5}
        for given in ({}, whole | order | number):
            asked = {"action": action.name.lower(), **given}
            planned += at.told("/cells/{cell}/add_fault", "post", asked)[0] == 200
    assert planned > 5
    for _ in "ab":
        simulator.faults.take("x")
    told = at.act("faults")
    assert told["times_fired"] == len(told["fired"]) > 5


def test_each_truth_of_a_world_is_described(at):
    if at.simulator.kind == "plc":
        at.simulator.program.in_force[1] |= {"x": float("nan"), "y": float("inf")}
        assert at.act("truth")["stored"]["1"] | {"z_mm": 0, "u_deg": 0} == {
            **dict.fromkeys(("x_mm", "y_mm"), None),
            **dict.fromkeys(("z_mm", "u_deg", "v_deg", "w_deg"), 0),
        }
        return
    for touched in ("plane", "sphere", "pin"):
        at.act("set_world", {"person_touches": touched, "board_held": touched == "plane"})
        truth = at.act("truth")
        assert (truth["surface"] is None, truth["board"] is None) == (
            touched == "pin",
            touched != "plane",
        )
    at.act("set_world", {"contact_input": 4})
    at.simulator.world.camera.middle_mm = at.simulator.world.tip_mm()
    assert at.act("see", {"mark": 0})["seen"]


def test_what_is_refused_is_described(at):
    for path, given, status in (
        ("truth", {"x": 1}, 400),
        ("step", {"seconds": -1}, 400),
        ("restore", {"name": "b"}, 409),
    ):
        assert at.told(f"/cells/{{cell}}/{path}", "post", given)[0] == status
    at.cell.clock = ManualClock()
    assert at.told("/cells/{cell}/set_clock", "post", {"factor": 1})[0] == 409
    assert at.act("clock")["factor"] is None


def test_an_act_that_several_kinds_have_gives_the_same_at_each():
    gives: dict[str, set[object]] = {}
    for acts in ACTS.values():
        for name, act in acts.items():
            gives.setdefault(name, set()).add(act.gives)
    assert {name for name, given in gives.items() if len(given) > 1} == set()


def test_what_json_has_not_is_no_answer():
    with pytest.raises(TypeError):
        AnswerSchemas().of(set[int])


def test_the_check_of_a_schema_sees_what_is_wrong():
    """Without this every answer would pass."""
    right = {
        "fired": [{"action": "delay"}],
        "times_fired": 1,
        "pending": [],
        "waiting": 0,
        "schema": "robolink/control/1",
        "ok": True,
    }
    schema = SCHEMAS.answer_to("/cells/{cell}/faults", "get", 200)
    assert SCHEMAS.wrong(schema, right) == []
    changes: tuple[dict[str, object], ...] = (
        {"more": 1},
        {"ok": False},
        {"times_fired": 1.5},
        {"times_fired": True},
        {"pending": None},
        {"fired": [{}]},
        {"fired": [{"action": "delay", "order": "none"}]},
    )
    for change in changes:
        assert len(SCHEMAS.wrong(schema, {**right, **change})) == 1, change
    del right["pending"]
    assert SCHEMAS.wrong(schema, right) == ["/pending is missing"]
