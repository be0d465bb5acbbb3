"""The sources of a password, and how it stays secret."""

import sys

import pytest

from robolink import errors
from robolink.config import passwords as _password

URL = "epson+tcp://192.0.2.1:5000"
OTHER = "epson+tcp://192.0.2.2:5000"


def test_no_source_no_password():
    assert _password.find_password(URL) is None


def test_the_file_goes_before_the_environment(monkeypatch, tmp_path):
    monkeypatch.setenv("ROBOLINK_PASSWORD", "from environment")
    found = _password.find_password(URL)
    assert found is not None
    assert found.reveal() == "from environment"
    path = tmp_path / "secret"
    path.write_text("from file\nnot this\n")
    path.chmod(0o600)
    monkeypatch.setenv("ROBOLINK_PASSWORD_FILE", str(path))
    found = _password.find_password(URL)
    assert found is not None
    assert found.reveal() == "from file"


def test_the_file_on_the_command_line_goes_before_the_one_in_the_environment(monkeypatch, tmp_path):
    for name in ("named", "given"):
        (tmp_path / name).write_text(f"canary-{name}")
        (tmp_path / name).chmod(0o600)
    monkeypatch.setenv("ROBOLINK_PASSWORD_FILE", str(tmp_path / "named"))
    found = _password.find_password(URL, password_file=tmp_path / "given")
    assert found is not None
    assert found.reveal() == "canary-given"


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o660])
def test_a_password_file_that_others_may_read_is_refused(tmp_path, mode):
    path = tmp_path / "secret"
    path.write_text("hunter2")
    path.chmod(mode)
    with pytest.raises(errors.ConfigError, match="Other users") as caught:
        _password.find_password(URL, password_file=path)
    assert "chmod 600" in caught.value.remedy


def test_a_password_file_that_cannot_be_read_is_named_and_its_bytes_are_not(tmp_path):
    with pytest.raises(errors.ConfigError, match="no-such-file"):
        _password.find_password(URL, password_file=tmp_path / "no-such-file")
    path = tmp_path / "secret"
    path.write_bytes(b"hunter2\xff")
    path.chmod(0o600)
    with pytest.raises(errors.ConfigError, match="not UTF-8") as caught:
        _password.find_password(URL, password_file=path)
    assert caught.value.__cause__ is None
    path.write_bytes(b"x" * 200_000)
    with pytest.raises(errors.ConfigError, match=r"longer than 0\.1 MB"):
        _password.find_password(URL, password_file=path)


@pytest.mark.parametrize("content", [b"hunter2", b"hunter2\r\nmore", b"\xef\xbb\xbfhunter2\n\xff"])
def test_the_first_line_of_a_password_file_counts(tmp_path, content):
    path = tmp_path / "secret"
    path.write_bytes(content)
    path.chmod(0o600)
    found = _password.find_password(URL, password_file=path)
    assert found is not None
    assert found.reveal() == "hunter2"


class Ring:
    """A keyring with one entry, or one that does not work."""

    def __init__(self, failure=None):
        self.failure = failure
        self.errors = self

    class KeyringError(Exception):
        pass

    def get_password(self, service, user):
        if self.failure:
            raise self.failure
        return "from keyring" if (service, user) == ("robolink", URL) else None


@pytest.mark.parametrize(
    ("ring", "identity", "expected"),
    [
        (Ring(), URL, "from keyring"),
        (Ring(), OTHER, "from environment"),
        (Ring(Ring.KeyringError()), URL, "from environment"),
    ],
    ids=["an entry", "another controller's entry", "no keyring service"],
)
def test_the_keyring_goes_first_when_it_has_an_entry(monkeypatch, ring, identity, expected):
    monkeypatch.setitem(sys.modules, "keyring", ring)
    monkeypatch.setitem(sys.modules, "keyring.errors", ring)
    monkeypatch.setenv("ROBOLINK_PASSWORD", "from environment")
    found = _password.find_password(identity)
    assert found is not None
    assert found.reveal() == expected


def test_a_keyring_that_fails_in_a_way_of_its_own_is_told_where_nothing_else_has_one(monkeypatch):
    ring = Ring(RuntimeError("D-Bus is not there"))
    monkeypatch.setitem(sys.modules, "keyring", ring)
    monkeypatch.setitem(sys.modules, "keyring.errors", ring)
    with pytest.raises(errors.ConfigError, match="RuntimeError: D-Bus is not there") as told:
        _password.find_password(URL)
    assert "PYTHON_KEYRING_BACKEND" in told.value.remedy
    monkeypatch.setenv("ROBOLINK_PASSWORD", "from environment")
    found = _password.find_password(URL)
    assert found is not None
    assert found.reveal() == "from environment"
