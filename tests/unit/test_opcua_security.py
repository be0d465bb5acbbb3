"""A signed and encrypted session, to the server whose certificate was kept and to no other."""

import warnings
from contextlib import closing
from dataclasses import replace
from datetime import UTC, datetime

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.x509.oid import NameOID

from robolink.errors import ConfigError, LoginRefusedError, RejectedError
from robolink.transport import parse_url
from robolink.transport.opcua.opening import open_client
from robolink.transport.opcua.security import OpcuaSecurity
from robolink.transport.opcua.server_certificate import read_server_certificate
from robolink.transport.opcua.session import _user_token
from tests.unit._opcua_far_end import FarEnd, own, symbol


def security() -> OpcuaSecurity:
    mine, server = own("robolink"), own("server")
    return OpcuaSecurity(
        "Basic256Sha256",
        mine.certificate,
        mine.key,
        "urn:robolink",
        pinned_fingerprint=server.fingerprint,
        user="Anna",
        password="correct horse",
    )


def opened(opcua_served: FarEnd, asked: OpcuaSecurity):
    return open_client(parse_url(f"plc+opcua://127.0.0.1:{opcua_served.port}"), asked, timeout_s=5)


@pytest.mark.parametrize("policy", ["Basic256Sha256", "Aes256Sha256RsaPss"])
def test_a_tool_is_read_and_written_encrypted(opcua_served: FarEnd, policy: str) -> None:
    with closing(opened(opcua_served, replace(security(), policy=policy))) as client:
        assert client.secured
        client.write(symbol("tool"), [2.5] * 24)
        assert client.read([symbol("tool")]) == ([2.5] * 24,)


def test_a_certificate_that_was_not_kept_is_not_talked_to(opcua_served: FarEnd) -> None:
    with pytest.raises(ConfigError, match="another certificate"):
        opened(opcua_served, replace(security(), pinned_fingerprint=own("robolink").fingerprint))
    with pytest.raises(ConfigError, match="Nobody has compared"):
        opened(opcua_served, replace(security(), pinned_fingerprint=""))


def test_a_wrong_password_is_told_and_never_shown(opcua_served: FarEnd) -> None:
    asked = replace(security(), password="wrong horse")
    with pytest.raises(LoginRefusedError) as caught:
        opened(opcua_served, asked)
    assert "wrong horse" not in f"{caught.value} {asked!r}"


def test_nobody_without_a_name_is_let_in_here(opcua_served: FarEnd) -> None:
    opcua_served.users.open = False
    try:
        with pytest.raises(LoginRefusedError, match="without a name"):
            opened(opcua_served, replace(security(), user=""))
    finally:
        opcua_served.users.open = True


@pytest.mark.parametrize("second", ["ECC_nistP256", "Basic256Sha256"])
def test_a_password_goes_by_an_encryption_that_is_known_or_not_at_all(second: str) -> None:
    from asyncua import ua
    from asyncua.crypto import security_policies, uacrypto
    from cryptography.hazmat.primitives.serialization import load_pem_private_key

    mine, server = own("robolink"), own("server")
    policy = security_policies.SecurityPolicyBasic256Sha256(
        uacrypto.x509_from_der(server.certificate),
        uacrypto.x509_from_der(mine.certificate),
        load_pem_private_key(mine.key, None),
        ua.MessageSecurityMode.SignAndEncrypt,
    )
    offered = [
        ua.UserTokenPolicy(
            PolicyId=name,
            TokenType=ua.UserTokenType.UserName,
            SecurityPolicyUri=f"http://opcfoundation.org/UA/SecurityPolicy#{name}",
        )
        for name in ("ECC_nistP256", second)
    ]
    endpoint = ua.EndpointDescription(UserIdentityTokens=offered)
    if second == "ECC_nistP256":
        with pytest.raises(RejectedError, match="ECC_nistP256"):
            _user_token("plc", security(), endpoint, policy, bytes(32))
        return
    token = _user_token("plc", security(), endpoint, policy, bytes(32))
    assert token.PolicyId == second
    assert b"correct horse" not in token.Password


def test_less_than_was_asked_for_is_refused_by_name(opcua_served: FarEnd) -> None:
    with pytest.raises(RejectedError, match=r"no signed and encrypted.*Basic256Sha256 Sign"):
        opened(opcua_served, replace(security(), policy="Aes128Sha256RsaOaep"))


def test_a_certificate_with_an_empty_country_is_read_without_a_warning() -> None:
    """As that of Eclipse Milo; a warning of Python would stand between a person's lines."""
    key = ec.generate_private_key(ec.SECP256R1())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        country = x509.NameAttribute(NameOID.COUNTRY_NAME, "", _validate=False)
    named = x509.Name([country, x509.NameAttribute(NameOID.COMMON_NAME, "Milo")])
    certificate = (
        x509.CertificateBuilder()
        .subject_name(named)
        .issuer_name(named)
        .public_key(key.public_key())
        .serial_number(1)
        .not_valid_before(datetime(2026, 1, 1, tzinfo=UTC))
        .not_valid_after(datetime(2027, 1, 1, tzinfo=UTC))
        .sign(key, hashes.SHA256())
    )
    with pytest.warns(UserWarning, match="length"):  # else this shows nothing
        _ = x509.load_der_x509_certificate(certificate.public_bytes(Encoding.DER)).subject
    assert read_server_certificate(certificate.public_bytes(Encoding.DER), "plc").name == "Milo"
