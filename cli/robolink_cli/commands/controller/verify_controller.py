"""verify-controller: what this controller really does, where documents leave it open."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import json_fields
from robolink_cli.access.record import recording
from robolink_cli.console.render import emit, note, say, table
from robolink_cli.options.declaration import CliOption
from robolink_cli.session.connection import password_of, say_how_protected
from robolink_cli.session.context import CliContext, controller_options

if TYPE_CHECKING:
    from robolink.controllers.epson.verify import Fact, Verification

_SHOWN = 40
"""Number of characters of evidence in the table. The JSON document and the transcript have all of
it.
"""

_file = click.Path(dir_okay=False, path_type=Path)


@click.command("verify-controller")
@controller_options
def verify_controller(
    context: CliContext,
    *,
    profile: Annotated[
        Path | None,
        _file,
        CliOption(help="Write a cell profile, for 'robolink sim epson --profile'."),
    ] = None,
    transcript: Annotated[
        Path | None,
        _file,
        CliOption(help="Write the whole dialogue, for 'robolink sim epson --replay'."),
    ] = None,
    redact: Annotated[
        bool, CliOption(help="Leave names, serial numbers and addresses out.")
    ] = False,
) -> None:
    """Find out how this controller behaves where its documents are unclear.

    Reads only: moves nothing, writes nothing, and runs no statement that could leave an error.
    While production runs it sends only queries and finds out less. For a PLC it shows what its
    mailbox reports about itself, and whether that is right.
    """
    from robolink.controllers.epson.verify import verify_epson
    from robolink.transport import parse_url

    url = context.require_url()
    kind = parse_url(url).kind
    if kind != "epson":
        if profile is not None or transcript is not None or redact:
            raise ConfigError(
                tr("Profiles and transcripts exist for EPSON controllers only."),
                remedy=tr("Leave --profile, --transcript and --redact out."),
            )
        _verify_plc(context, url, kind)
        return
    with recording(context.record, url.partition("?")[0]) as trace:
        found = verify_epson(
            url, password=password_of(context), timeout_s=context.timeout_s, trace=trace
        )
    if profile is not None:
        _write(profile, json.dumps(found.profile(redact=redact), indent=2) + "\n")
    if transcript is not None:
        _write(transcript, _said(found, redact=redact))
    payload: dict[str, object] = {
        "controller": "" if redact else found.controller,
        "options": found.options,
        "facts": [_fact_payload(fact) for fact in found.facts],
        "profile": None if profile is None else str(profile),
        "transcript": None if transcript is None else str(transcript),
    }
    emit("verification", payload, lambda: _show(found))
    for path in (profile, transcript):
        if path is not None:
            note(tr("Written: {path}", path=path))


def _verify_plc(context: CliContext, url: str, kind: str) -> None:
    """Read what a mailbox shows of itself; a map has its own check."""
    import robolink
    from robolink.controllers import SoftMotionController
    from robolink.journal import memory_journal

    if kind != "softmotion":
        raise ConfigError(
            tr("verify-controller does not apply to a PLC with its own registers."),
            remedy=tr('Compare its map instead: robolink -c "{url}" expert plc check-map', url=url),
        )
    say_how_protected(url)
    # Nothing is written, so nothing is recorded.
    log = memory_journal(url).log(url)
    with robolink.connect(url, timeout_s=context.timeout_s, outcomes=log) as controller:
        assert isinstance(controller, SoftMotionController)  # noqa: S101 - of that kind
        found, name = controller.verify(), controller.identity
    payload: dict[str, object] = {
        "controller": name,
        "findings": [
            {"name": one.name, "finding": one.finding, "right": one.right, "remedy": one.remedy}
            for one in found
        ],
    }

    def show() -> None:
        table(
            tr("the mailbox of {controller}", controller=name),
            (tr("what"), tr("found"), tr("right")),
            [(one.name, one.finding, tr("yes") if one.right else tr("NO")) for one in found],
        )
        for one in found:
            if not one.right:
                say(tr("{name}: {remedy}", name=one.name, remedy=one.remedy))
        say(tr("Nothing was written, and nothing moved."))

    emit("mailbox-verification", payload, show)


def _said(found: "Verification", *, redact: bool) -> str:
    from robolink.controllers.epson.verify import redacted
    from robolink.transport import format_dialogue

    return format_dialogue(redacted(found.dialogue) if redact else found.dialogue)


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="ascii", newline="\n")
    except OSError as error:
        raise ConfigError(
            tr("{path} cannot be written: {cause}.", path=path, cause=error.strerror),
            remedy=tr("Choose another file; the controller was only read."),
        ) from error


def _fact_payload(fact: "Fact") -> dict[str, object]:
    return {
        **json_fields(fact, "name", "finding", "settled"),
        "option": fact.option or None,
        **json_fields(fact, "value", "evidence"),
    }


def _show(found: "Verification") -> None:
    settled = [fact for fact in found.facts if fact.settled]
    table(
        tr("what {controller} does", controller=found.controller),
        (tr("fact"), tr("this controller"), tr("simulator option"), tr("evidence")),
        [(f.name, f.finding, _option(f), _short(f.evidence)) for f in settled],
    )
    table(
        tr("not found out"),
        (tr("fact"), tr("why"), tr("simulator option")),
        [(f.name, f.finding, f.option or "-") for f in found.facts if not f.settled],
    )
    say(
        tr(
            "{settled} of {all} facts found out. Nothing was written, and nothing moved.",
            settled=len(settled),
            all=len(found.facts),
        )
    )


def _option(fact: "Fact") -> str:
    return f"{fact.option}={fact.value}" if fact.option else "-"


def _short(evidence: str) -> str:
    return evidence if len(evidence) <= _SHOWN else f"{evidence[:_SHOWN]} ..."
