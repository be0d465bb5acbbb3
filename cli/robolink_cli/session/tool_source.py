"""The tools of a controller: asked for, or as the project publishes them."""

from robolink.backup import ToolState, read_tools
from robolink.errors import ConfigError, NotReadyError
from robolink.messages import joined, tr
from robolink.model import Controller
from robolink_cli.access.capabilities import require_epson


def find_tools(controller: Controller, *, published: bool) -> ToolState:
    """Return all tools and the one in force.

    Args:
        controller: A connected controller.
        published: Whether to read what the companion program published, which is legal while
            production runs and for a client that may only monitor.

    Raises:
        NotReadyError: The controller cannot be asked now; says what may be done instead.
        ConfigError: The project publishes no tools.
    """
    if not published:
        try:
            return read_tools(controller)
        except NotReadyError as error:
            hint = tr("With the companion program in the project, --published works now too.")
            error.remedy = joined(" ", (error.remedy, hint))
            raise
    found = require_epson(controller, tr("published tools")).published_tools()
    if found is None:
        raise ConfigError(
            tr("The project in {url} publishes no tools.", url=controller.identity),
            remedy=tr(
                "Add the program that 'robolink expert spel export DIR' "
                "writes and call RobolinkPublish "
                "once; docs/monitor-only.md says how."
            ),
        )
    return ToolState(found.tools, found.selected)
