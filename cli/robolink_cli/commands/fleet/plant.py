"""The plant's database that the commands of this computer use, and who types them."""

from typing import TYPE_CHECKING, Annotated

from robolink.messages import tr
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import LINE

if TYPE_CHECKING:
    from click import Context, Parameter
    from click.shell_completion import CompletionItem

    from robolink.fleet import LineJobStore

Operator = Annotated[
    str | None,
    LINE,
    CliOption(
        metavar="ID",
        envvar="ROBOLINK_OPERATOR",
        show_envvar=True,
        help="Your badge or name, for the record.",
    ),
]


def _complete_plan(ctx: "Context", param: "Parameter", incomplete: str) -> "list[CompletionItem]":  # noqa: ARG001 - click's form
    from click.shell_completion import CompletionItem

    from robolink.errors import ConfigError

    try:
        with open_plant() as store:
            plans = store.plans()
    except ConfigError:
        return []
    return [CompletionItem(one.id, help=one.name) for one in plans if one.id.startswith(incomplete)]


PlanId = Annotated[str, CliArgument(metavar="PLAN", shell_complete=_complete_plan)]
AnyPlanId = Annotated[str | None, CliArgument(metavar="[PLAN]", shell_complete=_complete_plan)]


def open_plant(*, missing_ok: bool = False) -> "LineJobStore":
    """Return the plant's database.

    Args:
        missing_ok: Whether it may be missing.

    Raises:
        PlanError: No plan was made yet.
        PlantError: What names it names none.
    """
    from robolink.fleet import LineJobStore, PlanError, default_plant

    store = LineJobStore(default_plant())
    if not (missing_ok or store.made):
        raise PlanError(
            tr("There is no plan yet."),
            remedy=tr("Make one: robolink fleet plan FILE"),
        )
    return store


def who(operator: str | None) -> str:
    """Return who typed a command, for the record: the user and computer, and the name given."""
    from robolink import __version__
    from robolink.journal import signature_here

    here = signature_here(__version__)
    place = f"{here.os_user}@{here.host}"
    return f"{operator} ({place})" if operator else place


def begun_at_cells(plan: str) -> str:
    """Return what a person is told of a plan that moves robots."""
    return tr(
        "It moves robots, so a person begins it at each cell: robolink -c CELL fleet next {plan}",
        plan=plan,
    )
