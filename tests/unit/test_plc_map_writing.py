"""Writing through a map: the three handshakes, refusals, and lost answers."""

from itertools import count
from struct import pack, unpack

import pytest

from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan
from robolink.errors import (
    BusyError,
    ConfigError,
    LimitError,
    NotReadyError,
    OutcomeUnknownError,
    ReadBackError,
    RejectedError,
    RemoteProtocolError,
    ToolChangedError,
    ToolError,
)
from robolink.methods import PointsSource
from robolink.model import ANY, PROOFS, ToolOffset, Verdict
from robolink.register_maps import RegisterTable
from robolink.runner import Question
from robolink.transaction import Wanted, change_tools, recover
from tests.unit._plc_bench import COMMIT_BIT, LEVEL, NO_HANDSHAKE, Bench

_names = count()


@pytest.fixture(autouse=True)
def _own_state_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))


def bench_of(path, **options):
    return Bench(path, identity=f"plc+modbus-tcp://bench-{next(_names)}:502", **options)


@pytest.fixture
def commit_bit():
    return bench_of(COMMIT_BIT)


@pytest.fixture
def level():
    return bench_of(LEVEL)


@pytest.fixture
def no_handshake():
    return bench_of(NO_HANDSHAKE)


NEW = ToolOffset(1.5, -2.25, 3.0, 45.0)


def test_a_commit_bit_follows_the_values_and_is_taken_back(commit_bit):
    with commit_bit.connect() as controller:
        before = controller.tools.read(1)
        receipt = controller.tools.write(1, NEW, expected=before)
    assert receipt.read_back == NEW
    assert commit_bit.program.in_force[1] == {"x": 1.5, "y": -2.25, "z": 3.0, "u": 45.0}
    assert commit_bit.program.takeovers == 1
    kinds = [(table, address) for table, address, _ in commit_bit.plc.writes]
    assert kinds == [("holding", 100), ("coil", 2000), ("coil", 2000)]
    assert [values for *_, values in commit_bit.plc.writes[1:]] == [[1], [0]]
    assert not controller.outcomes.open_markers()


# With its words in the other order X is 3.14 mm: a possible value of a tool, too.
A_TOOL_IN_BOTH_ORDERS = ToolOffset(unpack("<f", pack("<HH", 0x4049, 0x4120))[0], 0.0, 0.0)


@pytest.mark.fault("F33")
def test_a_program_that_lays_its_words_otherwise_since_the_write_leaves_it_unproved(
    commit_bit, monkeypatch
):
    with commit_bit.connect() as controller:
        before = controller.tools.read(1)
        as_laid = commit_bit.client._read

        def swapped_since(table, address, count):
            words = as_laid(table, address, count)
            if commit_bit.program.takeovers and address in (20, 100):
                return tuple(words[at ^ 1] for at in range(count))
            return words

        monkeypatch.setattr(commit_bit.client, "_read", swapped_since)
        with pytest.raises(OutcomeUnknownError) as unproved:
            controller.tools.write(1, A_TOOL_IN_BOTH_ORDERS, expected=before)
        assert "probe" in str(unproved.value.__cause__)
        assert controller.outcomes.open_markers()
        assert not list(controller.outcomes.recorded(tool=1, kinds=PROOFS))
    with commit_bit.connect() as again:
        recover(again)
        assert again.tools.read(1) == A_TOOL_IN_BOTH_ORDERS
        assert not again.outcomes.open_markers()


def test_a_level_request_names_the_tool_and_stays_until_the_acknowledge(level):
    with level.connect() as controller:
        controller.tools.write(2, NEW, expected=ANY)
        controller.tools.write(1, NEW, expected=ANY)
    assert level.program.takeovers == 2
    assert [w[2] for w in level.plc.writes if w[1] == 601] == [[2], [1]]
    assert [w[2] for w in level.plc.writes if w[1] == 600] == [[1], [0], [1], [0]]


