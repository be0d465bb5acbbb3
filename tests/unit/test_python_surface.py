"""The Python surface: names, mistaken arguments, representations, the tree of errors."""

import contextlib
import copy
import importlib
import inspect
import pickle
import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import MISSING, FrozenInstanceError, dataclass, field, fields, replace
from typing import Any, ClassVar, cast

import numpy as np
import pytest
from robolink_simulators.faults import Fault, FaultAction, FaultPlan

import robolink
from robolink import ANY, Pose, ToolOffset, calibration, drift, errors, journal, methods
from robolink.calibration_run import WriteSubject
from robolink.controllers import SimpleController
from robolink.deprecation import GONE_IN, OLD_NAMES, deprecated
from robolink.errors import ConfigError, ToolIndexError
from robolink.journal import open_journal
from robolink.methods import OneTouchSource, TwoPoseSource, measure_two_pose
from robolink.model import (
    EntryKind,
    MotionProfile,
    NewEntry,
    Path,
    WorkBox,
    describe_offset,
    describe_pose,
)
from robolink.procedures import (
    InputSource,
    LazySource,
    ManualPinSource,
    ProofBasis,
    ProvesAgain,
    TouchesFurther,
    TouchPlan,
)
from robolink.procedures.source import touching_further
from robolink.runner import foreseen_steps
from robolink.testing import PaperCell
from robolink.transaction import Wanted, change_tools
from robolink.version import VERSION
from tests._rows import each_row

# A deprecated public name works for one more version, and names its successor.

ROWS = [(package, name, new) for package, row in OLD_NAMES.items() for name, new in row.items()]
IDS = [f"{package}.{name}" for package, name, _ in ROWS]


