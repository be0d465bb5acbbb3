"""What is posted to the panel, read; and its short answers."""

from collections.abc import Mapping
from typing import Any, Final

from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from robolink.messages import tr
from robolink_cli.panel.guard.requests import MOST_BYTES, parsed

_MOST_TEXT: Final = 200
"""Longest value that goes with a press, in characters."""


async def posted(request: Request) -> Mapping[str, Any]:
    """Return what was posted; nothing where that is no JSON object."""
    data = await request.body()
    return (parsed(data) if len(data) <= MOST_BYTES else None) or {}


def short_text(given: object) -> str:
    """Return a short text; anything else is none."""
    return given if isinstance(given, str) and len(given) <= _MOST_TEXT else ""


def nothing_here() -> Response:
    """Return the answer to what asks for something that is not there."""
    return JSONResponse({"why": tr("There is no such page.")}, 404)


def refused(why: str, status: int = 409) -> Response:
    """Return the answer to a press that is not carried out.

    Args:
        why: A sentence.
        status: Of HTTP.
    """
    return JSONResponse({"why": why}, status)