def test_without_a_handshake_one_request_writes_it_all(no_handshake):
    with no_handshake.connect() as controller:
        controller.tools.write(1, ToolOffset(1.5, -2.25), expected=ANY)
    assert no_handshake.plc.writes == [("holding", 40, [1500, 65536 - 2250])]
    assert no_handshake.program.in_force[1] == {"x": 1.5, "y": -2.25}


def test_a_value_that_the_registers_hold_already_is_not_written_again(no_handshake):
    with no_handshake.connect() as controller:
        controller.tools.write(1, ToolOffset(1.5, -2.25), expected=ANY)
        again = controller.tools.write(1, ToolOffset(1.5004, -2.2496), expected=ToolOffset(9))
    assert again.skipped
    assert len(no_handshake.plc.writes) == 1


def test_a_value_that_somebody_changed_is_not_written_over(commit_bit):
    with commit_bit.connect() as controller:
        before = controller.tools.read(1)
        commit_bit.program.set_tool(1, {"x": 5.0})
        with pytest.raises(ToolChangedError, match=r"holds X 5\.000"):
            controller.tools.write(1, NEW, expected=before)
    assert commit_bit.plc.writes == []


def test_a_refused_value_is_named_and_the_registers_show_the_old_one_again(commit_bit):
    with commit_bit.connect() as controller:
        before = controller.tools.read(1)
        commit_bit.program.refuse_with = 7
        with pytest.raises(RejectedError, match="outside the limits set at the HMI") as refused:
            controller.tools.write(1, NEW, expected=before)
        assert refused.value.code == 7
        assert controller.tools.read(1) == before
        assert not controller.outcomes.open_markers()
        assert controller.tools.write(1, NEW, expected=before).read_back == NEW


def test_an_error_number_of_which_the_map_says_nothing_is_still_named(level):
    with level.connect() as controller:
        level.program.refuse_with = 99
        with pytest.raises(RejectedError, match="error 99, which the map does not explain"):
            controller.tools.write(1, NEW, expected=ANY)


def test_the_second_of_two_tools_is_refused_and_both_hold_their_old_values(commit_bit):
    with commit_bit.connect() as controller:
        before = controller.tools.read_all()
        plan = [Wanted(tool, NEW, before[tool]) for tool in (1, 2)]
        taken = commit_bit.program.written

        def refuse_second(now_ns):
            if commit_bit.program.takeovers == 1:
                commit_bit.program.written = taken
                commit_bit.program.refuse_with = 3
            taken(now_ns)

        commit_bit.program.written = refuse_second
        with pytest.raises(RejectedError, match="home position"):
            change_tools(controller, plan)
        assert controller.tools.read_all() == before
        assert not controller.outcomes.open_markers()
    assert commit_bit.program.in_force[1]["x"] == before[1].x_mm


def test_a_plc_that_does_not_answer_leaves_the_outcome_unknown_and_no_request(commit_bit):
    with commit_bit.connect() as controller:
        commit_bit.program.silent = True
        with pytest.raises(OutcomeUnknownError, match="did not answer the request within 2 s"):
            controller.tools.write(1, NEW, expected=ANY)
        assert len(controller.outcomes.open_markers()) == 1
        with pytest.raises(OutcomeUnknownError, match="did not finish"):
            controller.require_settled("a move")
    assert commit_bit.program.memory.read(RegisterTable.COIL, range(2000, 2001)) == [0]


def test_registers_alone_do_not_prove_a_takeover_and_recovery_asks_once_more(commit_bit):
    with commit_bit.connect() as controller:
        commit_bit.program.silent = True
        with pytest.raises(OutcomeUnknownError):
            controller.tools.write(1, NEW, expected=ANY)
        commit_bit.program.silent = False
        (marker,) = controller.outcomes.open_markers()
        finding = controller.resolver.examine(marker)
        assert finding.verdict is Verdict.NOT_FINISHED
        assert "accept" in finding.action
        recovery = recover(controller)
        assert not recovery.left
        assert not controller.outcomes.open_markers()
    assert commit_bit.program.takeovers == 1
    assert commit_bit.program.in_force[1]["x"] == NEW.x_mm


