"""URLs of controllers and transports: their parts, and their openers."""

from importlib import metadata
from importlib.metadata import EntryPoint, EntryPoints

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.controllers.registry import find_opener
from robolink.errors import ConfigError
from robolink.methods import find_method
from robolink.transport import TRANSPORTS_GROUP, open_transport, parse_url
from tests._rows import each_row
from tests.unit.test_transport_trace import ScriptedTransport

# URLs that name a controller.


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


@each_row(
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


@each_row(
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


@settings(deadline=None, max_examples=80)
@given(st.text(max_size=40))
def test_any_text_is_a_url_or_a_config_error(text):
    try:
        url = parse_url(text)
    except ConfigError:
        return
    assert url.kind
    assert url.medium


# Finding the transport that a URL names.


class DeskLine(ScriptedTransport):
    """A transport that reports its opening."""

    def __init__(self, url, timeout_s, clock):
        super().__init__()
        self.opened = (url, timeout_s, clock)

    def send(self, data, *, deadline, secret=False):
        """Send nothing."""

    def receive(self, *, deadline):
        return b""

    def receive_waiting(self):
        return None


def opener(url, *, timeout_s, clock):
    opened.append(DeskLine(url, timeout_s, clock))
    return opened[-1]


opened: list[DeskLine] = []


class DeskEntryPoint(EntryPoint):
    """An entry point whose package is this module, which cannot be imported by name."""

    def load(self):
        return opener


@pytest.fixture
def entry_points(monkeypatch):
    found = EntryPoints(
        [
            DeskEntryPoint("epson+desk", "desk:opener", TRANSPORTS_GROUP),
            EntryPoint("epson+gone", "no_such_module_of_ours:opener", TRANSPORTS_GROUP),
            EntryPoint("epson+odd", "robolink.errors:no_such_name", TRANSPORTS_GROUP),
        ]
    )
    monkeypatch.setattr(metadata, "entry_points", lambda **by: found.select(**by))


def test_another_package_is_found_by_the_name_of_its_full_scheme(entry_points):
    link = parse_url("epson+desk://cell-a?seed=1")
    line = open_transport(link, timeout_s=1.5)
    assert opened.pop().opened == (link, 1.5, None)
    assert (line.url, line.place) == (DeskLine.url, DeskLine.place)


def test_a_url_may_be_given_as_text(entry_points):
    link = parse_url("epson+desk://cell-a")
    open_transport("epson+desk://cell-a")
    assert opened.pop().opened == (link, 3.0, None)


def test_an_unknown_scheme_is_refused_with_a_list_of_what_there_is(entry_points):
    with pytest.raises(ConfigError, match=r"'epson\+pigeon'") as caught:
        open_transport("epson+pigeon://loft")
    for known in ("epson+tcp", "epson+desk"):
        assert known in caught.value.remedy


@pytest.mark.parametrize("scheme", ["epson+gone", "epson+odd"])
def test_an_entry_point_that_cannot_be_loaded_is_an_error_of_ours(entry_points, scheme):
    with pytest.raises(ConfigError, match="cannot be loaded") as caught:
        open_transport(f"{scheme}://x")
    assert isinstance(caught.value.__cause__, (ImportError, AttributeError))


@each_row(
    "url",
    [
        "epson+tcp://192.168.0.1",
        "epson+tcp://:5000",
        "epson+tcp://192.168.0.1:5000/",
        "epson+tcp://192.168.0.1:5000?seed=1",
    ],
)
def test_a_tcp_url_is_host_and_port_and_nothing_else(url):
    with pytest.raises(ConfigError):
        open_transport(url)


def test_of_two_packages_that_bring_the_same_none_is_guessed(monkeypatch):
    both = metadata.EntryPoints(
        metadata.EntryPoint("gantry", place, "robolink.controllers")
        for place in ("one:open", "another:open")
    )
    monkeypatch.setattr(metadata, "entry_points", lambda **by: both.select(**by))
    with pytest.raises(ConfigError, match="cannot be loaded: several packages provide it"):
        find_opener(parse_url("gantry+tcp://192.168.0.1"))


def test_a_method_that_cannot_be_loaded_is_refused_by_name(monkeypatch):
    broken = metadata.EntryPoints(
        [metadata.EntryPoint("spiral", "nothing_here:METHOD", "robolink.methods")]
    )
    monkeypatch.setattr(metadata, "entry_points", lambda **by: broken.select(**by))
    with pytest.raises(ConfigError, match="method 'spiral' cannot be loaded: No module"):
        find_method("spiral")
