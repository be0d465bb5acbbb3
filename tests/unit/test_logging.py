"""Logs and traces of robolink: all traffic, no secret, and no effect on a change."""

import logging
import sys
from contextlib import contextmanager

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction, FaultPlan
from robolink_simulators.hosting.in_process.epson import register, unregister

import robolink
from robolink import ToolOffset, package_log
from robolink.controllers import SimpleController, SimpleMachine, registry, stop_now
from robolink.errors import RobolinkError
from robolink.journal import memory_journal
from robolink.model import Secret
from robolink.package_log import PackageLog
from robolink.timing import Deadline, SystemClock
from robolink.transport import SECRET_PLACEHOLDER, TracingTransport, Traffic, told_to
from tests._rows import each_row
from tests.unit.test_transport_trace import ScriptedTransport, soon

PASSWORD = "canary-7413"
LOGIN = f"$Login,{PASSWORD}\r\n".encode()


@pytest.fixture
def cell():
    """A simulated EPSON controller with a password."""
    simulator = EpsonSimulator(seed=1, password=Secret(PASSWORD))
    yield simulator, register("log-test", simulator)
    unregister("log-test")


class Heard(logging.Handler):
    """The log records since the test began."""

    def __init__(self):
        super().__init__()
        self.records = []

    def emit(self, record):
        self.records.append(record)

    def __iter__(self):
        return iter(self.records)


@contextmanager
def listening(level):
    logger, heard = logging.getLogger("robolink"), Heard()
    before = logger.level
    logger.setLevel(level)
    logger.addHandler(heard)
    try:
        yield heard
    finally:
        logger.removeHandler(heard)
        logger.setLevel(before)


@pytest.fixture
def heard():
    """Every log record of robolink, as it is made."""
    with listening(logging.DEBUG) as heard:
        yield heard


def decisions(records):
    return [record.getMessage() for record in records if record.levelno > logging.DEBUG]


def new_record(url):
    return memory_journal(url).log(url)


# The contents of the log.


def test_a_library_sets_up_nothing_but_a_handler_that_does_nothing():
    PackageLog("robolink").decided("a trial", controller="here")
    root = logging.getLogger("robolink")
    assert root.propagate
    assert {type(one) for one in root.handlers} == {logging.NullHandler}
    assert root.level == logging.NOTSET


def test_what_passes_is_logged_by_the_package_that_moves_it(cell, heard):
    _, url = cell
    with robolink.connect(url, password=PASSWORD) as controller:
        controller.status()
    passed = [one for one in heard if one.levelno == logging.DEBUG]
    assert {one.name for one in passed} == {"robolink.transport"}
    by_request = [(one.request, one.direction, one.getMessage()) for one in passed]
    assert by_request[0] == ("<secret>", "sent", f"{controller.identity}: sent <secret>")
    answered = [one for one in by_request if one[0] == r"$GetStatus\r\n"]
    assert [direction for _, direction, _ in answered[:2]] == ["sent", "received"]
    assert {one.controller for one in passed} == {controller.identity}


def test_a_change_is_told_in_a_few_decisions(cell, heard):
    _, url = cell
    with robolink.connect(url, password=PASSWORD) as controller:
        controller.tools.write(5, ToolOffset(1, 2, -3), expected=None)
        controller.tools.write(5, ToolOffset(1, 2, -3), expected=None)
        controller.tools.select(5)
        controller.stop()
    said = "\n".join(decisions(heard))
    for sentence in (
        "connected",
        "lease taken, epoch 1",
        "begun: set",
        "accepted: TLSet 5, XY(1.000, 2.000, -3.000, 0.000)",
        "verified: tool 5 reads back as written",
        "not written: it holds that value already",
        "selected: tool 5, after tool 1",
        "stop acknowledged: it rests",
    ):
        assert sentence in said, said
    assert len(decisions(heard)) <= 16, said


