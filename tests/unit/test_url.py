"""URLs that name a controller."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.errors import ConfigError
from robolink.transport import parse_url


def test_a_url_is_taken_apart():
    url = parse_url("epson+sim://cell-a?robot=T6-602S&seed=1&note=")
    assert (url.kind, url.medium, url.scheme, url.host) == ("epson", "sim", "epson+sim", "cell-a")
    assert (url.port, url.path) == (None, "")
    assert url.options == {"robot": "T6-602S", "seed": "1", "note": ""}


def test_the_identity_leaves_the_options_out():
    assert parse_url("epson+sim://cell-a?seed=1").identity == "epson+sim://cell-a"


def test_one_controller_has_one_identity_however_its_name_is_written():
    assert (
        parse_url("epson+tcp://Robot:5000").identity == parse_url("EPSON+TCP://robot:5000").identity
    )


def test_a_device_path_belongs_to_the_identity():
    url = parse_url("epson+serial:///dev/ttyUSB0?baud=115200")
    assert (url.path, url.identity) == ("/dev/ttyUSB0", "epson+serial:///dev/ttyUSB0")


def test_an_ipv6_address_keeps_its_brackets_in_the_identity():
    url = parse_url("epson+tcp://[fe80::1]:5000")
    assert (url.host, url.identity) == ("fe80::1", "epson+tcp://[fe80::1]:5000")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "192.168.0.1",
        "192.168.0.1:5000",
        "tcp://192.168.0.1:5000",
        "+tcp://192.168.0.1:5000",
        "epson+://192.168.0.1:5000",
        "epson+tcp://host:port",
        "epson+tcp://host:70000",
        "epson+tcp://[fe80::1:5000",
        "epson+sim://cell?seed",
        "epson+sim://cell?seed=1&seed=2",
    ],
)
def test_what_is_no_controller_url_is_refused_with_a_remedy(text):
    with pytest.raises(ConfigError) as caught:
        parse_url(text)
    assert caught.value.remedy


@pytest.mark.parametrize(
    "text",
    [
        "epson+tcp://:hunter2@host:5000",
        "epson+tcp://operator:hunter2@host:5000",
        "epson+tcp://hunter2@host:5000",
        "epson+tcp://host:hunter2",
        "epson+tcp://operator:hunter2@host:port",
        "epson+tcp://host:5000?password=hunter2",
        "epson+sim://cell?pass=hunter2",
    ],
)
def test_a_password_in_a_url_is_refused_and_not_repeated(text):
    with pytest.raises(ConfigError) as caught:
        parse_url(text)
    assert "hunter2" not in str(caught.value)


@settings(deadline=None, max_examples=200)
@given(st.text(max_size=40))
def test_any_text_is_a_url_or_a_config_error(text):
    try:
        url = parse_url(text)
    except ConfigError:
        return
    assert url.kind
    assert url.medium
