"""Runs a command line in a virtual cell: in this process, over the cell's own wire."""

import contextlib
import io
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from typing import Any, Final
from unittest import mock

from robolink_cli import main
from robolink_cli.commands.controller.contract_report import TrialConnections
from robolink_cli.console.exit_codes import UNKNOWN
from robolink_cli.console.shell_words import SHELL_WAYS
from robolink_cli.options.log_file import close_logs, logs_open
from robolink_simulators.hosting.in_process import epson, softmotion

from robolink.errors import OutcomeUnknownError
from robolink.journal._connections import close_files
from robolink.model import Controller
from robolink.remedy_words import speaking
from tests.soak.adversary.command_lines import ASSIST, FOLDER
from tests.soak.adversary.computer import VirtualProcess
from tests.soak.adversary.people import Tell
from tests.soak.adversary.plant.machine import PlantMachine

_PASSWORDS: Final = "robolink.config.passwords"


def run_line(
    line: Sequence[str],
    plant: PlantMachine,
    process: VirtualProcess,
    connect: Callable[[], Controller],
    folder: str,
    tell: Tell,
) -> None:
    """Run a line as the program does, without a terminal.

    Args:
        line: The line, without the program's name.
        plant: The cell's machine; its person sees what ``--assist`` shows.
        process: The process to run it in.
        connect: Connects to its controller over the watched wire.
        folder: The cell's disk.
        tell: Receives the last lines printed.

    Raises:
        RobolinkError, click.ClickException: The error that ended it.
    """
    out, shown = io.StringIO(), io.StringIO()
    with ExitStack() as stack:
        assist = stack.enter_context(_seen(plant))
        words = [
            word.replace(ASSIST, assist).replace(FOLDER, folder) for word in (line or ("status",))
        ]
        stack.enter_context(contextlib.chdir(folder))  # a report is written to the given path
        stack.enter_context(contextlib.redirect_stdout(out))
        stack.enter_context(contextlib.redirect_stderr(shown))
        stack.enter_context(mock.patch.object(sys, "stdin", io.StringIO()))
        stack.enter_context(mock.patch("robolink.connect", _connecting(connect)))
        for name, opened in plant.openings(process).items():
            stack.enter_context(mock.patch(name, opened))
        stack.enter_context(mock.patch.dict(os.environ, ROBOLINK_PASSWORD=plant.password))
        stack.enter_context(mock.patch(f"{_PASSWORDS}.from_keyring", return_value=None))
        # A socket of this computer, with its own thread, is no part of a cell.
        unheard = "robolink_cli.session.connection.listening_for_stop"
        stack.enter_context(mock.patch(unheard, _listening(process)))
        stack.enter_context(mock.patch.object(TrialConnections, "_listen", _heard_by(process)))
        stack.enter_context(speaking(SHELL_WAYS))
        stack.callback(close_files)
        stack.callback(close_logs, beyond=logs_open())
        stack.callback(lambda: tell(" / ".join(shown.getvalue().splitlines()[-2:])))
        code = main._invoke(  # what run() does, but for the signals of this process
            ("-c", plant.address, *words)
        )
    if code == UNKNOWN:
        raise OutcomeUnknownError("the command says that something is left open")


def _listening(process: VirtualProcess) -> Callable[..., AbstractContextManager[None]]:
    """Pass a stop from another terminal to the controller that a command has opened."""

    def listening(
        controller: Controller, *_given: object, **_terms: object
    ) -> AbstractContextManager[None]:
        process.stopper = controller
        return nullcontext()

    return listening


def _heard_by(process: VirtualProcess) -> Callable[[TrialConnections], None]:
    """Pass a stop from another terminal to an opener that connects anew for each check."""

    def listen(trials: TrialConnections) -> None:
        process.stopper = trials

    return listen


def _connecting(connect: Callable[[], Controller]) -> Callable[..., Controller]:
    def connecting(_url: object, **_terms: object) -> Controller:
        return connect()

    return connecting


@contextmanager
def _seen(plant: PlantMachine) -> Iterator[str]:
    """Offer the person at the machine under its address while a line runs."""
    simulator: Any = plant.simulator
    host: Any = {"epson": epson, "softmotion": softmotion}.get(plant.kind)
    if host is None:
        yield plant.address
        return
    name = plant.address.partition("://")[2]
    url = host.register(name, simulator, clock=plant.clock)
    try:
        yield url
    finally:
        host.unregister(name)