def test_a_plc_that_refuses_in_the_recovery_gets_its_old_registers_back(commit_bit):
    with commit_bit.connect() as controller:
        before = controller.tools.read(1)
        commit_bit.program.silent = True
        with pytest.raises(OutcomeUnknownError):
            controller.tools.write(1, NEW, expected=ANY)
        commit_bit.program.silent, commit_bit.program.refuse_with = False, 7
        with pytest.raises(RejectedError, match="error 7"):
            recover(controller)
        assert controller.tools.read(1) == before
        (finding,) = recover(controller).settled
        assert finding.verdict is Verdict.NOT_FINISHED
        assert not controller.outcomes.open_markers()


def test_old_values_in_the_registers_do_not_prove_that_the_plc_uses_them(commit_bit):
    """A roll-back that a failing journal could not record wrote them, and asked for nothing."""
    bench, span = commit_bit, commit_bit.map.slots[1].span
    with bench.connect() as controller:
        before = controller.tools.read(1)
        old = bench.client.read_holding(span.start, len(span))
        bench.client.lose = {2}
        with pytest.raises(OutcomeUnknownError):
            controller.tools.write(1, NEW, expected=ANY)
    assert bench.program.in_force[1]["x"] == NEW.x_mm
    bench.plc.program.memory.write(RegisterTable.HOLDING, span.start, list(old))
    with bench.connect() as controller:
        (finding,) = recover(controller).settled
        assert finding.verdict is Verdict.NOT_FINISHED
        assert controller.tools.read(1) == before
    assert bench.program.in_force[1]["x"] == before.x_mm


@pytest.mark.parametrize("write", range(3))
@pytest.mark.parametrize("map_name", ["commit_bit", "level"])
def test_a_lost_answer_to_any_write_is_settled_by_a_later_process(request, map_name, write):
    bench = request.getfixturevalue(map_name)
    with bench.connect() as controller:
        bench.client.lose = {write}
        with pytest.raises(OutcomeUnknownError, match="may or may not have run"):
            controller.tools.write(1, NEW, expected=ANY)
    with bench.connect() as controller:
        assert len(controller.outcomes.open_markers()) == 1
        recovery = recover(controller)
        settled = [finding.verdict for finding in (*recovery.settled, *recovery.left)]
        half_written = map_name == "level" and write == 0
        assert settled == [Verdict.CONFLICT if half_written else Verdict.NOT_FINISHED]
        if not half_written:
            assert controller.tools.read(1) == NEW
            assert not controller.outcomes.open_markers()
    if not half_written:
        assert bench.program.in_force[1]["x"] == NEW.x_mm


def test_without_a_handshake_a_lost_answer_is_settled_by_reading(no_handshake):
    with no_handshake.connect() as controller:
        no_handshake.client.lose = {0}
        with pytest.raises(OutcomeUnknownError):
            controller.tools.write(1, ToolOffset(1.5, -2.25), expected=ANY)
    with no_handshake.connect() as controller:
        (finding,) = recover(controller).settled
        assert finding.verdict is Verdict.DONE
    assert len(no_handshake.plc.writes) == 1


def test_a_modbus_refusal_of_the_request_puts_the_registers_back(commit_bit):
    with commit_bit.connect() as controller:
        before = controller.tools.read(1)
        commit_bit.client.refuse = {1}
        with pytest.raises(RejectedError, match="illegal data value"):
            controller.tools.write(1, NEW, expected=before)
        assert controller.tools.read(1) == before
        assert not controller.outcomes.open_markers()


def test_a_look_that_is_refused_after_the_request_leaves_the_outcome_unknown(commit_bit):
    with commit_bit.connect() as controller:
        read = commit_bit.client.read_discrete

        def read_discrete(address, count):
            if commit_bit.program.memory.is_on(commit_bit.map.commit.request):
                raise RejectedError("server busy", code=6)
            return read(address, count)

        commit_bit.client.read_discrete = read_discrete
        with pytest.raises(OutcomeUnknownError, match=r"accepted the value:\n    server busy"):
            controller.tools.write(1, NEW, expected=ANY)
        assert len(controller.outcomes.open_markers()) == 1
        assert controller.tools.read(1) == NEW


