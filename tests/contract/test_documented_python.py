"""Every Python block of README and the pages runs as printed, against simulators.

Only the addresses are replaced, by those of simulators. A maker in this file supplies the names
that a block assumes (a controller, an operator, a file); a block without a maker fails.
"""

import logging
import re
import shutil
import textwrap
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import pytest
from robolink_simulators.cell.tip_switches import LightBeam
from robolink_simulators.epson.arm.kinematics import inverse
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.in_process import epson as in_process
from robolink_simulators.hosting.in_process import softmotion as plc_in_process
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

import robolink
from robolink import ToolOffset
from robolink.controllers import SimpleMachine
from robolink.controllers.registry import ConnectionTerms
from robolink.journal import memory_journal
from robolink.model import TIP, Hand, Pose, Secret, Signature, Spot, SpotUnit, WorkBox, rotate_xy
from robolink.protocols.epson_text import VariableType
from robolink.protocols.mailbox.exports import program_texts
from robolink.runner import RunSettings, ask_yes_no
from robolink.sensing import open_sensor, seen_once
from robolink.transport import parse_url

pytest_plugins = ["pytester"]

ROOT = Path(__file__).parents[2]
PAGES = [
    *(ROOT / name for name in ("README.md", "simulators/README.md")),
    *sorted(ROOT.glob("docs/*.md")),
    *sorted(ROOT.glob("docs/reference/*.md")),
]
FENCED = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
ADDRESS = re.compile(r"(epson\+tcp|softmotion\+modbus-tcp)://192\.168\.0\.\d+:\d+")


def blocks() -> dict[str, str]:
    """Return the blocks by page and place, such as ``README.md 2``, addresses replaced."""
    found = {}
    for page in PAGES:
        for number, block in enumerate(FENCED.findall(page.read_text(encoding="utf-8")), start=1):
            shown = page.relative_to(ROOT).as_posix().removeprefix("docs/")
            found[f"{shown} {number}"] = ADDRESS.sub(simulated, block)
    return found


def simulated(address: re.Match[str]) -> str:
    return {"epson+tcp": "epson+sim", "softmotion+modbus-tcp": "softmotion+sim"}[
        address[1]
    ] + "://documented"


BLOCKS = blocks()


@contextmanager
def epson(seed: int = 3, **given: Any) -> Iterator[EpsonSimulator]:
    simulator = EpsonSimulator(seed=seed, **given)
    in_process.register("documented", simulator)
    try:
        yield simulator
    finally:
        in_process.unregister("documented")


@contextmanager
def softmotion() -> Iterator[SoftMotionSimulator]:
    simulator = SoftMotionSimulator(seed=3)
    plc_in_process.register("documented", simulator)
    try:
        yield simulator
    finally:
        plc_in_process.unregister("documented")


class Agrees:
    """An operator who confirms everything."""

    def tell(self, text: str) -> None:
        """Accept a message."""

    def ask(self, question: str, kind: object) -> None:
        """Accept a question."""

    def poll(self, wait_s: float) -> str:
        """Answer."""
        return "y"


def with_password(stack: ExitStack) -> dict[str, Any]:
    stack.enter_context(epson(password=Secret("...")))
    return {}


def one_client(stack: ExitStack) -> dict[str, Any]:
    stack.enter_context(epson())
    return {"robolink": robolink, "replace": replace}


def two_tools(stack: ExitStack) -> dict[str, Any]:
    simulator = stack.enter_context(epson())
    controller = stack.enter_context(robolink.connect("epson+sim://documented"))
    controller.tools.write(2, ToolOffset(5, 6, -70), expected=None)
    looked: list[ToolOffset | None] = []
    new_1, new_2 = ToolOffset(12.25, -3.5, -20), ToolOffset(5.25, 6, -70)
    return {
        "controller": controller,
        "old_1": controller.tools.read(1),
        "old_2": controller.tools.read(2),
        "new_1": new_1,
        "new_2": new_2,
        "look_at_the_parts": lambda: looked.append(simulator.machine.tools.get(2)),
        "then": lambda: looked == [new_2] and simulator.machine.tools.get(1) == new_1,
    }


def undelivered(stack: ExitStack) -> dict[str, Any]:
    simulator = stack.enter_context(epson())

    def written_once() -> bool:
        return simulator.machine.tools.get(1) == ToolOffset(12.5, -3.5, -20)

    return {"then": written_once}


