"""A second terminal beside a session that works: who it is and what it does, nothing to recover."""

from dataclasses import replace

import pytest
from robolink_cli import main
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.journal import LeaseHolder, open_journal
from robolink.journal._lease_view import BootClock, this_process
from robolink.model import Marker, MarkerKind, Signature
from robolink.timing import NS_PER_S

DETAILS = {"tool": 1, "now": 0}
MARKER = Marker("a", MarkerKind.SELECTION, "calibration of tool 1", "then", DETAILS)


@pytest.fixture
def plc(state_folder):
    with serve_modbus_tcp(SoftMotionSimulator(seed=3)) as host:
        with robolink.connect(host.url) as controller:
            assert controller.outcomes.open_markers() == ()
        yield host.url


@pytest.fixture
def run(capsys):
    def ran(*arguments):
        code = main.run([*arguments])
        return code, capsys.readouterr().err

    return ran


class LateClock(BootClock):
    """As it was 20 s ago."""

    def now_ns(self):
        return super().now_ns() - 20 * NS_PER_S


def session(plc, *, clock=None, **holder):
    """Return the log of another process that calibrates."""
    own = this_process()
    other = replace(LeaseHolder("ann", "pc-7", pid=own.pid, boot=own.boot), **holder)
    log = open_journal().log(
        plc, holder=other, clock=clock, signature=Signature(operator="Ann Lee")
    )
    log.begin(MARKER)
    return log


def test_it_is_told_who_is_at_work_and_never_to_recover(plc, run):
    session(plc)
    for command in (["status"], ["tool", "list"], ["where"]):
        code, err = run("-c", plc, *command)
        assert code == 0
        assert "Ann Lee (ann, process" in err
        assert "on pc-7) has been at work on this controller since" in err
        assert "calibration of tool 1" in err
        assert "It is still working" in err
        assert "recover' puts" not in err


@pytest.mark.parametrize(
    "command",
    [["recover"], ["recover", "--yes"], ["recover", "--forget", "--yes"], ["jog", "x+1", "--yes"]],
)
def test_what_would_interfere_is_refused_with_the_holder_s_name(plc, run, command):
    session(plc)
    code, err = run("-c", plc, *command)
    assert code == 5
    assert "Ann Lee" in err
    assert len(open_journal().open_markers()) == 1


def test_who_only_holds_the_lease_is_told_too(plc, run):
    own = this_process()
    holder = LeaseHolder(os_user="ann", host="pc-7", pid=own.pid, boot=own.boot)
    with open_journal().log(plc, holder=holder).hold("a question to the person"):
        assert "a question to the person" in run("-c", plc, "status")[1]


def test_a_holder_on_another_computer_is_named_without_waiting(plc, run):
    session(plc, boot="another start of another system")
    code, err = run("-c", plc, "status")
    assert code == 0
    assert "has been at work on this controller" in err
    assert "Watch it for a while" in err


@pytest.mark.parametrize("gone", ["silent", "ended"])
def test_what_a_dead_session_left_is_to_be_recovered(plc, run, gone):
    if gone == "silent":
        session(plc, clock=LateClock())
    else:
        own = this_process()
        namespace = own.process_start.partition(" ")[0]
        session(plc, pid=own.pid, process_start=f"{namespace} 1")
    code, err = run("-c", plc, "status")
    assert code == 0
    assert '" recover' in err
    assert "at work" not in err


def test_doctor_does_not_send_anybody_to_recover_beside_it(plc, run, capsys):
    session(plc)
    main.run(["doctor"])
    shown = capsys.readouterr()
    assert "at work on this controller" in shown.out + shown.err
    assert "recover" not in shown.out + shown.err