def told(act):
    """Return the warnings of an act, and its result."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        given = act()
    return caught, given


def tried(act, *args, **kwargs):
    """Call a function that may fail with an argument; the warning comes first."""
    with contextlib.suppress(AttributeError):
        act(*args, **kwargs)


def imported(package, name):
    names: dict[str, object] = {}
    exec(compile(f"from {package} import {name} as it", __file__, "exec"), names)
    return names["it"]


def the_new(path):
    home, _, name = path.rpartition(".")
    return getattr(importlib.import_module(home), name)


@each_row(("package", "name", "new"), ROWS)
def test_an_old_name_is_the_same_thing_and_warns_once_where_it_is_used(package, name, new):
    for act in (
        lambda: imported(package, name),
        lambda: getattr(importlib.import_module(package), name),
    ):
        caught, given = told(act)
        assert given is the_new(new)
        (one,) = caught
        assert one.category is DeprecationWarning
        assert one.filename == __file__
        assert f"{package}.{name} is now {new}." in str(one.message)


def test_what_a_package_hands_out_does_not_name_the_old():
    for package, row in OLD_NAMES.items():
        module = importlib.import_module(package)
        assert not {*row} & {*dir(module), *getattr(module, "__all__", ())}


def test_what_never_was_is_no_old_name():
    for package in OLD_NAMES:
        with pytest.raises(AttributeError, match=f"module '{package}' has no attribute 'nothing'"):
            importlib.import_module(package).nothing  # noqa: B018 - the look-up is the test


def test_a_pickle_that_names_the_old_place_is_read():
    caught, found = told(lambda: pickle.loads(b"crobolink.config\nProblem\n."))
    assert found is the_new("robolink.files.toml.Problem")
    assert len(caught) == 1


def test_the_old_names_end_with_the_version_that_the_warning_says():
    now, gone = (tuple(map(int, text.split("."))) for text in (VERSION, GONE_IN))
    assert now < gone, "empty OLD_NAMES, and say in which version the next ones go"


class Tolerance:
    """A class with a deprecated method."""

    limit_mm = 0.2

    def exceeded(self, by_mm):
        return by_mm > self.limit_mm

    @deprecated("Tolerance.exceeded")
    def doubts(self, by_mm):
        """Return whether it is."""
        return self.exceeded(by_mm)

    @property
    @deprecated("Tolerance.limit_mm")
    def most_mm(self):
        return self.limit_mm


def test_an_old_method_does_what_it_did_and_warns_where_it_is_called():
    tolerance = Tolerance()
    for act, given, message in (
        (lambda: tolerance.doubts(0.3), True, "Tolerance.doubts is now Tolerance.exceeded."),
        (lambda: tolerance.most_mm, 0.2, "Tolerance.most_mm is now Tolerance.limit_mm."),
    ):
        caught, found = told(act)
        assert found == given
        (one,) = caught
        assert (one.category, one.filename) == (DeprecationWarning, __file__)
        assert str(one.message).startswith(message)
    assert Tolerance.doubts.__doc__ == "Return whether it is."


def test_a_look_at_a_journal_under_its_old_name_is_the_same_and_warns():
    here = journal.signature_here("1.0")
    caught, old = told(lambda: journal.GlancingLog("epson://192.0.2.1:5000", signature=here))
    new = journal.open_log("epson://192.0.2.1:5000", durable=True, signature=here, glance=True)
    assert type(old) is type(new)
    assert old.signature == here
    assert [one.category for one in caught] == [DeprecationWarning]


@pytest.mark.parametrize("given", [(), (8,)], ids=["by name", "last"])
def test_a_sentence_with_a_sign_of_its_own_warns_and_has_it(given):
    sentence: Callable[..., str] = calibration.seating_sentence
    caught, found = told(
        lambda: sentence(0.1, *given, "~") if given else sentence(0.1, 8, sign="~")
    )
    assert found == sentence(0.1, 8).replace("+-", "~") != sentence(0.1, 8)
    assert [(one.category, one.filename) for one in caught] == [(DeprecationWarning, __file__)]


def test_sentences_that_are_yielded_have_the_sign_too():
    at, tip_mm = "2026-11-22T08:00:00Z", {"x": 12.3, "y": -3.9}
    change = drift.MeasuredChange(7, at, "c-1", 1, "", "", tip_mm, None, 0.05, 0.024, 0.064)
    sentences: Callable[..., Iterator[str]] = drift.last_statements
    caught, found = told(lambda: list(sentences([change], sign="~")))
    assert found == [one.replace("+-", "~") for one in drift.last_statements([change])]
    assert "~0.024" in found[0]
    assert len(caught) == 1


@each_row(
    "name",
    [
        "accurate_sentence",
        "largest_row_sentence",
        "proved_statements",
        "repeatable_sentence",
        "seating_sentence",
        "statement_sentences",
    ],
)
def test_every_sentence_that_took_a_sign_takes_it_and_nothing_else(name):
    sentence = getattr(calibration, name)
    assert "sign" not in inspect.signature(sentence).parameters
    nothing = [None] * len(inspect.signature(sentence).parameters)
    caught, _ = told(lambda: tried(sentence, *nothing, sign="~"))
    assert [str(one.message).partition(" is now")[0] for one in caught] == [f"sign of {name}"]
    with pytest.raises(TypeError, match="positional argument"):
        sentence(*nothing, "~", "more")


def a_source_with_old_hooks():
    @dataclass(frozen=True)
    class Once(ManualPinSource):
        sentence: ClassVar[str] = "A pin is touched."
        adds_touch: ClassVar[bool] = False
        touch: TouchPlan = field(default_factory=TouchPlan)

        def _steps(self, stored, *, live):
            return measure_two_pose(self._touching(live=live), stored=stored)

        def _further_steps(self, here, taken, again, stored):
            return TwoPoseSource(self.touch).further_steps(here, taken, again, stored)

    return Once()  # type: ignore[abstract]  # made of the old name


def test_a_source_of_touches_with_hooks_by_their_old_names_measures_and_shows_as_before():
    caught, source = told(a_source_with_old_hooks)
    assert [str(one.message).partition(". ")[0] for one in caught] == [
        f"a_source_with_old_hooks.<locals>.Once.{old} is now {new}"
        for old, new in (
            ("_steps", "steps"),
            ("_further_steps", "further_steps"),
            ("adds_touch", "can_add_touch"),
        )
    ]
    assert source.can_add_touch is False
    assert {one.filename for one in caught} == {__file__}
    stored = ToolOffset(12, -4, -20)
    cell = PaperCell(Pose(300, 100, 20, 0), ToolOffset(12.3, -3.9, -20), (310, 95, -40))
    caught, found = told(lambda: cell.run(source.steps(stored)))
    assert {str(one.message).partition(" is now ")[2].partition(".")[0] for one in caught} == {
        "touch"
    }
    again = cell.run(source.further_steps(cell.here, found.inputs, 1, stored))
    for result in (found, again):
        assert result.offset.x_mm == pytest.approx(12.3)
    shown = told(lambda: foreseen_steps(source.procedure(stored, cell.here), cell.here))[1]
    whole = foreseen_steps(TwoPoseSource().procedure(stored, cell.here), cell.here)
    assert [one.step for one in shown] == [one.step for one in whole]


def test_whether_a_touch_can_be_added_is_still_told_by_its_old_name():
    solver: Any = None
    for read in (
        TwoPoseSource(),
        OneTouchSource(solver),
        LazySource(TwoPoseSource, sentence="two touches"),
        WriteSubject((), (), can_add_touch=False),
    ):
        caught, said = told(lambda one=read: one.adds_touch)
        assert said is False
        assert [str(one.message).partition(". ")[0].partition(".")[2] for one in caught] == [
            "adds_touch is now can_add_touch"
        ]


def test_a_source_without_a_base_of_ours_that_says_the_old_name_touches_further():
    class Foreign:
        adds_touch = True

        def further(self, context, stored, result, again):
            return context, stored, result, again

    caught, source = told(lambda: touching_further(Foreign()))
    assert [str(one.message).partition(". ")[0].rpartition(".")[2] for one in caught] == [
        "adds_touch is now can_add_touch"
    ]
    assert isinstance(source, TouchesFurther)
    assert source.can_add_touch is True
    given: Any = (1, 2, 3, 4)
    assert source.further(*given) == given
    assert touching_further(TwoPoseSource()) == TwoPoseSource()
    assert touching_further(object()) is None


def test_a_source_of_an_input_with_its_hook_by_the_old_name_measures_and_shows_as_before():
    @dataclass(frozen=True)
    class Plan:
        until_mm: float | None = 0.1
        retake: bool = True

    def made():
        @dataclass(frozen=True)
        class Switched(InputSource[Plan]):
            plan: Plan = Plan()

            def _steps(self, stored, here, plan):
                return stored, here, plan

            def proof(self, context, tool, result, *, tip, tolerance_mm):
                raise NotImplementedError

        return Switched()  # type: ignore[abstract]  # made of the old name

    caught, source = told(made)
    assert [str(one.message).partition(". ")[0].rpartition(".")[2] for one in caught] == [
        "_steps is now steps"
    ]
    assert source.steps(1, 2) == (1, 2, Plan())
    assert source.procedure(1, 2) == (1, 2, Plan(None, retake=False))


def test_a_source_without_a_proof_is_refused_when_it_is_made_not_when_it_has_measured():
    class Unproved(ProvesAgain):
        pass

    with pytest.raises(TypeError, match="proof_of"):
        Unproved()  # type: ignore[abstract]


def test_a_source_that_proves_in_its_own_way_needs_no_other_hook():
    class ByHand(ProvesAgain):
        def proof(self, context, tool, result, *, tip, tolerance_mm):
            return context, tool, result, tip, tolerance_mm

    basis: Any = ProofBasis(*cast("Any", ("context", 1, "result", "tip", 0.1)))
    made: Any = ByHand()  # type: ignore[abstract]  # proof_of is made of proof
    assert made.proof_of(basis) == ("context", 1, "result", "tip", 0.1)


# A script's mistaken argument is named for what it is, and nothing is sent.


@pytest.fixture
def controller(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    with robolink.connect("epson+sim://arguments") as controller:
        yield controller


def test_a_path_in_a_word_is_that_path_and_no_other(controller, monkeypatch):
    word: Any = "straight"
    assert MotionProfile(path=word).path is Path.STRAIGHT
    with pytest.raises(ConfigError, match="no path 'curved'"):
        MotionProfile(path=cast("Any", "curved"))
    admit, seen = controller.latch.admit, list[str]()

    def admitted(kind, request):
        seen.append(request)
        admit(kind, request)

    monkeypatch.setattr(controller.latch, "admit", admitted)
    here = controller.groups[0].pose()
    box = WorkBox.around(here, xy_mm=5, below_mm=5, above_mm=5)
    above = replace(here, z_mm=here.z_mm + 1)
    controller.groups[0].move_to(above, MotionProfile(path=word), box=box).wait(timeout_s=60)
    assert any("Move XY" in one for one in seen)


def test_numbers_of_numpy_are_numbers(controller):
    given: list[Any] = [np.float32(1.5), np.float64(2.25), np.int32(3), np.int64(30)]
    offset = ToolOffset(*given)
    assert offset == ToolOffset(1.5, 2.25, 3.0, 30.0)
    receipt = controller.tools.write(1, offset, expected=ANY)
    assert receipt.read_back == offset


WIDTHS = [np.float16, np.float32, np.float64, np.longdouble, np.array]
WIDTHS += [getattr(np, f"{sign}int{bits}") for sign in ("", "u") for bits in (8, 16, 32, 64)]


@each_row("width", WIDTHS)
def test_a_number_of_any_width_becomes_one_of_python(width):
    offset, pose = ToolOffset(width(3), 1), Pose(1, width(3), 0, 0)
    assert (offset, pose) == (ToolOffset(3, 1), Pose(1, 3, 0, 0))
    assert {type(it) for it in (*offset.components(), *pose.coordinates())} == {int, float}


@each_row(
    "value",
    [np.float32("nan"), np.float64("inf"), "1", None, 1j, True, np.True_, np.zeros((99, 99))],
)
def test_what_is_no_number_is_refused(value):
    with pytest.raises(ConfigError, match=r"^x_mm is not a number: .{1,60}\. Give a finite"):
        ToolOffset(value)


@pytest.mark.parametrize("tool", ["1", 1.0, True, None])
def test_a_tool_is_named_by_its_number(controller, tool):
    for act in (
        controller.tools.read,
        controller.tools.select,
        lambda it: controller.tools.clear(it, expected=ANY),
        lambda it: controller.tools.write(it, ToolOffset(), expected=ANY),
    ):
        with pytest.raises(ToolIndexError, match="by its number") as caught:
            act(tool)
        assert type(tool).__name__ in caught.value.what


def test_an_offset_is_a_tool_offset(controller):
    before = controller.tools.read(1)
    with pytest.raises(ConfigError, match="An offset is a ToolOffset, not tuple"):
        controller.tools.write(1, (1, 2, 3, 0, 0, 0), expected=ANY)
    with pytest.raises(ConfigError, match="ToolOffset, None or ANY, not"):
        controller.tools.write(1, ToolOffset(1, 2, 3), expected=(1, 2, 3))
    assert controller.tools.read(1) == before


@pytest.mark.parametrize("target", [(1, 2, 3, 4), ToolOffset(1, 2, 3, 4), None])
def test_a_target_is_a_pose(controller, target):
    box = WorkBox(-500, 500, -500, 500, -500, 500)
    with pytest.raises(ConfigError, match="A target is a Pose of numbers"):
        controller.groups[0].move_to(target, MotionProfile(), box=box)


MISTAKEN: list[Any] = [(1, 2, 3, 4), [1, 2, 3, 4], np.ones(4), "1,2,3,4"]
HERE = Pose(300, 0, 100, 0)
THERE = replace(HERE, u_deg=180)
TAKES: dict[str, Callable[[Any], object]] = {
    "x_mm": lambda it: Pose(it, 0, 0, 0),
    "pose": lambda it: describe_pose(it),
    "other": lambda it: ToolOffset().matches(it, 0.1),
    "offset": lambda it: describe_offset(it),
    "first": lambda it: calibration.solve_two_pose(it, HERE),
    "stored": lambda it: calibration.solve_two_pose(HERE, THERE, stored=it),
    "poses[0]": lambda it: calibration.solve_n_angle([it, HERE, THERE]),
    "poses[1]": lambda it: calibration.solve_pivot([HERE, it, HERE, THERE]),
    "tip": lambda it: calibration.flange_pose(it, ToolOffset()),
    "x_min_mm": lambda it: WorkBox(it),
    "speed_percent": lambda it: MotionProfile(speed_percent=it),
    "path": lambda it: MotionProfile(it),
    "expected": lambda it: Wanted(1, ToolOffset(), it),
}


@each_row("argument", TAKES)
def test_what_is_no_value_is_refused_by_the_name_of_its_argument(argument):
    for given in MISTAKEN:
        with pytest.raises(ConfigError) as caught:
            TAKES[argument](given)
        assert argument in caught.value.what
        assert caught.value.remedy


MOVING = ("measure_", "verify_b", "learn_", "trace_")
PROCEDURES = [it for it in sorted(vars(methods)["__all__"]) if it.startswith(MOVING)]


@each_row("name", PROCEDURES)
def test_a_procedure_refuses_at_its_call_what_would_show_once_the_robot_has_moved(name):
    procedure = getattr(methods, name)
    asked = inspect.signature(procedure).parameters.values()
    given = {it.name: (1, 2, 3) for it in asked if it.default is it.empty}
    with pytest.raises(ConfigError, match=r"^\w+ is not a \w+ but \(1, 2, 3\)"):
        procedure(**given)


def test_an_offset_in_a_tuple_is_refused_before_the_first_touch():
    stored: Any = (12, -4, -20)
    with pytest.raises(ConfigError, match=r"^stored is not a ToolOffset"):
        measure_two_pose(TouchPlan(turn_deg=120), stored=stored)


def test_a_wrong_call_is_told_by_python_itself():
    solve: Any = calibration.solve_two_pose
    with pytest.raises(TypeError, match="missing"):
        solve(HERE)
    with pytest.raises(TypeError, match="unexpected"):
        solve(HERE, THERE, poses=())


@pytest.mark.parametrize("given", MISTAKEN, ids=lambda it: type(it).__name__)
def test_nothing_is_sent_for_a_box_a_profile_or_a_change_that_is_none(controller, given):
    group, box = controller.groups[0], WorkBox(-500, 500, -500, 500, -500, 500)
    sent = controller.exchanges
    for name, act in (
        ("box", lambda: group.move_to(HERE, MotionProfile(), box=given)),
        ("profile", lambda: group.move_to(HERE, given, box=box)),
        (r"wanted\[0\]", lambda: change_tools(controller, given)),
        ("a", lambda: controller.tools.same(given, ToolOffset())),
    ):
        with pytest.raises(ConfigError, match=rf"^{name} is not a "):
            act()
    assert controller.exchanges == sent


@each_row("url", [5, None, b"epson+tcp://192.168.0.1"])
def test_what_is_neither_url_nor_controller_is_refused(url):
    with pytest.raises(ConfigError, match="neither a URL nor a controller"):
        robolink.connect(url)


def test_the_action_of_a_fault_may_be_a_word_and_nothing_else():
    plan = FaultPlan(seed=1)
    plan.add(Fault(cast("Any", "drop_reply")))
    assert plan.pending[0].action is FaultAction.DROP_REPLY
    with pytest.raises(ConfigError, match="no fault 'drop_replies'"):
        Fault(cast("Any", "drop_replies"))


# A controller at a prompt: its name, and its last read state.


@pytest.mark.parametrize(
    ("url", "kind"),
    [
        ("epson+sim://shown", "Epson"),
        ("softmotion+sim://shown", "SoftMotion"),
    ],
)
def test_a_controller_says_which_it_is_and_in_what_state(url, kind):
    with robolink.connect(url) as controller:
        identity, sent = controller.identity, controller.exchanges
        assert repr(controller.tools) == f"<{kind}ToolTable of {identity}>"
        assert repr(controller.groups[0]) == f"<{kind}Group of {identity}>"
        assert repr(controller) == f"<{kind}Controller {identity}: state not read>"
        assert controller.exchanges == sent
        state = controller.status().state.value
        assert repr(controller) == f"<{kind}Controller {identity}: {state} when read last>"
        controller.stop()
        assert repr(controller) == f"<{kind}Controller {identity}: held by a stop>"
        controller.release_stop()
        assert repr(controller).endswith("when read last>")
    assert repr(controller) == f"<{kind}Controller {identity}: closed>"


def test_one_of_another_package_says_so_too():
    with SimpleController() as controller:
        assert repr(controller).startswith("<SimpleController memory")
    assert repr(controller).endswith(": closed>")


def test_a_journal_says_where_it_is_and_its_log_of_whom(tmp_path):
    url = "epson+tcp://192.0.2.1:5000"
    with closing(open_journal(str(tmp_path / "journal.db"))) as journal:
        assert repr(journal) == f"<Journal {journal.location}>"
        log = journal.log(url)
        assert repr(log) == f"<JournalOutcomeLog of {url} in {journal.location}>"
        log.append(NewEntry(EntryKind.RAW, verdict="seen"))
    with closing(open_journal(str(tmp_path / "journal.db"), read_only=True)) as journal:
        assert repr(journal).endswith(", read only>")


def test_a_pose_takes_and_stores_each_of_its_fields_although_its_init_is_written_out():
    rows = fields(Pose)
    asked = [(it.name, it.default) for it in inspect.signature(Pose).parameters.values()]
    unset = [inspect.Parameter.empty if it.default is MISSING else it.default for it in rows]
    assert asked == list(zip([it.name for it in rows], unset, strict=True))
    values: dict[str, Any] = {it.name: float(number) for number, it in enumerate(rows)}
    made = Pose(*values.values())
    for one in (made, Pose(**values), replace(made), copy.copy(made)):
        assert {it.name: getattr(one, it.name) for it in rows} == values
    assert pickle.loads(pickle.dumps(made)) == made
    with pytest.raises(FrozenInstanceError):
        setattr(made, rows[-1].name, 0)


# The tree of errors drawn at the top of the module matches the code.


def drawn():
    """Return each class in the drawing with its parent."""
    path: list[str] = []
    found: dict[str, str | None] = {}
    for line in str(errors.__doc__).splitlines():
        match = re.match(r"    ((?:│   |    )*)(?:[├└]── )?([A-Z]\w*Error(?: · \w+Error)*)\b", line)
        if match is None:
            continue
        names = match[2].split(" · ")
        depth = len(match[1]) // 4 + ("──" in line.partition(names[0])[0])
        for name in names:
            found[name] = path[depth - 1] if depth else None
        path = [*path[:depth], names[-1]]
    return found


def made(kind):
    """Return an error with the arguments that its class requires."""
    asked = [*inspect.signature(kind).parameters.values()]
    needed = [it for it in asked if it.default is it.empty and it.kind is not it.VAR_KEYWORD]
    last = [it for it in needed if it.kind is it.KEYWORD_ONLY]
    first = [it.name for it in needed if it.kind is it.POSITIONAL_OR_KEYWORD]
    return kind(*first, **{it.name: it.name for it in last})


def test_every_error_can_be_copied_and_pickled():
    for name in errors.__all__:
        kind = getattr(errors, name)
        if not issubclass(kind, errors.RobolinkError):
            continue
        error = made(kind)
        error.concern("192.0.2.1", "request")
        for other in (copy.copy(error), pickle.loads(pickle.dumps(error))):
            assert (type(other), str(other), vars(other)) == (kind, str(error), vars(error))


def test_every_class_is_drawn_under_its_parent():
    there: dict[str, str | None] = {
        name: kind.__bases__[0].__name__
        for name, kind in vars(errors).items()
        if isinstance(kind, type) and issubclass(kind, errors.RobolinkError)
    }
    there["RobolinkError"] = None
    assert drawn() == there
