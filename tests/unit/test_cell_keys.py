"""One key of a cell is set in its file; every other byte stays."""

import pytest

from robolink.config import find_cell, reach_cell, set_cell_key
from robolink.errors import ConfigError
from robolink.transport import parse_url

URL = 'url = "epson+tcp://192.168.0.1:5000"'
OTHER = """
[cells.line4]  # the next one
url = "epson+tcp://192.168.0.2:5000"
notes = '''
[cells.line3]
notes = "not this one"
'''
"""


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path / "robolink.toml"


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize(
    "header", ["[cells.line3]", '[cells."line3"]', "  [ cells . line3 ]  # glue", "[cells.'line3']"]
)
def test_a_key_is_added_to_a_table_and_nothing_else_changes(file, header, end):
    before = f"# by hand\nlanguage = 'en'\n{header}\n{URL}\ntool = 1\n{OTHER}".replace("\n", end)
    file.write_bytes(before.encode())
    set_cell_key(file, "line3", "notes", 'say "A:B"')
    after = file.read_bytes().decode()
    added = 'notes = "say \\"A:B\\""' + end
    assert after.replace(added, "", 1) == before
    assert find_cell("line3").settings.notes == 'say "A:B"'
    assert find_cell("line4").settings.notes == '[cells.line3]\nnotes = "not this one"\n'


def test_a_key_that_is_there_is_replaced_in_its_place(file):
    file.write_text(f"{OTHER}[cells.line3]\nnotes = 'old' # of May\n{URL}\n[groups]\na = ['*']\n")
    set_cell_key(file, "line3", "notes", "new")
    assert f'[cells.line3]\nnotes = "new"\n{URL}\n[groups]' in file.read_text()
    as_it_is = file.read_bytes()
    set_cell_key(file, "line3", "notes", "new")
    assert file.read_bytes() == as_it_is


def test_a_last_line_without_an_end(file):
    file.write_text("[cells.line3]\n[cells.line3.people]\nChen = 'engineer'")
    with pytest.raises(ConfigError):
        find_cell("line3")
    set_cell_key(file, "line3", "url", "epson+sim://last-line")
    assert find_cell("line3").url == "epson+sim://last-line"


@pytest.mark.parametrize(
    "content",
    [
        f"[cells]\nline3 = {{ {URL} }}\n",
        'cells.line3.url = "epson+tcp://192.168.0.1:5000"\n',
        OTHER,
        f"[cells.line3]\nnotes = '''\na'''\n{URL}\n",
    ],
)
def test_what_cannot_be_changed_safely_is_left_alone_and_the_line_named(file, content):
    file.write_text(content)
    before = file.read_bytes()
    with pytest.raises(ConfigError) as told:
        set_cell_key(file, "line3", "notes", "new")
    assert 'notes = "new"' in told.value.remedy
    assert file.read_bytes() == before


def test_a_value_that_makes_the_file_wrong_is_not_written(file):
    file.write_text(f"[cells.line3]\n{URL}\n")
    with pytest.raises(ConfigError, match="tool"):
        set_cell_key(file, "line3", "tool", "x")
    assert "tool" not in file.read_text()


def test_a_link_is_not_replaced(file, tmp_path):
    real = tmp_path / "real.toml"
    real.write_text(f"[cells.line3]\n{URL}\n")
    file.symlink_to(real)
    with pytest.raises(ConfigError, match="link"):
        set_cell_key(file, "line3", "notes", "new")
    assert file.is_symlink()


def test_who_may_read_it_stays(file):
    file.write_text(f"[cells.line3]\n{URL}\n")
    file.chmod(0o640)
    set_cell_key(file, "line3", "notes", "new")
    assert file.stat().st_mode & 0o777 == 0o640


OPCUA = "softmotion+opcua://192.168.0.2:4840"
PIN = "AB:" * 31 + "CD"


@pytest.mark.parametrize("options", ["", "?symbols=ns=4;s=|var|PLC.Application.RL_Symbols"])
def test_pin_and_user_are_keys_of_a_cell_and_options_of_its_url(file, options):
    file.write_text(f'[cells.line3]\nurl = "{OPCUA}{options}"\nuser = "cell 3"\n')
    set_cell_key(file, "line3", "server_certificate", PIN)
    for url in (find_cell("line3").url, reach_cell("line3").url):
        link = parse_url(url)
        assert link.identity == OPCUA
        assert link.options["server_certificate"] == PIN
        assert link.options["user"] == "cell 3"
        assert len(link.options) == 2 + bool(options)
        assert url.startswith(f"{OPCUA}{options}")


@pytest.mark.parametrize(
    ("url", "key", "value", "why"),
    [
        ("epson+tcp://192.168.0.1:5000", "server_certificate", PIN, "no meaning"),
        ("epson+tcp://192.168.0.1:5000", "user", "cell3", "no meaning"),
        (OPCUA, "server_certificate", "AB:CD", "64 hexadecimal"),
        (OPCUA, "server_certificate", "G" * 64, "64 hexadecimal"),
        (OPCUA, "user", "", "user"),
        (f"{OPCUA}?user=x", "user", "cell3", "say it once"),
        (f"{OPCUA}?server_certificate={PIN}", "server_certificate", PIN, "say it once"),
    ],
)
def test_a_pin_or_user_that_makes_no_sense_is_refused(file, url, key, value, why):
    file.write_text(f'[cells.line3]\nurl = "{url}"\n{key} = "{value}"\n')
    with pytest.raises(ConfigError, match=why) as told:
        find_cell("line3")
    assert key in str(told.value)


def test_a_pin_of_another_address_does_not_count(tmp_path, file, monkeypatch):
    """A nearer file that gives an address begins the cell anew."""
    monkeypatch.setenv("ROBOLINK_CONFIG", str(tmp_path / "nearer.toml"))
    (tmp_path / "nearer.toml").write_text(f'[cells.line3]\nurl = "{OPCUA}9"\n')
    file.write_text(f'[cells.line3]\nurl = "{OPCUA}"\nserver_certificate = "{PIN}"\n')
    assert find_cell("line3").url == reach_cell("line3").url == f"{OPCUA}9"
