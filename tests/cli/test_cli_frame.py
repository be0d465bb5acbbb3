"""The frame of the command line: the modules that it loads, and how it merges options."""

from typing import Any

import click
import pytest
from robolink_cli import main
from robolink_cli.access.warnings import marker_notice, note_unsettled
from robolink_cli.command_map import SECTIONS
from robolink_cli.commands.groups import cell, expert, robot
from robolink_cli.console.render import json_is_on, note
from robolink_cli.session.connection import open_controller

import robolink
from robolink.errors import NotReadyError, NotReadyReason
from robolink.model import ControllerStatus, Ledger, Marker, MarkerKind
from robolink.stop_latch import StopLatch
from tests.cli._fresh_python import shown_and_loaded

URL = "epson+tcp://192.0.2.1:5000"
OTHER = "epson+tcp://192.0.2.2:5000"


HEAVY = {
    "numpy",
    "asyncua",
    "pymodbus",
    "can",
    "canopen",
    "sqlite3",
    "pydantic",
    "rich",
    "lark",
    "platformdirs",
    "keyring",
    "prompt_toolkit",
    "importlib.metadata",
    "PIL",
    "cv2",
    "robolink.controllers",
    "robolink.eye",
    "robolink_simulators",
}


TAB = {"_ROBOLINK_COMPLETE": "bash_complete", "COMP_WORDS": "robolink ", "COMP_CWORD": "1"}


def test_looking_at_the_commands_loads_none_of_the_heavy_packages():
    lines = [(["--help"], {}), (["cell", "--help"], {}), (["--version"], {}), ([], TAB)]
    shown = shown_and_loaded(lines, HEAVY)
    assert [one[-1] for one in shown] == ["ended: 0 []"] * 4
    for one, expected in zip(shown, ("calibrate", "doctor", "0.1.0", "calibrate"), strict=True):
        assert expected in "\n".join(one)


def test_every_command_of_the_first_page_is_listed_with_its_line():
    listing = main.cli.get_help(click.Context(main.cli, info_name="robolink"))
    for part in SECTIONS.values():
        for name, (target, summary) in part.items():
            assert f"  {name} " in listing
            assert summary in listing
            assert target.startswith("robolink_cli.")


@pytest.mark.parametrize("group", [robot, cell, expert], ids=lambda group: group.name)
def test_every_command_of_a_group_exists_and_is_listed_with_its_line(group):
    context = click.Context(group, info_name=group.name)
    listing = group.get_help(context)
    for name, (_, summary) in group.lazy.items():
        assert f"  {name} " in listing
        assert summary[:30] in listing
        assert isinstance(group.get_command(context, name), click.Command)


def test_a_command_that_does_not_exist_is_a_usage_error(capsys):
    assert main.run(["no-such-command"]) == 2
    assert "no-such-command" in capsys.readouterr().err


def test_the_version_is_the_package_s(capsys):
    assert main.run(["--version"]) == 0
    assert capsys.readouterr().out == f"robolink {robolink.__version__}\n"


@pytest.mark.parametrize(
    ("arguments", "environment", "expected"),
    [
        (["-c", URL, "status"], None, URL),
        (["status", "-c", URL], None, URL),
        (["--controller", OTHER, "status", "--controller", URL], None, URL),
        (["status"], URL, URL),
        (["-c", URL, "status"], OTHER, URL),
        (["status", "-c", URL], OTHER, URL),
        (["status"], None, None),
    ],
)
def test_the_controller_is_named_before_or_after_the_command(
    command, monkeypatch, arguments, environment, expected
):
    if environment:
        monkeypatch.setenv("ROBOLINK_CONTROLLER", environment)
    seen = command()
    assert main.run(arguments) == 0
    assert seen[0].url == expected


def test_times_and_the_password_file_reach_the_command(command, tmp_path):
    seen = command()
    arguments = ["--timeout", "1.5", "status", "--remote-timeout", "0"]
    assert main.run([*arguments, "--password-file", str(tmp_path / "secret")]) == 0
    (context,) = seen
    assert (context.timeout_s, context.remote_timeout_s) == (1.5, 0)
    assert context.password_file == str(tmp_path / "secret")


