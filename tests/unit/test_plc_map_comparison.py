"""A wrong map is not confirmed, and a component that was not compared is not changed."""

from dataclasses import replace

import pytest
from robolink_simulators.plc import PlcSimulator

from robolink.controllers import PlcMapController
from robolink.errors import ConfigError, NotComparedError
from robolink.journal import memory_journal
from robolink.model import ANY, ToolOffset
from robolink.register_maps import (
    MapDiffersError,
    MapValue,
    compare,
    compare_test,
    confirm,
    confirmation_of,
    load_map,
    to_compare,
)
from tests.unit._plc_bench import COMMIT_BIT, LEVEL, LocalClient

URL = "plc+modbus-tcp://compared:502"
X, Y, Z, U = (MapValue(1, name) for name in "xyzu")
TRUE = {
    1: {"x": 12.5, "y": -3.25, "z": -31.75, "u": 5.25},
    2: {"x": 8.125, "y": 2.0, "z": -30.5, "u": 4.25},
}


@pytest.fixture(autouse=True)
def _own_state_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))


def changed(register_map, **numbers):
    """The map with other component numbers in both tools; each is made from the right one."""
    slots = {
        tool: replace(
            slot,
            components={
                n: numbers.get(n, lambda s, n=n: s[n])(slot.components) for n in slot.components
            },
        )
        for tool, slot in register_map.slots.items()
    }
    return replace(register_map, slots=slots, sha256="1" * 64)


EXCHANGED = {"y": lambda s: s["z"], "z": lambda s: s["y"]}


class Machine:
    """A PLC, its own screen, and a driver with a map that may be wrong."""

    def __init__(self, wrong=None, path=COMMIT_BIT, true=TRUE):
        self.right = load_map(path)
        self.map = wrong(self.right) if wrong else self.right
        self.plc = PlcSimulator(self.right)
        self.screen = {}
        for tool, components in true.items():
            self.enter(tool, **components)
        client = LocalClient(self.plc, URL)
        self.controller = PlcMapController(client, self.map, memory_journal(URL).log(URL))

    def enter(self, tool, **components):
        """Type values at the machine's own screen."""
        self.screen.update({MapValue(tool, name): held for name, held in components.items()})
        self.plc.program.set_tool(tool, components)

    def found(self):
        tools = self.controller.tools.read_all()
        return {
            MapValue(tool, name): offset.components()["xyzuvw".index(name)]
            for tool, offset in tools.items()
            if offset is not None
            for name in self.map.slots[tool].components
        }

    def compare(self, *values):
        found = self.found()
        made = [compare(self.map, found, it, f"{self.screen[it]:.3f}") for it in values]
        return confirm(self.controller.who().name, self.map, by="Kim", compared=made)

    def set(self, tool=1, **components):
        before = self.controller.tools.read(tool)
        assert before is not None
        self.controller.tools.write(tool, replace(before, **components), expected=before)


@pytest.mark.parametrize(
    ("wrong", "compared", "finds"),
    [
        (EXCHANGED, Y, "1.z"),
        ({"z": lambda s: replace(s["z"], factor=-1.0)}, Z, ""),
        ({"x": lambda s: replace(s["x"], factor=10.0)}, X, ""),
        ({"x": lambda s: replace(s["x"], address=s["x"].address + 10)}, X, "2.x"),
        ({"u": lambda s: replace(s["u"], factor=57.29577951308232)}, U, ""),
    ],
    ids=["exchanged", "sign", "tenfold", "next tool", "radians"],
)
def test_a_wrong_map_is_not_confirmed(wrong, compared, finds):
    """The comparison shows the sign, the scale and the place of each component."""

    def spoilt(right):
        if finds == "2.x":  # the second tool's registers are used for the first
            slots = {1: replace(right.slots[2], tool=1), 2: replace(right.slots[1], tool=2)}
            return replace(right, slots=slots)
        return changed(right, **wrong)

    machine = Machine(spoilt)
    with pytest.raises(MapDiffersError, match="the map finds") as refused:
        machine.compare(compared)
    assert finds in refused.value.remedy
    with pytest.raises(NotComparedError):
        machine.set(x_mm=1.0)
    assert machine.plc.writes == []


def test_the_wrong_word_order_is_not_confirmed():
    """Without a probe nothing else shows it: 12.5 mm are whole thousandths in two words."""
    right = load_map(LEVEL)
    turned = {
        name: lambda s, name=name: replace(s[name], low_word_first=True) for name in ("x", "y", "z")
    }
    wrong = changed(right, **turned)
    words = right.slots[1].components["x"].encode(12.5)
    found = {X: wrong.slots[1].components["x"].decode(words)}
    with pytest.raises(MapDiffersError):
        compare(wrong, found, X, "12.500")


