"""From one event to the bytes of one message, without its terminator.

Whatever is written here, the other role reads back as the same event; what could not be is
refused.
"""

from robolink.errors import LocalProtocolError
from robolink.messages import tr
from robolink.protocols.epson_text._commands import ParameterForm, RemoteCommand, find_command
from robolink.protocols.epson_text._events import Refusal, Reply, Request
from robolink.protocols.epson_text._parameters import MAX_TEXT, QUOTE, write_parameters

_MAX_CODE = 99_999


def write_request(request: Request) -> bytes:
    """Return the line of a request.

    Raises:
        LocalProtocolError: Unknown command, wrong parameters, or text that the line cannot
            carry. No message repeats a password.
    """
    command = find_command(request.name)
    if command is None:
        raise LocalProtocolError(
            tr("{name!r} is not a Remote Ethernet command.", name=request.name),
            remedy=tr("Use a command of the table in robolink.protocols.epson_text."),
        )
    parameters = request.parameters
    if not parameters and command.min_parameters == 0:
        return f"${request.name}".encode("ascii")
    written = ",".join(parameters)
    if not (written.isascii() and written.isprintable()):
        raise _refused(request, tr("it holds a character that is not printable ASCII"))
    payload = write_parameters(command, parameters)
    if payload is None:
        raise _refused(request, _misfit(command, parameters))
    return f"${request.name},{payload}".encode("ascii")


def write_reply(reply: Reply, encoding: str) -> bytes:
    """Return the message of a reply.

    Raises:
        LocalProtocolError: The host could not read it back as the same reply.
    """
    if not (reply.name.isascii() and reply.name.isalnum()):
        raise _unsendable(reply, tr("its name is not made of ASCII letters and digits"))
    if reply.text is None:
        payload = ",".join(reply.fields)
        if not reply.fields or payload.count(",") != len(reply.fields) - 1:
            raise _unsendable(reply, tr("it needs at least one field, and no comma in any"))
        if payload.startswith(QUOTE) or _breaks_line(payload):
            raise _unsendable(reply, tr("a quote or a line end would be taken for a frame"))
        return _encoded(reply, f"#{reply.name},{payload}", encoding)
    if reply.fields:
        raise _unsendable(reply, tr("it has both fields and a text"))
    if '"\r' in reply.text or '"\n' in reply.text:
        raise _unsendable(reply, tr("a quote before a line end would end the text early"))
    text = _encoded(reply, reply.text, encoding)
    if len(text) > MAX_TEXT:
        raise _unsendable(reply, tr("its text is longer than {limit} bytes", limit=MAX_TEXT))
    return b'#%s,"%s"' % (reply.name.encode("ascii"), text)


def write_refusal(refusal: Refusal, encoding: str) -> bytes:
    """Return the line of a refusal.

    Raises:
        LocalProtocolError: The host could not read it back as the same refusal.
    """
    if not 0 <= refusal.code <= _MAX_CODE:
        raise _unsendable(refusal, tr("its code is not 0 to {limit}", limit=_MAX_CODE))
    if _breaks_line(refusal.name):
        raise _unsendable(refusal, tr("its name holds a line end"))
    return _encoded(refusal, f"!{refusal.name},{int(refusal.code)}", encoding)


def _misfit(command: RemoteCommand, parameters: tuple[str, ...]) -> str:
    if not command.min_parameters <= len(parameters) <= command.max_parameters:
        return tr(
            "it takes {least} to {most} parameters, not {count}",
            least=command.min_parameters,
            most=command.max_parameters,
            count=len(parameters),
        )
    match command.form:
        case ParameterForm.NUMBERS:
            return tr("its parameters must be whole numbers without a sign")
        case ParameterForm.PASSWORD:
            return tr("the controller would cut the password at its comma")
        case ParameterForm.VARIABLE:
            return tr("a comma or a parenthesis would split its parameters elsewhere")
        case ParameterForm.STATEMENT:
            return tr("a statement holds at most {limit} bytes and no quote", limit=MAX_TEXT)


def _breaks_line(text: str) -> bool:
    return "\r" in text or "\n" in text


def _encoded(event: Reply | Refusal, text: str, encoding: str) -> bytes:
    try:
        return text.encode(encoding)
    except UnicodeEncodeError as error:
        why = tr("{encoding} lacks one of its characters", encoding=encoding)
        raise _unsendable(event, why) from error


def _refused(request: Request, why: str) -> LocalProtocolError:
    return LocalProtocolError(
        tr("{name} cannot be sent: {why}.", name=request.name, why=why),
        remedy=tr("Nothing was sent. Correct the parameters."),
        request=request.name,
    )


def _unsendable(event: Reply | Refusal, why: str) -> LocalProtocolError:
    return LocalProtocolError(
        tr("{event!r} cannot be sent: {why}.", event=event, why=why),
        remedy=tr("Nothing was sent. Correct the answer."),
    )
