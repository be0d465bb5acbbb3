"""How a camera is told user and password: Basic (RFC 7617) or Digest (RFC 7616)."""

from base64 import b64encode
from http.client import HTTPMessage

from robolink.eye.cameras.address import CameraAddress

__all__ = ["authorization"]


def authorization(address: CameraAddress, headers: HTTPMessage) -> str:
    """Return the header that answers a camera which asks who is there; empty for an unknown way.

    Args:
        address: Whose user and password are used.
        headers: The headers of its answer 401.
    """
    asked = {
        challenge.split(None, 1)[0].lower(): challenge
        for challenge in headers.get_all("WWW-Authenticate", [])
        if challenge.strip()
    }
    if "digest" in asked:
        return _digest(address, asked["digest"])
    if "basic" in asked:
        pair = f"{address.user}:{address.password.reveal()}".encode()
        return f"Basic {b64encode(pair).decode('ascii')}"
    return ""


def _digest(address: CameraAddress, challenge: str) -> str:
    from urllib import request

    scheme = "https" if address.secure else "http"
    url = f"{scheme}://{address.host}:{address.port}{address.target}"
    known = request.HTTPPasswordMgrWithDefaultRealm()
    known.add_password(None, url, address.user, address.password.reveal())
    handler = request.HTTPDigestAuthHandler(known)
    values = request.parse_keqv_list(
        list(filter(None, request.parse_http_list(challenge.split(None, 1)[1])))
    )
    try:
        answer = handler.get_authorization(request.Request(url), values)
    except (ValueError, TypeError, AttributeError):  # an algorithm that it does not know
        return ""
    return f"Digest {answer}" if answer else ""