def above_two_beams(stack: ExitStack) -> dict[str, Any]:
    simulator = stack.enter_context(epson())
    world, arm = simulator.world, simulator.machine.arm
    for number, heading in ((3, 0.0), (4, 90.0)):
        world.connect(number, LightBeam((300.2, 79.9, -60.0), heading))
    pin = world.tips[1] or ToolOffset(0, 0, 0)
    above = Pose(295 - pin.x_mm, 85 - pin.y_mm, -45 - pin.z_mm, 0.0)
    arm.place(inverse(arm.model, above, Hand.RIGHT), 0)
    controller = stack.enter_context(robolink.connect("epson+sim://documented"))
    controller.tools.select(0)

    def found() -> bool:
        stored = simulator.machine.tools.get(1) or ToolOffset(0, 0, 0)
        return abs(stored.x_mm - pin.x_mm) < 0.02 and abs(stored.y_mm - pin.y_mm) < 0.02

    return {
        "controller": controller,
        "operator": Agrees(),
        "settings": RunSettings(WorkBox()),
        "pin": pin,
        "then": found,
    }


def with_variables(stack: ExitStack) -> dict[str, Any]:
    simulator = stack.enter_context(epson())
    variables = simulator.variables
    variables.declare("g_count", VariableType.LONG, value=3)
    variables.declare("g_heights", VariableType.REAL, 3, 7)
    variables.declare("g_offset", VariableType.REAL)
    simulator.panel.raise_alarm(501)
    return {"robolink": robolink, "then": lambda: simulator.machine.outputs.get(5)}


def a_map(stack: ExitStack) -> dict[str, Any]:
    path = ROOT / "examples" / "plc-maps" / "commit-bit.toml"
    return {"robolink": robolink, "path": path}


def a_recipe(stack: ExitStack) -> dict[str, Any]:
    shutil.copy(ROOT / "examples" / "recipes" / "scara-pin.toml", Path.cwd())
    return {}


def a_journal(stack: ExitStack) -> dict[str, Any]:
    with robolink.connect(stack.enter_context(serve_modbus_tcp(SoftMotionSimulator())).url) as plc:
        plc.tools.write(1, ToolOffset(1, 2, 3), expected=plc.tools.read(1))
    return {}


def a_line_of_cells(stack: ExitStack) -> dict[str, Any]:
    stack.enter_context(epson())
    Path("robolink.toml").write_text('[cells.line3-a]\nurl = "epson+sim://documented"\n')
    given = dict[str, Any]()
    given["then"] = lambda: (given["check"].cell, given["check"].failure) == ("line3-a", None)
    return given


def four_poses(stack: ExitStack) -> dict[str, Any]:
    tip, given = ToolOffset(12.5, -3.25, -20), dict[str, Any]()
    poses = []
    for u_deg in (0.0, 90.0, 180.0, -90.0):
        dx_mm, dy_mm = rotate_xy(tip.x_mm, tip.y_mm, u_deg)
        poses.append(Pose(300 - dx_mm, 80 - dy_mm, -60, u_deg))
    given |= {"poses": poses, "then": lambda: abs(given["result"].offset.x_mm - 12.5) < 1e-6}
    return given


def one_plc(stack: ExitStack) -> dict[str, Any]:
    simulator = stack.enter_context(softmotion())
    wanted = {"x_mm": 1.25, "y_mm": -0.4, "z_mm": 60.0}
    return {"then": lambda: wanted.items() <= simulator.truth()["stored"]["3"].items()}


def a_connected_plc(stack: ExitStack) -> dict[str, Any]:
    simulator = stack.enter_context(softmotion())
    plc = stack.enter_context(robolink.connect("softmotion+sim://documented"))
    return {"plc": plc, "then": lambda: simulator.plc.group.movements_started == 1}


def an_acme_camera(stack: ExitStack) -> dict[str, Any]:
    given = dict[str, Any]()
    acme = SimpleNamespace(grab=lambda: SimpleNamespace(tip_mm=(300.1, 80.2)))

    def seen() -> bool:
        with open_sensor(given["source"].sensor) as camera:
            return seen_once(camera, TIP, pictures=3) == Spot(300.1, 80.2)

    given |= {"acme": acme, "then": seen}
    return given


