"""What a server has is listed within bounds, and becomes the beginning of a map."""

from dataclasses import dataclass, field
from typing import Any

import pytest

from robolink.controllers import browse_nodes, draft_from_nodes
from robolink.errors import RejectedError
from robolink.register_maps import SymbolCell, check_map, load_symbol_map

GVL = "ns=4;s=|var|PLC.Application.GVL"


@dataclass(frozen=True)
class Node:
    id: str
    name: str
    kind: str = ""
    lengths: tuple[int, ...] = ()
    fields: tuple[Any, ...] = ()
    below: tuple["Node", ...] = field(default=(), repr=False)

    @property
    def type_name(self) -> str:
        return self.kind + "".join(f"[{length}]" for length in self.lengths)


def variable(name, kind="Double", lengths=(), fields=()):
    return Node(f"{GVL}.{name}", name, kind, lengths, fields)


class Server:
    """Nodes in memory; ``closed`` are those that it lists for nobody."""

    identity = "plc+opcua://test:4840"

    def __init__(self, *below, closed=()):
        self.top = Node("i=85", "Objects", below=below)
        self.closed = closed
        self.asked = 0

    def _find(self, node, start=None):
        start = start or self.top
        if node in (None, start.id):
            return start
        found = (self._find(node, one) for one in start.below)
        return next((one for one in found if one is not None), None)

    def describe(self, node):
        return self._find(node)

    def browse(self, node=None, *, most=1000):
        self.asked += 1
        if node in self.closed:
            raise RejectedError("BadUserAccessDenied")
        return self._find(node).below[:most]


def gvl(*variables):
    return Node("ns=4;s=|way|GVL", "GVL", below=variables)


def test_variables_are_found_below_folders_and_the_servers_own_are_not():
    own = Node("i=2253", "Server", below=(Node("i=2255", "NamespaceArray", "String"),))
    server = Server(own, Node("ns=2;i=5001", "DeviceSet", below=(gvl(variable("rTool1X")),)))
    found = browse_nodes(server, "/")
    assert [one.name for one in found.variables] == ["rTool1X"]
    assert found.unopened == ()


def test_a_look_is_bounded_and_tells_where_it_stopped():
    many = tuple(variable(f"r{number}") for number in range(20))
    server = Server(gvl(*many), Node("ns=4;s=other", "Other", below=(variable("rLast"),)))
    found = browse_nodes(server, "/", most=10)
    assert len(found.variables) == 8
    assert found.unopened == ("ns=4;s=|way|GVL", "ns=4;s=other")
    draft = draft_from_nodes("test", found)
    assert "Not opened: ns=4;s=|way|GVL, ns=4;s=other" in draft.notes[0]
    assert draft.text.startswith("# robolink looked at no more than")


def test_a_folder_that_is_closed_to_this_user_is_told_and_a_ring_ends():
    ring = Node("ns=4;s=ring", "Ring")
    object.__setattr__(ring, "below", (Node("ns=4;s=ring", "Ring"), variable("rTool1X")))
    closed = Node("ns=4;s=closed", "Closed")
    found = browse_nodes(Server(ring, closed, closed=("ns=4;s=closed",)), "/")
    assert [one.name for one in found.variables] == ["rTool1X"]
    assert found.unopened == ("ns=4;s=closed",)


def complete(text):
    """Fill in what a draft leaves open."""
    return text + '[commit]\nkind = "level"\nrequest = { node = "xR" }\nacknowledge = {node="xA"}\n'


def drafted(tmp_path, *variables, start="/"):
    draft = draft_from_nodes("test", browse_nodes(Server(gvl(*variables)), start))
    path = tmp_path / "draft.toml"
    path.write_text(complete(draft.text), encoding="utf-8")
    return draft, path


def test_separate_nodes_become_a_map_with_the_types_of_the_server(tmp_path):
    draft, path = drafted(
        tmp_path,
        variable("rTool1X"),
        variable("rTool1Y"),
        variable("rTool1U", "Float"),
        variable("xTakeOver", "Boolean"),
        variable("sText", "String"),
    )
    assert (draft.found, draft.left) == (3, (f"{GVL}.xTakeOver", f"{GVL}.sText"))
    assert f'root = "{GVL}."' in draft.text
    assert f"#   {GVL}.xTakeOver: Boolean" in draft.text
    tool = load_symbol_map(path).slots[1]
    assert {name: str(one.type) for name, one in tool.components.items()} == {
        "x": "LREAL",
        "y": "LREAL",
        "u": "REAL",
    }
    assert tool.nodes == (f"{GVL}.rTool1X", f"{GVL}.rTool1Y", f"{GVL}.rTool1U")


REALS = (Node("", "rX", "Float"), Node("", "rY", "Float"), Node("", "sName", "String"))


def test_a_structure_of_a_tool_becomes_its_fields(tmp_path):
    tool = variable("stTool3", "Structure", (), REALS)
    draft, path = drafted(tmp_path, tool, start=f"{GVL}.stTool3")
    assert draft.found == 2
    assert 'node = "stTool3"' in draft.text
    (slot,) = load_symbol_map(path).slots.values()
    assert (slot.tool, slot.nodes) == (3, (f"{GVL}.stTool3",))
    assert slot.components["y"].cell.steps == ("rY",)


def test_an_array_of_structures_becomes_a_tool_for_each_element_and_says_so(tmp_path):
    draft, path = drafted(tmp_path, variable("aTool", "Structure", (2,), REALS))
    assert "first element" in draft.notes[0]
    slots = load_symbol_map(path).slots
    assert slots[2].components["x"].cell == SymbolCell(f"{GVL}.aTool", (1, "rX"))
    assert slots[1].layout == slots[2].layout


def test_which_element_of_an_array_is_which_component_is_left_open(tmp_path):
    draft, path = drafted(tmp_path, variable("aTool1", "Double", (6,)))
    assert draft.found == 0
    assert "Which element is which component? The server does not say." in draft.text
    assert "names no component" in "; ".join(map(str, check_map(path)))
    filled = draft.text.replace("# x = {", "x = {").replace("# u = {", "u = {")
    path.write_text(complete(filled), encoding="utf-8")
    assert load_symbol_map(path).slots[1].components["u"].cell.steps == (3,)


def test_names_that_mean_the_same_component_are_told_and_the_first_is_kept(tmp_path):
    draft, path = drafted(tmp_path, variable("rTool1X"), variable("Tool1_X"))
    assert "X of tool 1 is in an earlier line" in draft.bad[0]
    assert load_symbol_map(path).slots[1].nodes == (f"{GVL}.rTool1X",)


@pytest.mark.parametrize("name", ['rTool1X"\n[evil]', "rTool1X\\", "刀具1_X"])
def test_no_name_of_a_server_breaks_out_of_its_line(tmp_path, name):
    draft, path = drafted(tmp_path, variable(name), variable("rTool2X"))
    assert "[evil]" not in draft.text.splitlines()
    assert load_symbol_map(path).slots[2].nodes == (f"{GVL}.rTool2X",)