def test_an_outcome_that_is_not_known_and_what_recover_finds_are_told(heard):
    simulator = EpsonSimulator(seed=1)
    simulator.faults = FaultPlan([Fault(FaultAction.DROP_REPLY, match="TLSet 5, XY")])
    url, log = register("log-lost", simulator), new_record("log-lost")
    try:
        with robolink.connect(url, outcomes=log, timeout_s=0.5) as controller:
            with pytest.raises(robolink.errors.OutcomeUnknownError):
                controller.tools.write(5, ToolOffset(1, 2, -3), expected=None)
        doubt = next(one for one in heard if one.levelno == logging.WARNING)
        assert doubt.getMessage().endswith("no clear answer came; it was not sent again")
        assert doubt.request.startswith("TLSet 5")
        log = memory_journal("log-lost").log("log-lost")
        with robolink.connect(url, outcomes=log) as controller:
            from robolink.transaction import recover

            recover(controller)
    finally:
        unregister("log-lost")
    assert any("recovered: done, Tool 5 holds the new value" in one for one in decisions(heard))


def test_a_stop_from_outside_is_told(cell, heard):
    _, url = cell
    stop_now(url, password=PASSWORD)
    assert decisions(heard) == [f"{url.partition('?')[0]}: stop acknowledged: it rests"]


def test_nothing_is_made_while_nobody_listens(cell):
    _, url = cell
    with (
        listening(logging.WARNING) as heard,
        robolink.connect(url, password=PASSWORD) as controller,
    ):
        controller.status()
    assert heard.records == []


def test_a_process_without_logging_is_not_made_to_load_it(monkeypatch):
    monkeypatch.delitem(sys.modules, "logging")
    log = PackageLog("robolink.trial")
    assert not log.debugs()
    log.decided("nobody hears it", controller="here")
    assert "logging" not in sys.modules


# The records of a kind without bytes.


def test_a_kind_with_a_link_of_its_own_tells_its_requests(heard, monkeypatch):
    machine, told = SimpleMachine(tools={1: ToolOffset(12, -3.5, -20)}), []
    controller = SimpleController(machine, identity="acme+usb://17")
    # A controller without logging of its own: requests that the latch admits are logged all the
    # same.
    controller.latch.tell(lambda request: None)
    monkeypatch.setattr(registry, "find_opener", lambda _url: lambda *_terms: controller)
    opened = robolink.connect("acme+usb://17", trace=lambda *passage: told.append(passage[1:]))
    opened.tools.read(1)
    assert ("sent", b"tool 1") in told, told
    assert any(one.direction == "sent" and one.controller == "acme+usb://17" for one in heard)


def test_a_mailbox_in_this_process_tells_its_words():
    told = []
    trace = lambda _ns, direction, data: told.append((direction, data))  # noqa: E731
    with robolink.connect("softmotion+sim://log-words", trace=trace) as controller:
        controller.tools.write(5, ToolOffset(1, 2, -3), expected=None)
    assert {len(data) for direction, data in told if direction == "sent"} <= {2, 128}
    assert {len(data) for direction, data in told if direction == "received"} >= {72, 224}


# Contents that no log and no trace has.


@pytest.mark.fault("F71")
@pytest.mark.parametrize("split", ["", "?split=1"])
def test_a_login_that_is_bent_on_its_way_shows_nowhere(cell, heard, split):
    simulator, url = cell
    told, said = bytearray(), []
    for position in range(len(LOGIN)):
        for bit in (0, 3, 6):
            bend = Fault(FaultAction.GARBLE_REQUEST, match="", position=position, bit=bit)
            simulator.faults = FaultPlan([bend])
            try:
                robolink.connect(
                    url + split,
                    password=PASSWORD,
                    timeout_s=0.2,
                    trace=lambda _ns, _way, data: told.extend(data),
                ).close()
            except RobolinkError as error:
                said.append(f"{error!r} {error} {error.raw!r} {error.__cause__!r}")
            with pytest.raises(RobolinkError):
                stop_now(url + split, password="canary-wrong", timeout_s=0.2)
    assert said
    assert not shows(told.decode("latin-1") + "".join(said))
    assert not shows("".join(record.getMessage() + record.request for record in heard))
    assert b"!Login,13\r" in told  # the answer to a login with an altered password


