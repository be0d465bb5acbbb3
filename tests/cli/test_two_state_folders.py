"""Two state folders on one controller: the controller supplies what neither folder records."""

from pathlib import Path

import pytest
from robolink_cli import main
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.errors import LeaseHeldError
from robolink.journal import close_files, open_journal


class Killed(BaseException):
    """The end of a process, which no error handler sees."""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a function that switches to another state folder."""
    monkeypatch.chdir(tmp_path)

    def use(name):
        close_files()
        monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / name))

    use("first")
    return use


@pytest.fixture
def run(capsys):
    def ran(*arguments):
        code = main.run([*arguments])
        shown = capsys.readouterr()
        return code, shown.out + shown.err

    return ran


def kill_a_calibration(url, cut):
    """Leave tool 0 selected, as a process does that is killed at a touch."""
    controller = robolink.connect(url)
    with pytest.raises(Killed), controller.preserved("calibration of tool 1"):
        controller.tools.select(0)
        cut(controller)
        raise Killed
    controller.outcomes.close()


@pytest.fixture
def epson(folder):
    simulator = EpsonSimulator(seed=4)
    with serve_tcp(simulator) as host:
        Path("robolink.toml").write_text(
            f'[cells.a]\nurl = "{host.url}"\ntool = 1\nremote_timeout_s = 60\n'
            'remote_timeout_confirmed_by = "Ann, today"\n'
        )
        yield simulator, host.url


def test_a_jog_from_the_other_folder_asks_before_it_moves_the_flange(epson, folder, run):
    simulator, url = epson
    kill_a_calibration(url, lambda controller: controller._link.session.close())
    folder("second")
    code, said = run("-c", "a", "status")
    assert code == 0
    assert "Tool 0 is selected, but the cell a uses tool 1." in said
    assert open_journal().open_markers() == ()
    stood = simulator.machine.tip()
    code, said = run("-c", "a", "jog", "x+1", "--yes")
    assert code == 9
    assert "the cell a uses tool 1" in said
    assert "robolink tool select" in said
    assert simulator.machine.tip() == stood
    assert run("-c", "a", "tool", "select", "1", "--yes")[0] == 0
    assert run("-c", "a", "jog", "x+1", "--yes")[0] == 0
    assert "uses tool" not in run("-c", "a", "status")[1]


def test_without_a_cell_file_the_record_of_the_last_procedure_tells(epson, folder, run):
    simulator, url = epson
    assert run("-c", url, "jog", "x+1", "--yes")[0] == 0
    close_files()
    here = Path.cwd() / "first"
    folder("second")
    kill_a_calibration(url, lambda controller: controller._link.session.close())
    folder(here.name)
    code, said = run("-c", url, "jog", "x+1", "--yes")
    assert code == 9
    assert "the last procedure began with tool 1" in said
    assert simulator.machine.tools.selected == 0


def test_the_owner_of_a_mailbox_is_said_and_kept(folder, run):
    with serve_modbus_tcp(SoftMotionSimulator(seed=3)) as host:
        first = robolink.connect(host.url)
        with first.preserved("calibration of tool 1"):
            first.tools.select(0)
            folder("second")
            code, said = run("-c", host.url, "status")
            assert code == 0
            assert "Another client has the mailbox locked" in said
            with robolink.connect(host.url) as second, pytest.raises(LeaseHeldError):
                second.tools.select(1)
        first.close()
        assert "Another client" not in run("-c", host.url, "status")[1]
