"""check-contract: whether a controller keeps what every kind of controller promises."""

import click

import robolink
from robolink.messages import tr
from robolink_cli.console.render import say, table
from robolink_cli.session.context import CliContext, controller_options, emit
from robolink_cli.session.opening import password_of

_BROKEN = 1
"""As of a comparison that found a difference."""


@click.command("check-contract")
@controller_options
def check_contract(context: CliContext) -> int:
    """Hold a controller to what every kind of controller promises, reading only.

    For a cell of your own, and for a driver of your own. Nothing is written and nothing moves;
    tests of yours hold a driver to the rest, with robolink.testing. Ends with 1 where a promise
    is broken; what a controller refuses to show in its present state is an error, as elsewhere.
    """
    from robolink.testing import READING_CHECKS, Subject, outcomes

    url, password = context.require_url(), password_of(context)

    def connected() -> robolink.Controller:
        return robolink.connect(url, password=password, timeout_s=context.timeout_s)

    with connected() as controller:
        subject = Subject(connected, tool=min(controller.tools.indices()))
        identity = controller.outcomes.identity
    found = list(outcomes(subject, READING_CHECKS))
    for one in found:
        if one.error is not None:
            raise one.error
    broken = [one for one in found if one.broken]

    def show() -> None:
        rows = [
            (one.name.replace("_", " "), one.broken or tr("kept"))
            for one in sorted(found, key=lambda one: not one.broken)
        ]
        table(tr("what {who} promises", who=identity), (tr("promise"), tr("found")), rows)
        say(
            tr("{count} of {all} promises are broken.", count=len(broken), all=len(found))
            if broken
            else tr("All {all} promises that can be looked at are kept.", all=len(found))
        )

    checks = [
        {"name": one.name, "promise": one.promise, "broken": one.broken or None} for one in found
    ]
    payload: dict[str, object] = {"controller": identity, "kept": not broken, "checks": checks}
    emit("contract", payload, show)
    return _BROKEN if broken else 0
