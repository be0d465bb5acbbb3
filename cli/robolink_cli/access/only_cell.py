"""The cell that is meant where none was named: the only one of this computer, if there is one.

Read without click, because a stop may need it.
"""

from robolink.errors import ConfigError
from robolink.messages import tr


def only_cell() -> str:
    """Return the name of the only cell that the cell files describe, empty where there is none."""
    names = _names()
    return names[0] if len(names) == 1 else ""


def which_cell(name: str) -> str:
    """Return the line that says which cell was taken."""
    return tr("cell: {name}", name=name)


def nothing_named() -> ConfigError:
    """Return the refusal of a command that needs a controller, where none is named."""
    names = _names()
    if not names:
        return ConfigError(
            tr("No controller is named."),
            remedy=tr(
                "Give -c CELL from a cell file, or -c URL, for example "
                "-c epson+tcp://192.168.0.1:5000, or set ROBOLINK_CONTROLLER. To practise on a "
                "simulated robot: robolink docs tutorial"
            ),
        )
    if len(names) == 1:
        return ConfigError(
            tr(
                "No cell is named. A command that moves or writes takes the only one, {name}, "
                "only where it can ask you first.",
                name=names[0],
            ),
            remedy=tr("Name it: -c {name}", name=names[0]),
        )
    return ConfigError(
        tr("No cell is named, and there are several: {names}.", names=", ".join(names)),
        remedy=tr("Name one of them, for example: -c {name}", name=names[0]),
    )


def _names() -> list[str]:
    from robolink.config import cell_names

    return cell_names()
