"""Connecting to a cell by all that its file says: password, limits, time-outs, its robot."""

from robolink.config._cells import Cell, find_cell
from robolink.config._reach import Expected
from robolink.config.passwords import find_password
from robolink.controllers import connect
from robolink.errors import ConfigError
from robolink.journal import name_journals
from robolink.messages import tr
from robolink.model import Controller, Secret, Signature
from robolink.transport import TraceSink, parse_url


def connect_cell(
    cell: Cell | str,
    *,
    password: str | Secret | None = None,
    timeout_s: float | None = None,
    wait_s: float = 0.0,
    signature: Signature | None = None,
    trace: TraceSink | None = None,
) -> Controller:
    """Connect to the controller of a cell, by all that its file says.

    Its limits, its acceleration, its time-outs, its journal, its home and the place of its password
    count. Another robot than the cell's is refused. On another computer than its home it can be
    looked at and stopped: :attr:`~robolink.model.OutcomeLog.trouble` names the home.

    Args:
        cell: The cell, or its name.
        password: In place of the one that is found where the cell's file says.
        timeout_s: Longest wait for one answer, in place of the cell's.
        wait_s: How long to wait for somebody else who has the controller.
        signature: Who works here, and with what.
        trace: Is told of all traffic; see :func:`robolink.connect`.

    Raises:
        ConfigError: There is no such cell, a file is wrong, or the robot is not the cell's.
        RobolinkError: As :func:`robolink.connect`.

    Example:
        >>> from pathlib import Path
        >>> from robolink.config import add_cell, connect_cell
        >>> add_cell(Path("robolink.toml"), "line3", {"url": "epson+sim://connect-cell"})
        >>> with connect_cell("line3") as controller:
        ...     controller.tools.selected()
        1
    """
    cell = find_cell(cell) if isinstance(cell, str) else cell
    settings, url = cell.settings, parse_url(cell.url)
    if password is None:
        password = find_password(
            url.identity,
            cell_file=settings.password_file,
            cell_variable=settings.password_env,
        )
    name_journals({url.address: settings.journal or ""}, homes={url.address: cell.home})
    controller = connect(
        cell.url,
        password=password,
        timeout_s=timeout_s or settings.timeout_s or 3.0,
        remote_timeout_s=settings.remote_timeout_s or 0.0,
        acceleration_mm_s2=settings.acceleration_mm_s2,
        wait_s=wait_s,
        signature=signature,
        trace=trace,
        limits=cell.limits(),
    )
    try:
        require_expected_robot(controller, cell.expected)
    except BaseException:
        controller.close()
        raise
    return controller


def require_expected_robot(controller: Controller, cell: Expected) -> None:
    """Refuse to work on another robot than the one in the cell file.

    Args:
        controller: The controller, connected.
        cell: What the cell file says.

    Raises:
        ConfigError: The controller has another robot, or does not say which.
    """
    if cell.robot is None:
        return
    found = controller.facts().robot_models
    if cell.robot.casefold() not in (model.casefold() for model in found):
        raise ConfigError(
            tr(
                "Cell {cell} needs robot {expected}; at {url} there is {found}.",
                cell=cell.cell,
                expected=cell.robot,
                url=controller.identity,
                found=", ".join(found) or tr("a robot that does not say its model"),
            ),
            remedy=tr(
                "Check the address; else correct 'robot' in {path}.",
                path=cell.robot_file,
            ),
        )