def shows(text):
    """Whether a text contains six consecutive characters of the password."""
    return any(PASSWORD[at : at + 6] in text for at in range(len(PASSWORD) - 5))


def traffic_of(answers=(b"#Login,0\r\n",)):
    told = []
    traffic = Traffic("here", SystemClock(), sinks=(lambda _ns, _way, data: told.append(data),))
    traffic.show_answers(answers)
    return traffic, told


def test_the_usual_answer_to_a_login_is_told_in_however_many_pieces():
    traffic, told = traffic_of()
    traffic.sent(LOGIN, secret=True)
    for piece in (b"#Log", b"in,0\r", b"\n", b"#Login,0\r\n"):
        traffic.received(piece)
    assert b"".join(told) == SECRET_PLACEHOLDER + b"#Login,0\r\n#Login,0\r\n"


@each_row(
    "pieces",
    [
        (LOGIN,),
        (b"#Login,0\r\n!Lpgin,canary-7413,11\r\n",),
        (b"#Login,0\r\n", b"!,canary-7413,10\r\n"),
        (b"!Lo", b"gin,cana", b"ry-7413,11\r\n"),
    ],
)
def test_what_may_repeat_a_login_is_not_told(pieces):
    traffic, told = traffic_of()
    traffic.sent(LOGIN, secret=True)
    for piece in pieces:
        traffic.received(piece)
    assert not shows(b"".join(told).decode())
    assert SECRET_PLACEHOLDER in told[1:]


def test_an_echo_that_comes_after_the_next_request_is_not_told():
    traffic, told = traffic_of()
    traffic.sent(LOGIN, secret=True)
    traffic.received(b"#Login,0\r\n")
    traffic.sent(b"$GetStatus\r\n")
    for piece in (b"!,canar", b"y-74", b"13,10\r\n", b"#GetStatus,00100000001,0000\r\n"):
        traffic.received(piece)
    assert not shows(b"".join(told).decode())
    assert told[-1] == b"#GetStatus,00100000001,0000\r\n"


def test_a_line_break_in_what_comes_forges_no_line(heard):
    link = TracingTransport(ScriptedTransport(b"#x\r\n2026 INFO"), Traffic("here", SystemClock()))
    link.receive(deadline=soon(link))
    assert [one.getMessage() for one in heard] == [r"here: received #x\r\n2026 INFO"]


# Listeners that fail.


class Broken(logging.Handler):
    """A handler that raises, as a third-party one may."""

    def handle(self, record):
        raise OSError(28, "No space left on device")


def test_a_handler_that_fails_ends_no_change_and_is_told_once(cell, capsys):
    _, url = cell
    package_log._told.clear()
    logger, broken = logging.getLogger("robolink"), Broken()
    logger.addHandler(broken)
    logger.setLevel(logging.DEBUG)
    try:
        with robolink.connect(url, password=PASSWORD) as controller:
            controller.tools.write(5, ToolOffset(1, 2, -3), expected=None)
    finally:
        logger.removeHandler(broken)
        logger.setLevel(logging.NOTSET)
    assert capsys.readouterr().err.count("No space left on device") == 1


def test_a_trace_that_fails_ends_no_change_and_is_told_once(cell, capsys):
    _, url = cell
    package_log._told.clear()

    def full(*_passage):
        raise OSError(28, "No space left on device")

    with robolink.connect(url, password=PASSWORD, trace=full) as controller:
        controller.tools.write(5, ToolOffset(1, 2, -3), expected=None)
        assert controller.tools.read(5) == ToolOffset(1, 2, -3)
    assert capsys.readouterr().err.count("No space left on device") == 1


def test_links_that_are_opened_in_blocks_one_within_the_other_tell_all():
    inner, outer = [], []
    with told_to(lambda *passage: outer.append(passage)) as around:
        with told_to(None, lambda *passage: inner.append(passage)):
            link = robolink.transport.open_transport("epson+sim://log-nested")
    link.send(b"$GetStatus\r\n", deadline=Deadline.after(link.clock, 1))
    link.close()
    assert len(inner) == len(outer) == len(around.links) == 1
