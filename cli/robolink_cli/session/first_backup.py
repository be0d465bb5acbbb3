"""The backup that every command makes before the first write to a controller."""

from robolink.backup import ToolHolder, keep_first_backup
from robolink.messages import tr
from robolink_cli.console.render import note


def back_up_first(controller: ToolHolder) -> None:
    """Save the tools if this controller has no backup yet, and say where.

    Raises:
        ConfigError: That is impossible; nothing may be written.
    """
    path = keep_first_backup(controller)
    if path is not None:
        note(
            tr(
                "Before the first write to this controller its tools were saved in {path}",
                path=path,
            )
        )
