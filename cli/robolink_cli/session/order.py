"""--order: a job that a line computer may deliver twice is carried out once."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Final

import click
from click.core import ParameterSource

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.timing import local_label
from robolink_cli.console.render import say
from robolink_cli.options.declaration import CliOption

if TYPE_CHECKING:
    from robolink.model import Controller
    from robolink.transaction import Order

    _ParamType = click.ParamType[str]
else:
    _ParamType = click.ParamType  # click 8.1 knows no parameter of it

_NO_PART: Final = frozenset({"order", "recipe", "yes", "assist", "report_path", "force", "jsonl"})
"""Parameters that may differ when an order is delivered again, because they do not change the work.
"""


class OrderType(_ParamType):
    """The id of an order."""

    name = "order"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> str:
        """Return the id.

        Raises:
            BadParameter: It is none.
        """
        from robolink.transaction import require_order_id

        try:
            return require_order_id(str(value))
        except ConfigError as error:
            self.fail(str(error), param, ctx)


OrderId = Annotated[
    str | None,
    OrderType(),
    CliOption(
        metavar="ID",
        help="Id of this order from a line computer; a repeated order does nothing and "
        "reports the first result.",
    ),
]


def require_no_dry_run(order: str | None, *, dry_run: bool) -> None:
    """Refuse an order for a dry run, which does nothing.

    Raises:
        ConfigError: There is an order, and nothing is to be written.
    """
    if order is not None and dry_run:
        raise ConfigError(
            tr("A dry run carries out no order."), remedy=tr("Leave --order or --dry-run out.")
        )


@contextmanager
def ordered(
    controller: "Controller", order: str | None, command: str, **of_job: object
) -> "Iterator[Order | None]":
    """Keep the lease and look an order up; without one do nothing.

    Args:
        controller: The controller, connected.
        order: Its id, ``None`` without one.
        command: What the job is called; its options are those of click's context.
        of_job: What else the job is JSON.

    Raises:
        RobolinkError: As :func:`robolink.transaction.carrying_out`.
    """
    if order is None:
        yield None
        return
    from robolink.transaction import carrying_out

    with carrying_out(controller, order, {"command": command, **of_job, **_options()}) as found:
        yield found


def with_order(payload: Mapping[str, object], order: "Order | None") -> dict[str, object]:
    """Return a document with what its order adds to it."""
    if order is None:
        return dict(payload)
    return {**payload, "order": order.id, "already_done": order.done is not None}


def show_done(order: "Order") -> None:
    """Show that an order was carried out before."""
    assert order.done is not None  # noqa: S101 - the caller looked
    say(
        tr(
            "Order {order} was carried out on {at}, as change {change}. Nothing was moved "
            "or written now.",
            order=order.id,
            at=local_label(order.done.at),
            change=order.done.change[:8],
        )
    )


def _options() -> dict[str, object]:
    """Return the options that were given, as a part of the job."""
    context = click.get_current_context()
    given = {
        name: str(value)
        for name, value in context.params.items()
        if name not in _NO_PART
        and context.get_parameter_source(name) is not ParameterSource.DEFAULT
    }
    return {"options": given}