def test_a_preview_names_everything_that_would_be_written(commit_bit, level):
    with commit_bit.connect() as controller:
        assert controller.tools.preview_write(1, ToolOffset(1.0)) == (
            "write 40101 (address 100): 0000 3F80 0000 0000 0000 0000 0000 0000",
            "switch 02001 (address 2000) on",
            "switch 02001 (address 2000) off",
        )
    with level.connect() as controller:
        assert controller.tools.preview_clear(2)[-3:] == (
            "write 40602 (address 601): 2",
            "switch 40601 (address 600) on",
            "switch 40601 (address 600) off",
        )


def test_registers_that_cannot_be_put_back_leave_the_outcome_unknown(commit_bit):
    with commit_bit.connect() as controller:
        commit_bit.client.refuse = {1, 2}
        with pytest.raises(OutcomeUnknownError, match="could not restore the values"):
            controller.tools.write(1, NEW, expected=ANY)
        assert len(controller.outcomes.open_markers()) == 1


def test_a_request_that_a_dead_client_left_is_taken_back_first(commit_bit):
    commit_bit.program.memory.write(RegisterTable.COIL, 2000, [1])
    commit_bit.program.written(0)
    with commit_bit.connect() as controller:
        controller.tools.write(1, NEW, expected=ANY)
    assert [w[2] for w in commit_bit.plc.writes if w[1] == 2000] == [[0], [1], [0]]


def test_an_error_or_a_busy_plc_holds_a_write_back(commit_bit):
    memory, commit = commit_bit.program.memory, commit_bit.map.commit
    with commit_bit.connect() as controller:
        memory.switch(commit.busy, True)
        with pytest.raises(BusyError, match="busy"):
            controller.tools.write(1, NEW, expected=ANY)
        memory.switch(commit.busy, False)
        memory.switch(commit.error, True)
        with pytest.raises(NotReadyError, match="in error") as refused:
            controller.tools.write(1, NEW, expected=ANY)
        assert refused.value.reason == "fault"
        assert controller.status().state == "fault"
        assert not controller.outcomes.open_markers()
    assert commit_bit.plc.writes == []


def test_a_plc_in_error_or_busy_is_not_ready(commit_bit):
    memory, commit = commit_bit.program.memory, commit_bit.map.commit
    with commit_bit.connect() as controller:
        assert controller.status().ready
        for bit in (commit.error, commit.busy):
            memory.switch(bit, True)
            assert not controller.status().ready
            memory.switch(bit, False)


def test_a_missing_permit_holds_a_write_back(commit_bit):
    commit_bit.program.permit(False)
    with commit_bit.connect() as controller:
        with pytest.raises(NotReadyError, match="10004"):
            controller.tools.write(1, NEW, expected=ANY)
        assert controller.condition()["permitted"] is False
    assert commit_bit.plc.writes == []


def test_nothing_is_written_before_a_person_confirmed_a_map_without_a_probe():
    bench = bench_of(NO_HANDSHAKE, confirmed=False)
    with bench.connect() as controller:
        with pytest.raises(ConfigError, match="Nobody has compared"):
            controller.tools.write(1, ToolOffset(1.5), expected=ANY)
    assert bench.plc.writes == []


def test_a_probe_that_went_wrong_after_connecting_holds_a_write_back(commit_bit):
    with commit_bit.connect() as controller:
        commit_bit.program.memory.zero(RegisterTable.INPUT)
        with pytest.raises(RemoteProtocolError, match=r"should be 12\.3456, but reads 0"):
            controller.tools.write(1, NEW, expected=ANY)
    assert commit_bit.plc.writes == []