def a_camera_for_a_recipe(stack: ExitStack) -> dict[str, Any]:
    shutil.copy(ROOT / "examples" / "recipes" / "pick-nozzle-camera.toml", Path.cwd())
    simulator = stack.enter_context(epson(seed=1))  # the cell of the example
    simulator.machine.motors_on = True
    inner = stack.enter_context(open_sensor("epson+sim://documented"))
    asked, ended = list[int](), list[str]()

    class Counted:
        """The cell's camera, given as an object because no name opens it."""

        identity, unit = "acme-camera 00123", inner.unit
        resolution_px, settle_s = inner.resolution_px, inner.settle_s

        def see(self, mark: int = TIP) -> Any:
            asked.append(mark)
            return inner.see(mark)

        def close(self) -> None:
            ended.append("closed")

    def found() -> bool:
        stored, tip = simulator.machine.tools.get(1), simulator.world.tips[1]
        assert stored is not None
        assert tip is not None
        near = abs(stored.x_mm - tip.x_mm) < 0.02 and abs(stored.y_mm - tip.y_mm) < 0.02
        return near and len(asked) > 6 and not ended

    return {"operator": Agrees(), "camera": Counted(), "then": found}


def a_panel(stack: ExitStack) -> dict[str, Any]:
    given = dict[str, Any]()
    shown: list[str] = []
    panel = SimpleNamespace(show=lambda text, **_how: shown.append(text), next_line=lambda _s: "y")

    def answered() -> bool:
        operator = given["Panel"]()
        yes = ask_yes_no(operator, "Write it?", lambda: operator.poll(1.0))
        return yes and shown == ["Write it?"]

    given |= {"panel": panel, "then": answered}
    return given


def an_acme_arm(stack: ExitStack) -> dict[str, Any]:
    """An arm whose movement lasts until it was polled three times."""
    inner, left = SimpleMachine(tools={1: ToolOffset(12.0, -3.5, -20.0)}), [0]
    done = list[str]()

    def start_to(target: Pose) -> None:
        left[0] = 3
        done.append("go")
        inner.go(target)

    def busy() -> bool:
        left[0] = max(0, left[0] - 1)
        return left[0] > 0

    def stop() -> None:
        left[0] = 0
        done.append("stop")

    def then() -> bool:
        """Whether it moved and stopped, its tool is restored, and its opener uses the record."""
        record = memory_journal("acme").log("acme")
        terms = ConnectionTerms(Signature(), outcomes=record)
        with given["open_acme"](parse_url("acme+usb://17"), terms) as controller:
            kept = controller.outcomes is record
        return kept and {"go", "stop"} == {*done} and inner.tools[1] == ToolOffset(12, -3.5, -20)

    given: dict[str, Any] = {
        "acme": SimpleNamespace(
            tool=inner.read,
            set_tool=inner.store,
            tool_number=inner.in_force,
            use_tool=inner.select,
            where_the_tip_is=inner.pose,
            start_to=start_to,
            busy=busy,
            stop=stop,
        ),
        "then": then,
    }
    return given


def logged_as_shown(stack: ExitStack) -> dict[str, Any]:
    shown = {name: logging.getLogger(name) for name in ("robolink", "robolink.transport")}
    for logger in shown.values():
        stack.callback(logger.setLevel, logger.level)
    return {
        "then": lambda: (
            [one.getEffectiveLevel() for one in shown.values()] == [logging.INFO, logging.DEBUG]
        )
    }


def nothing(stack: ExitStack) -> dict[str, Any]:
    return {}


def as_in_a_wheel(stack: ExitStack) -> dict[str, Any]:
    """Put the pages where a wheel has them; in a checkout they are at the top."""
    stack.enter_context(patch("importlib.resources.files", lambda _: ROOT))
    return {}


def a_fault_plan(stack: ExitStack) -> dict[str, Any]:
    page = (ROOT / "docs" / "fault-plans.md").read_text(encoding="utf-8")
    Path("lost.toml").write_text(page.partition("```toml\n")[2].partition("```")[0])
    stack.callback(in_process.unregister, "faulty-cell")
    given = dict[str, Any]()
    given["then"] = lambda: given["simulator"].faults.fired and len(given["drawn"]) > 10
    return given


