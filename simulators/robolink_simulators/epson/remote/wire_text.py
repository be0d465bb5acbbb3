"""Requests and replies as a log shows them: as on the wire, but for passwords."""

from robolink.protocols.epson_text import BadRequest, Request


def shown_request(event: Request | BadRequest) -> str:
    """Return a request in one line."""
    name = event.name
    if isinstance(event, BadRequest):
        return "***" if "login" in name.lower() else name
    match name.lower():
        case "login":
            return f"${name},***"
        case "execute":
            return f'${name},"{event.parameters[0]}"'  # quotes inside stand as they came
        case _:
            return ",".join((f"${name}", *event.parameters))


def shown_reply(reply: bytes) -> str:
    """Return a reply without its terminator."""
    text = reply.decode("latin-1").rstrip("\r\n")
    if text[:1] != "!":
        return text
    # The refusal of a login that could not be read repeats it, password and all.
    mistyped = "login" in text.lower() and text[1:6].lower() + text[6:7] != "login,"
    return "***" if mistyped else text