@pytest.mark.fault("F37")
def test_values_that_no_register_can_hold_are_refused_before_anything_is_sent(no_handshake):
    with no_handshake.connect() as controller:
        sent = controller.exchanges
        with pytest.raises(LimitError, match="40041"):
            controller.tools.write(1, ToolOffset(40.0), expected=ANY)
        with pytest.raises(ToolError, match="keeps no Z"):
            controller.tools.write(1, ToolOffset(1, 1, 0.1), expected=ANY)
        assert controller.exchanges == sent


def test_registers_that_do_not_keep_what_is_written_are_noticed(no_handshake):
    with no_handshake.connect() as controller:
        before = controller.tools.read(1)
        no_handshake.program.written = lambda now_ns: no_handshake.program.set_tool(1, {"x": 7.0})
        with pytest.raises(ReadBackError, match=r"reads back as X 7\.000"):
            controller.tools.write(1, ToolOffset(1.5), expected=before)


@pytest.mark.fault("F30")
def test_all_zeros_are_a_lost_link_or_no_tool_as_the_map_says(no_handshake, level):
    no_handshake.program.memory.zero(RegisterTable.HOLDING)
    with no_handshake.connect() as controller:
        with pytest.raises(RemoteProtocolError, match="after a lost link"):
            controller.tools.read(1)
        with pytest.raises(ToolError, match="cannot be made undefined"):
            controller.tools.clear(1, expected=ANY)
    level.program.memory.zero(RegisterTable.HOLDING)
    with level.connect() as controller:
        assert controller.tools.read(2) is None
        controller.tools.write(2, NEW, expected=None)
        assert controller.tools.clear(2, expected=NEW).read_back is None


ZERO = ToolOffset()


@pytest.mark.parametrize("value", [ZERO, ToolOffset(0.00004), ToolOffset(y_mm=-0.00004)])
@pytest.mark.parametrize(
    ("name", "meaning"), [("no_handshake", "a lost link"), ("level", "no tool")]
)
def test_a_value_that_would_read_back_as_none_is_refused_before_it_is_sent(
    request, name, meaning, value
):
    bench = request.getfixturevalue(name)
    with bench.connect() as controller:
        before = controller.tools.read(1)
        for act in (
            lambda: controller.tools.write(1, value, expected=before),
            lambda: controller.tools.preview_write(1, value),
        ):
            with pytest.raises(LimitError, match=f"takes for {meaning}") as refusal:
                act()
            assert 'all_zero = "tool"' in refusal.value.remedy
        assert controller.tools.read(1) == before
    assert bench.plc.writes == []


def test_an_unconfirmed_map_is_refused_before_anything_else_is_looked_at():
    bench = bench_of(NO_HANDSHAKE, confirmed=False)
    with bench.connect() as controller:
        controller.status()
        before = controller.exchanges
        # A request with a second fault is refused for this one first.
        for tool, value in ((1, NEW), (1, ZERO)):
            for act in (
                lambda tool=tool: controller.tools.require_writable(tool),
                lambda tool=tool, value=value: controller.tools.write(tool, value, expected=ANY),
                lambda tool=tool, value=value: controller.tools.preview_write(tool, value),
                lambda tool=tool: controller.tools.clear(tool, expected=ANY),
                lambda tool=tool, value=value: change_tools(
                    controller, [Wanted(tool, value, None)]
                ),
            ):
                with pytest.raises(ConfigError, match="Nobody has compared"):
                    act()
        assert controller.exchanges == before
    assert bench.plc.writes == []


class Nobody:
    """A person who must not be disturbed."""

    def tell(self, text: str) -> None:
        """Accept no message."""
        raise AssertionError(text)

    def ask(self, question: str, kind: Question) -> None:
        """Accept no question."""
        raise AssertionError(question)

    def poll(self, wait_s: float) -> str | None:
        """Answer nothing."""
        return None


def test_an_unconfirmed_map_is_refused_before_a_person_has_measured_anything():
    def measured():
        raise AssertionError("nobody was to measure")

    plan = ChangePlan((ToolPlan(1, PointsSource(measured)),), ask_before_write=False)
    with bench_of(NO_HANDSHAKE, confirmed=False).connect() as controller:
        with pytest.raises(ConfigError, match="Nobody has compared"):
            NozzleChange(controller, plan, operator=Nobody()).run(write=True)


