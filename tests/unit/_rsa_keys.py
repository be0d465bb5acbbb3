"""RSA keys for certificates of tests: one takes a tenth of a second."""

from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey


@cache
def rsa_key(number: int) -> "RSAPrivateKey":
    """Return a key of 2048 bits, in one process always the same for a number."""
    from cryptography.hazmat.primitives.asymmetric import rsa

    return rsa.generate_private_key(public_exponent=65537, key_size=2048)
