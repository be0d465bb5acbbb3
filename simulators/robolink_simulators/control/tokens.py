"""The token in the URL of a port beside a simulator: whoever shows it is let in."""

import hmac
import secrets
from typing import Final

_TOKEN_BYTES: Final = 16


def drawn_token() -> str:
    """Return a token that nobody guesses: 128 bits, in characters that a URL carries."""
    return secrets.token_urlsafe(_TOKEN_BYTES)


def is_token(shown: object, token: str) -> bool:
    """Whether ``shown`` is the token; takes as long for a near miss as for a far one."""
    return isinstance(shown, str) and hmac.compare_digest(
        shown.encode("utf-8", "surrogatepass"), token.encode()
    )