def test_without_options_the_defaults_are_in_force(command):
    spoken = []
    seen = command(lambda _: spoken.append(json_is_on()))
    assert main.run(["status"]) == 0
    assert (seen[0].timeout_s, seen[0].remote_timeout_s, spoken) == (3.0, 60.0, [False])


def test_no_option_takes_a_password():
    names = {
        name
        for parameter in main.cli.params
        for name in parameter.opts
        if "password" in name or name == "-p"
    }
    assert names == {"--password-file"}


def test_a_missing_controller_is_told_with_an_example(command, capsys):
    command(lambda context: context.require_url())
    assert main.run(["status"]) == 2
    assert "-c epson+tcp://" in capsys.readouterr().err


class UnfinishedController:
    """A controller with two interrupted jobs."""

    def __init__(self, *more):
        self.outcomes = self.tools = self
        self.closed = False
        self.more = more
        self.latch, self.ledger = StopLatch(URL), Ledger()
        self.trouble, self.remarks, self.identity = None, (), URL

    def at_work(self):
        return ""

    def status(self):
        return ControllerStatus(guard_open=True)

    def selected(self):
        raise NotReadyError("The safety guard is open.", reason=NotReadyReason.GUARD_OPEN)

    def open_markers(self):
        when = "2025-01-01T00:00:00+00:00"
        return (
            Marker("a", MarkerKind.SELECTION, "calibrate tool 3", when, {"tool": 3, "now": 0}),
            Marker("b", MarkerKind.SET, "TLSet 3, XY(1,2,3,0)", when),
            *self.more,
        )

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.closed = True


def test_what_was_left_unfinished_is_said_on_connecting(command, capsys, monkeypatch):
    connected: dict[str, Any] = {}
    controller = UnfinishedController()

    def connect(url, **options):
        connected.update(options, url=url)
        return controller

    def act(context):
        with open_controller(context):
            pass

    monkeypatch.setattr(robolink, "connect", connect, raising=False)
    monkeypatch.setenv("ROBOLINK_PASSWORD", "hunter2")
    command(act)
    assert main.run(["-c", URL, "status", "--timeout", "2"]) == 0
    assert controller.closed
    assert connected.pop("password").reveal() == "hunter2"
    assert connected.pop("signature").version == robolink.__version__
    assert connected == {
        "url": URL,
        "timeout_s": 2.0,
        "remote_timeout_s": 60.0,
        "acceleration_mm_s2": None,
        "wait_s": 0.0,
        "trace": None,
        "glance": False,
        "tell": note,
        "limits": None,
    }
    shown = capsys.readouterr()
    assert shown.out == ""
    for text in ("Tool 0 is selected now", "restores tool 3", f'robolink -c "{URL}" recover'):
        assert text in shown.err
    assert "TLSet 3, XY(1,2,3,0)" in shown.err
    assert "robot stays blocked" in shown.err


def test_a_selection_that_was_not_answered_leaves_two_tools_to_be_named(capsys):
    sent = Marker("c", MarkerKind.SET, "Tool 3", "2025-01-01T00:00:00+00:00", {"select": 3})
    controller: Any = UnfinishedController(sent)
    note_unsettled(controller, controller.open_markers(), URL)
    assert "Tool 3 or 0 is selected now; it was tool 3 before." in capsys.readouterr().err


def test_recover_is_not_told_to_recover(command, capsys, monkeypatch):
    def act(context):
        with open_controller(context, quiet=True):
            pass

    monkeypatch.setattr(robolink, "connect", lambda *a, **k: UnfinishedController(), raising=False)
    command(act)
    assert main.run(["-c", URL, "status"]) == 0
    assert capsys.readouterr().err == ""


def test_a_selection_marker_without_details_is_still_told():
    marker = Marker("a", MarkerKind.SELECTION, "calibrate", "2025-01-01T00:00:00+00:00")
    assert "Tool ? is selected" in marker_notice(marker, URL)