def test_what_was_not_compared_is_not_changed():
    """Y and Z are exchanged; only X was compared, and it is right."""
    machine = Machine(lambda right: changed(right, **EXCHANGED))
    machine.compare(X)
    before = machine.plc.truth()["stored"]
    for change in ({"y_mm": 5.0}, {"z_mm": -5.0}, {"x_mm": 1.0, "u_deg": 1.0}):
        with pytest.raises(NotComparedError, match=r"1\.[yzu]") as refused:
            machine.set(**change)
        assert "check-map" in refused.value.remedy
        assert refused.value.tool == 1
        assert set(refused.value.components) <= {"y", "z", "u"}
        held = machine.controller.tools.read(1)
        assert held is not None
        with pytest.raises(NotComparedError):
            machine.controller.tools.preview_write(1, replace(held, **change))
    with pytest.raises(NotComparedError):
        machine.controller.tools.write(1, ToolOffset(1, 2, 3, 4), expected=ANY)
    assert machine.plc.truth()["stored"] == before
    assert not machine.controller.outcomes.open_markers()
    machine.set(x_mm=1.0)
    assert machine.plc.truth()["stored"]["1"]["x_mm"] == 1.0


def test_a_clear_changes_every_component_that_is_not_zero():
    machine = Machine(path=LEVEL, true={2: {"x": 12.5, "y": -3.25, "z": 0.0, "u": 0.0}})
    machine.compare(MapValue(2, "x"))
    with pytest.raises(NotComparedError, match=r"2\.y"):
        machine.controller.tools.clear(2, expected=ANY)
    with pytest.raises(NotComparedError, match=r"2\.y"):
        machine.controller.tools.preview_clear(2)
    machine.compare(MapValue(2, "y"))
    assert machine.controller.tools.clear(2, expected=ANY).read_back is None


def test_a_component_counts_for_each_tool_that_is_laid_out_alike_and_was_looked_at():
    machine = Machine()
    assert len(machine.compare(X, Y).missing(machine.map)) == 6
    with pytest.raises(NotComparedError, match=r"2\.x, 2\.y, 2\.z, 2\.u"):
        machine.controller.tools.require_writable(2)
    machine.compare(MapValue(2, "z"))
    machine.set(2, x_mm=1.0, y_mm=1.0, z_mm=1.0)
    machine.set(1, z_mm=1.0)
    with pytest.raises(NotComparedError, match=r"2\.u"):
        machine.set(2, u_deg=1.0)

    other = Machine(
        lambda right: replace(
            right,
            slots={**right.slots, 2: changed(right, **EXCHANGED).slots[2]},
            sha256="2" * 64,
        )
    )
    other.compare(X, Y, Z, U, MapValue(2, "x"))
    with pytest.raises(NotComparedError, match=r"2\.y"):  # with another layout
        other.set(2, y_mm=1.0)


@pytest.mark.parametrize("shown", ["12.6", "12.4", "13.6", "12.51", "-12.50", "12.49"])
def test_what_differs_is_refused_however_little(shown):
    machine = Machine()
    with pytest.raises(MapDiffersError, match=r"the map finds 12\.5000"):
        compare(machine.map, machine.found(), X, shown)


@pytest.mark.parametrize("shown", ["13", "12", "12.5", "+12,5"])
def test_too_few_digits_confirm_nothing(shown):
    machine = Machine()
    with pytest.raises(ConfigError, match="at least 2 digits after") as refused:
        compare(machine.map, machine.found(), X, shown)
    assert not isinstance(refused.value, MapDiffersError)


@pytest.mark.parametrize("shown", ["", "much", "1e1", "nan", "12.5 mm", "\u0661.00"])
def test_what_is_no_number_is_refused(shown):
    machine = Machine()
    with pytest.raises(ConfigError, match="is not a number"):
        compare(machine.map, machine.found(), X, shown)


@pytest.mark.parametrize("shown", ["12.50", "12.500", "12,5000"])
def test_what_agrees_to_enough_digits_confirms(shown):
    machine = Machine()
    assert compare(machine.map, machine.found(), X, shown).tells_tool


@pytest.mark.parametrize(("held", "shown"), [(8.126, "8.13"), (8.126, "8.12"), (-8.126, "-8.12")])
def test_a_screen_rounds_or_cuts_off(held, shown):
    machine = Machine()
    machine.enter(1, **{**TRUE[1], "x": held})
    assert compare(machine.map, machine.found(), X, shown)
    for off in (0.01, -0.02) if held > 0 else (-0.01, 0.02):
        wrong = f"{float(shown) + (off if shown.endswith('3') else 2 * off):.2f}"
        with pytest.raises(MapDiffersError):
            compare(machine.map, machine.found(), X, wrong)


