"""One verification, from login to logout."""

from dataclasses import replace
from typing import TYPE_CHECKING

from robolink.controllers.epson.controller import EpsonController
from robolink.controllers.epson.link.line import SERIAL, EpsonLine, open_line
from robolink.controllers.epson.link.session import EpsonSession
from robolink.controllers.epson.verify import text_facts as text
from robolink.controllers.epson.verify import wire_facts as wire
from robolink.controllers.epson.verify.interview import Interview
from robolink.controllers.epson.verify.not_tried import not_tried
from robolink.controllers.epson.verify.serial_facts import serial_facts
from robolink.controllers.epson.verify.verification import Fact, Verification
from robolink.journal import memory_journal
from robolink.messages import tr
from robolink.model import ControllerFacts, Secret
from robolink.protocols import spel
from robolink.timing import wall_label
from robolink.transport import DialogueLog, LinkUrl, TraceSink, parse_url

if TYPE_CHECKING:
    from robolink.protocols.epson_binary import Dialect


def verify_epson(
    url: str,
    *,
    password: Secret | None = None,
    timeout_s: float = 3.0,
    trace: TraceSink | None = None,
) -> Verification:
    """Find out what a controller does where documents leave it open (docs/reference/epson.md 7).

    Reads only: no value is written, nothing moves, no statement is run that could leave an
    error. While production runs only queries are sent, and less is found out.

    Args:
        url: The controller.
        password: Its remote password.
        timeout_s: Longest wait for one answer.
        trace: Told about all traffic but the login.

    Raises:
        ConfigError: The URL is wrong.
        ConnectError: Nobody is reached.
        LoginRefusedError: Wrong or missing password.

    Example:
        >>> from robolink.controllers.epson.verify import verify_epson
        >>> found = verify_epson("epson+sim://verify-example", timeout_s=1)
        >>> len(found.facts) > 10
        True
    """
    log = DialogueLog(parse_url(url).identity, wall_label())
    traces = (log,) if trace is None else (log, trace)
    line = open_line(_with_every_letter(parse_url(url)), timeout_s=timeout_s, traces=traces)
    session = EpsonSession(line, timeout_s=timeout_s)
    try:
        session.login(password)
        if session.outlived:
            from robolink.controllers.epson.link.in_step import prove_in_step

            prove_in_step(session)
        # It only reads, and the login sees to it that nobody else is there.
        outcomes = memory_journal(session.identity).log(session.identity)
        controller = EpsonController(session, outcomes, remote_timeout_s=0.0)
        try:
            about, facts = _found_out(
                Interview(controller, session, line.transport, log), _dialect_of(line)
            )
        finally:
            controller.close()
    finally:
        session.close()
    return Verification(session.identity, about, facts, log.dialogue)


def _dialect_of(line: EpsonLine) -> "Dialect | None":
    """Return how a serial line is spoken, ``None`` for Remote Ethernet."""
    if not line.outlives_sessions:
        return None
    from robolink.protocols.epson_binary import EpsonBinaryCodec

    return line.codec.dialect if isinstance(line.codec, EpsonBinaryCodec) else None


def _with_every_letter(url: LinkUrl) -> LinkUrl:
    """Let the letters be tried that no manual prints: of them only Abort, at rest."""
    if url.medium != SERIAL:
        return url
    return replace(url, options={**url.options, "letters": "guessed"})


def _found_out(
    interview: Interview, dialect: "Dialect | None"
) -> tuple[ControllerFacts, tuple[Fact, ...]]:
    about = interview.controller.facts()
    facts = [
        *(_of_remote_ethernet(interview) if dialect is None else serial_facts(interview, dialect)),
        _served(interview),
        text.closing_quote(interview),
        text.number_lead_blank(interview),
        text.point_coordinates(interview),
        text.point_flags(interview),
        text.where_width(interview),
        text.base(interview),
        text.comma_blank(interview),
        *text.tool_facts(interview),
        _while_executing(interview),
    ]
    if dialect is not None:
        interview.log_out()
        return about, (*facts, *not_tried())
    end = (wire.terminator(interview), wire.unfinished_request(interview.leave()))
    return about, (*facts, *end, *not_tried())


def _of_remote_ethernet(interview: Interview) -> tuple[Fact, ...]:
    return (
        wire.status_flags(interview),
        wire.case_echo(interview),
        wire.extended_queries(interview),
        wire.command_set(interview),
        *wire.preferences(interview),
    )


def _served(interview: Interview) -> Fact:
    name = tr("only monitoring")
    query = spel.print_selected_tool()
    answer = interview.printed(query)
    if answer is None:
        return Fact(name, interview.why_no_statement(), "monitoring_only")
    evidence = f"{query} -> {answer}"
    return Fact(name, tr("no: statements are run"), "monitoring_only", False, evidence)


def _while_executing(interview: Interview) -> Fact:
    name, option = tr("flags while a statement runs"), "flags_during_execute"
    flags = interview.flags_while_waiting()
    if flags is None:
        why = interview.why_no_statement() or tr("the statement had ended already")
        return Fact(name, why, option)
    ready = flags.endswith("1")
    finding = tr("Ready stays on") if ready else tr("Running is on, Ready off")
    return Fact(name, finding, option, "ready" if ready else "running", flags)