@pytest.mark.fault("F37")
def test_a_number_that_cannot_be_true_is_not_taken_for_an_offset(commit_bit):
    with commit_bit.connect() as controller:
        commit_bit.program.memory.write(RegisterTable.HOLDING, 100, [0x4148, 0x0000])
        with pytest.raises(RemoteProtocolError, match=r"X at 40101 \(address 100\) reads"):
            controller.tools.read(1)


@pytest.mark.fault("F31")
def test_registers_that_change_between_two_looks_are_looked_at_again(commit_bit):
    with commit_bit.connect() as controller:
        wanted = controller.tools.read(1)
        read, torn = commit_bit.client.read_holding, iter([1])

        def read_holding(address, count):
            words = read(address, count)
            return (*words[:3], words[3] ^ next(torn, 0), *words[4:])

        commit_bit.client.read_holding = read_holding
        assert controller.tools.read(1) == wanted
        turns = count()
        commit_bit.client.read_holding = lambda address, n: (next(turns) % 7,) * n
        with pytest.raises(RemoteProtocolError, match="change at every reading"):
            controller.tools.read(1)


def test_a_recovery_waits_as_long_as_a_request_may_be_under_way(commit_bit):
    with commit_bit.connect() as controller:
        old = controller.tools.read(1)
        commit_bit.client.lose = {0}
        with pytest.raises(OutcomeUnknownError):
            controller.tools.write(1, NEW, expected=old)
    program = commit_bit.program
    program.set_tool(1, dict(zip("xyzu", old.components(), strict=False)))  # as if it had not come
    with commit_bit.connect() as controller:
        clock, sleep, slept = commit_bit.client.clock, commit_bit.client.clock.sleep, []

        def until_it_comes(seconds):
            slept.append(seconds)
            sleep(seconds)
            if len(slept) == 1:  # the registers of the lost write, late
                commit_bit.client.write_registers(*_of(NEW))

        clock.sleep = until_it_comes
        (finding,) = recover(controller).settled
    assert slept[0] == commit_bit.map.commit.timeout_s
    assert finding.verdict is Verdict.NOT_FINISHED
    assert program.in_force[1] == {"x": 1.5, "y": -2.25, "z": 3.0, "u": 45.0}


def test_registers_that_are_not_on_record_are_told_before_a_change(commit_bit):
    told: list[str] = []
    with commit_bit.connect() as controller:
        change_tools(controller, [Wanted(1, NEW, controller.tools.read(1))], tell=told.append)
        assert ["on record is nothing" in one for one in told] == [True]
        told.clear()
        again = ToolOffset(1.6, -2.25, 3.0, 45.0)
        change_tools(controller, [Wanted(1, again, NEW)], tell=told.append)
        assert told == []
        commit_bit.client.write_registers(*_of(NEW))  # and the PLC is never asked to take them
        change_tools(controller, [Wanted(1, again, NEW)], tell=told.append)
    (doubt,) = told
    assert "The PLC shows X 1.500" in doubt
    assert "for tool 1; on record" in doubt
    assert "on record is X 1.600" in doubt
    assert "HMI" in doubt


def test_a_request_that_names_its_tool_brings_no_other_into_force(level):
    told: list[str] = []
    with level.connect() as controller:
        controller.tools.write(2, NEW, expected=ANY)
        other = ToolOffset(1.6, -2.25, 3.0, 45.0)
        level.program.set_tool(2, dict(zip("xyzu", other.components(), strict=False)))
        change_tools(controller, [Wanted(1, NEW, controller.tools.read(1))], tell=told.append)
    assert ["tool 1" in one for one in told] == [True]


def _of(offset):
    """Return address and words of tool 1 in the map with a commit bit."""
    values = offset.components()[:4]
    words = [word for value in values for word in reversed(unpack(">HH", pack(">f", value)))]
    return 100, words