MAKERS = {
    "README.md 1": with_password,
    "simulators/README.md 1": nothing,
    "reference/sensors.md 1": above_two_beams,
    "reference/sensors.md 2": nothing,
    "reference/cameras.md 1": lambda stack: {"SpotUnit": SpotUnit, "Spot": Spot, "TIP": TIP},
    "accuracy.md 1": a_line_of_cells,
    "camera-and-board.md 1": nothing,
    "custom-kinematics.md 1": nothing,
    "extending.md 1": two_tools,
    "extending.md 2": one_client,
    "extending.md 3": an_acme_camera,
    "extending.md 4": a_camera_for_a_recipe,
    "extending.md 5": a_panel,
    "extending.md 6": nothing,
    "extending.md 7": an_acme_arm,
    "extending.md 8": logged_as_shown,
    "fault-plans.md 1": a_fault_plan,
    "monitor-only.md 1": with_variables,
    "journal.md 1": a_journal,
    "json.md 1": as_in_a_wheel,
    "json.md 2": nothing,
    "commands.md 1": undelivered,
    "plc-maps.md 1": a_map,
    "recipes.md 1": a_recipe,
    "reference/simulated-softmotion.md 1": nothing,
    "reference/simulated-softmotion.md 2": nothing,
    "solvers.md 1": four_poses,
    "solvers.md 2": nothing,
    "mailbox.md 1": one_plc,
    "mailbox.md 2": a_connected_plc,
    "spel-programs.md 1": nothing,
    "spel-programs.md 2": nothing,
    "reference/backups.md 1": nothing,
    "reference/stopping.md 1": with_password,
    "reference/stopping.md 2": with_password,
    "reference/structured_text.md 1": nothing,
}

TESTS = {name for name, block in BLOCKS.items() if "\ndef test_" in f"\n{block}"}


def test_every_block_is_run_and_no_python_stands_outside_of_a_fence():
    assert MAKERS.keys() | TESTS == BLOCKS.keys()
    assert not MAKERS.keys() & TESTS
    assert {
        "reference/structured_text.md 2",
        "testing.md 1",
        "testing.md 2",
        "testing.md 3",
        "testing.md 4",
        "testing.md 5",
        "controllers.md 1",
    } == TESTS
    for page in PAGES:
        rest = FENCED.sub("", page.read_text(encoding="utf-8"))
        assert not re.search(r"^    (with robolink|from robolink|import robolink)", rest, re.M), (
            page
        )


@pytest.mark.parametrize("name", MAKERS)
def test_a_block_runs(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with ExitStack() as stack:
        given = MAKERS[name](stack)
        then = given.pop("then", lambda: True)
        exec(compile(BLOCKS[name], name, "exec"), given)  # its task: run the printed code
        assert then()


def test_the_test_of_an_integrator_s_program_passes_and_sees_a_changed_line(pytester):
    folder = pytester.mkdir("our-plc")
    for name, text in program_texts().items():
        (folder / name).write_text(text)
    pytester.makepyfile(BLOCKS["reference/structured_text.md 2"])
    pytester.runpytest_inprocess("-p", "no:cacheprovider").assert_outcomes(passed=1)
    ours = folder / "robolink_program.st"
    loses = "RL_Kept.memory.slots[2].tool[2] := 0.0;"
    ours.write_text(ours.read_text().replace("\ntable(", f"\n{loses}\ntable("))
    result = pytester.runpytest_inprocess("-p", "no:cacheprovider")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["E *ReadBack*", "*robolink wire: softmotion*", "*WRITE_TOOL*"])


def test_the_tests_of_the_pages_pass_in_somebody_else_s_run(pytester):
    blocks = [f"testing.md {number}" for number in range(1, 6)]
    pytester.makepyfile("".join(BLOCKS[name] for name in blocks))
    result = pytester.runpytest_inprocess("-p", "no:cacheprovider", "--strict-markers")
    result.assert_outcomes(passed=7)


def test_the_test_of_a_recording_passes_and_sees_a_difference(pytester):
    recorded = textwrap.dedent(
        """
        import robolink
        from pathlib import Path
        from types import SimpleNamespace
        from robolink.timing import wall_label
        from robolink.transport import DialogueLog, format_dialogue

        log = DialogueLog("a simulator", wall_label())
        with robolink.connect("epson+sim://the-day", trace=log) as controller:
            controller.status()
        Path("day.jsonl").write_text(format_dialogue(log.dialogue))

        def run(url):
            with robolink.connect(url) as controller:
                controller.status()

        our_program = SimpleNamespace(run=run)
        """
    )
    pytester.makepyfile(recorded + BLOCKS["controllers.md 1"])
    pytester.runpytest_inprocess("-p", "no:cacheprovider").assert_outcomes(passed=1)