def test_a_register_with_coarse_steps_needs_no_more_digits_than_it_has():
    right = load_map(LEVEL)
    slot = right.slots[1]
    tenths = replace(slot.components["u"], factor=0.1)
    coarse = replace(right, slots={1: replace(slot, components={**slot.components, "u": tenths})})
    assert compare(coarse, {U: 7.5}, U, "7.5")
    with pytest.raises(ConfigError, match="at least 1 digits after"):
        compare(coarse, {U: 7.0}, U, "7")


def test_equal_components_do_not_show_that_they_are_not_exchanged():
    same = {1: {**TRUE[1], "y": 5.0, "z": 5.0}, 2: {**TRUE[2], "y": 5.0, "z": 5.0}}
    machine = Machine(lambda right: changed(right, **EXCHANGED), true=same)
    with pytest.raises(ConfigError, match=r"so does 1\.z, 2\.y, 2\.z") as refused:
        machine.compare(Y)
    assert "test value" in refused.value.remedy
    wanted = {one.value: one for one in to_compare(machine.map, machine.found(), {})}
    assert wanted[X].test_mm_or_deg is None
    test = wanted[Y]
    assert "exchanged" in test.why_not
    before = machine.found()
    machine.enter(1, **{**same[1], "y": test.test_mm_or_deg})
    with pytest.raises(MapDiffersError, match=r"That is what 1\.z reads"):
        compare_test(machine.map, before, machine.found(), Y, f"{test.test_mm_or_deg:g}")


def test_equal_in_one_tool_alone_is_told_apart_in_the_other():
    same = {1: {**TRUE[1], "y": 5.0, "z": 5.0}, 2: TRUE[2]}
    machine = Machine(true=same)
    wanted = to_compare(machine.map, machine.found(), {})
    assert not any(one.why_not for one in wanted)
    assert {str(one.value) for one in wanted} >= {"2.y", "2.z"}
    # 1.y differs from 2.y, so it still shows the tool.
    made = machine.compare(Y).compared[Y]
    assert (made.tells_tool, made.tells_component) == (True, False)


def test_tools_that_are_alike_are_told_apart_by_a_value_that_differs():
    alike = {1: TRUE[1], 2: {**TRUE[1], "u": 90.25}}
    machine = Machine(true=alike)
    assert not machine.compare(X, Y, Z).knows_tool(1)
    with pytest.raises(NotComparedError):
        machine.controller.tools.require_writable(1)
    assert machine.compare(U).knows_tool(1)
    wanted = to_compare(machine.map, machine.found(), machine.compare(U).compared)
    assert [str(one.value) for one in wanted] == ["2.u"]


def test_a_component_that_is_zero_in_all_tools_needs_a_test_value():
    zero = {tool: {**held, "y": 0.0, "z": 0.0} for tool, held in TRUE.items()}
    for wrong in (None, lambda right: changed(right, **EXCHANGED)):
        machine = Machine(wrong, true=zero)
        with pytest.raises(ConfigError, match="a 0 confirms nothing"):
            compare(machine.map, machine.found(), Y, "0.00")
        held = machine.compare(X, U, MapValue(2, "x"))
        wanted = to_compare(machine.map, machine.found(), held.compared)
        assert [str(one.value) for one in wanted] == ["1.y", "1.z"]
        assert wanted[0].test_mm_or_deg != wanted[1].test_mm_or_deg
        before = machine.found()
        with pytest.raises(ConfigError):  # nothing was entered
            compare_test(machine.map, before, before, Y, "7.3")
        machine.enter(1, **{**zero[1], "y": wanted[0].test_mm_or_deg})
        entered = (machine.map, before, machine.found(), Y, f"{wanted[0].test_mm_or_deg:g}")
        if wrong is None:
            made = compare_test(*entered)
            confirm(machine.controller.who().name, machine.map, by="Kim", compared=[made])
            machine.enter(1, **zero[1])
            machine.set(1, y_mm=1.0)
            with pytest.raises(NotComparedError, match=r"1\.z"):
                machine.set(1, z_mm=1.0)
        else:
            with pytest.raises(MapDiffersError, match=r"1\.z"):
                compare_test(*entered)


def test_a_test_value_has_to_come_and_all_its_digits_count():
    machine = Machine()
    found = machine.found()
    with pytest.raises(ConfigError, match="already read"):
        compare_test(machine.map, found, found, X, "12.5")
    with pytest.raises(MapDiffersError):
        compare_test(machine.map, {**found, X: 0.0}, {**found, X: 12.46}, X, "12.5")


def test_a_map_that_was_changed_has_nothing_compared():
    machine = Machine()
    held = machine.compare(X)
    assert confirmation_of(machine.controller.who().name, machine.map) == held
    assert confirmation_of(machine.controller.who().name, changed(machine.map)) is None
