"""This computer's certificate for OPC UA: made once, kept like a password, renewed by a person."""

import platform
import stat
import threading
from base64 import encodebytes
from datetime import timedelta
from itertools import cycle

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import padding, rsa
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)
from cryptography.x509.oid import ExtendedKeyUsageOID

from robolink.errors import ConfigError
from robolink.remedy_words import RemedyWord
from robolink.timing import wall_time
from robolink.transport.opcua import own_certificate as own
from tests.unit._rsa_keys import rsa_key


@pytest.fixture(autouse=True)
def drawn(monkeypatch, tmp_path):
    """Hand out keys in turn, and refuse to draw weak ones."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    handed = cycle([rsa_key(0), rsa_key(1)])

    def draw(*, public_exponent, key_size):
        assert (public_exponent, key_size) == (65537, 2048)
        return next(handed)

    monkeypatch.setattr(rsa, "generate_private_key", draw)


def test_it_is_made_once_and_only_its_owner_can_read_the_key():
    assert own.find_own_certificate() is None
    made = own.own_certificate()
    assert own.own_certificate() == made == own.find_own_certificate()
    assert stat.S_IMODE(made.path.stat().st_mode) == 0o600
    assert stat.S_IMODE(made.path.parent.stat().st_mode) == 0o700
    assert made.public_path.read_bytes() == made.der
    assert b"PRIVATE" not in made.public_path.read_bytes()
    assert "PRIVATE" not in repr(made)
    assert own.make_own_certificate(replace=True).fingerprint != made.fingerprint


@pytest.mark.parametrize("before", [None, b"", b"of the former key"])
def test_the_file_for_the_plc_holds_this_certificate_whatever_became_of_it(before):
    made = own.own_certificate()
    made.public_path.unlink()
    if before is not None:
        made.public_path.write_bytes(before)
    assert own.own_certificate() == made
    assert made.public_path.read_bytes() == made.der


def test_it_is_what_opc_ua_wants_of_a_client():
    made = own.own_certificate()
    found = x509.load_der_x509_certificate(made.der)
    says = {type(one.value): one.value for one in found.extensions}
    names = says[x509.SubjectAlternativeName]
    assert names.get_values_for_type(x509.UniformResourceIdentifier) == [made.application_uri]
    assert made.application_uri.startswith("urn:")
    assert made.application_uri.endswith(":robolink")
    assert len(names.get_values_for_type(x509.DNSName)) == 1
    usage = says[x509.KeyUsage]
    assert usage.digital_signature
    assert usage.content_commitment
    assert usage.key_encipherment
    assert usage.data_encipherment
    assert ExtendedKeyUsageOID.CLIENT_AUTH in says[x509.ExtendedKeyUsage]
    assert not says[x509.BasicConstraints].ca
    assert x509.SubjectKeyIdentifier in says
    assert x509.AuthorityKeyIdentifier in says
    key = load_pem_private_key(made.key, None)
    assert isinstance(key, rsa.RSAPrivateKey)
    assert key.key_size >= 2048
    assert key.public_key() == found.public_key()
    assert found.signature_hash_algorithm is not None
    assert found.signature_hash_algorithm.name == "sha256"
    found.verify_directly_issued_by(found)


def test_a_host_without_a_usable_name_gets_one_too(monkeypatch):
    monkeypatch.setattr(platform, "node", lambda: "三号线")
    assert own.own_certificate().application_uri == "urn:localhost:robolink"


def test_programs_that_make_it_at_once_use_the_same():
    began = threading.Barrier(3)
    made = []

    def make():
        began.wait()
        made.append(own.own_certificate().fingerprint)

    threads = [threading.Thread(target=make) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(made) == 3
    assert {own.own_certificate().fingerprint} == {*made}
    assert own.own_files()[1].read_bytes() == own.own_certificate().der


def test_one_that_others_can_read_or_that_is_damaged_is_refused_and_not_replaced():
    made = own.own_certificate()
    made.path.chmod(0o640)
    with pytest.raises(ConfigError, match="Others") as told:
        own.own_certificate()
    assert "chmod 600" in told.value.remedy
    made.path.chmod(0o600)
    whole = made.path.read_bytes()
    key, _, certificate = whole.partition(b"-----BEGIN CERTIFICATE")
    other = own.make_own_certificate(replace=True).path.read_bytes()
    for spoilt in (
        b"",
        key,
        whole[: len(key) + 40],
        b"\x00" + whole[1:],
        other.partition(b"-----BEGIN CERTIFICATE")[0] + b"-----BEGIN CERTIFICATE" + certificate,
    ):
        made.path.write_bytes(spoilt)
        with pytest.raises(ConfigError, match="no certificate with its key") as told:
            own.own_certificate()
        assert RemedyWord.RENEW_CERTIFICATE in told.value.remedy
        assert made.path.read_bytes() == spoilt


@pytest.mark.parametrize("step", [797, pytest.param(29, marks=pytest.mark.soak)])
def test_of_a_damaged_key_nothing_is_used_that_does_not_fit_its_certificate(step):
    """Each bit that turns is refused by name, or leaves a key that works as before."""
    made = own.own_certificate()
    certificate = x509.load_der_x509_certificate(made.der)
    key = load_pem_private_key(made.key, None)
    der = key.private_bytes(Encoding.DER, PrivateFormat.PKCS8, NoEncryption())
    public_key = certificate.public_key()
    assert isinstance(public_key, rsa.RSAPublicKey)
    oaep = padding.OAEP(padding.MGF1(hashes.SHA256()), hashes.SHA256(), None)
    sealed = public_key.encrypt(b"nonce", oaep)
    ended = set()
    for bit in range(3, 8 * len(der), step):
        bent = bytearray(der)
        bent[bit // 8] ^= 1 << bit % 8
        wrapped = encodebytes(bent)
        pem = b"-----BEGIN PRIVATE KEY-----\n" + wrapped + b"-----END PRIVATE KEY-----\n"
        made.path.write_bytes(pem + certificate.public_bytes(Encoding.PEM))
        try:
            found = own.own_certificate()
        except ConfigError as error:
            ended.add(error.what.replace(str(made.path), "it"))
            continue
        used = load_pem_private_key(found.key, None, unsafe_skip_rsa_key_validation=True)
        assert isinstance(used, rsa.RSAPrivateKey)
        assert used.decrypt(sealed, oaep) == b"nonce", bit
        ended.add("works")
    assert ended == {"it holds no certificate with its key.", "works"}


@pytest.mark.parametrize("days", [-1, own.VALID_DAYS + 1])
def test_one_whose_time_is_over_or_has_not_begun_is_told(monkeypatch, days):
    made = own.own_certificate()
    made.require_in_force()
    shifted = wall_time() + timedelta(days=days)
    monkeypatch.setattr(own, "wall_time", lambda: shifted)
    with pytest.raises(ConfigError, match="counts from") as told:
        made.require_in_force()
    assert RemedyWord.RENEW_CERTIFICATE in told.value.remedy


def test_its_end_is_told_before_it_comes(monkeypatch):
    made = own.own_certificate()
    now = wall_time()
    assert not made.ends_soon
    shifted = now + timedelta(days=own.VALID_DAYS - own.WARNED_DAYS + 1)
    monkeypatch.setattr(own, "wall_time", lambda: shifted)
    assert made.ends_soon
    assert made.days_left == own.WARNED_DAYS - 2
