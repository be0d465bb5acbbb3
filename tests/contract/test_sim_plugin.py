"""The pytest plugin in third-party tests."""

import os
import subprocess
import sys

THEIRS = """
import re
import socket

def test_the_served_one_answers(epson_tcp):
    host, port = epson_tcp.url.removeprefix("epson+tcp://").split(":")
    with socket.create_connection((host, int(port)), timeout=5) as client:
        client.sendall(b"$Login,\\r\\n")
        assert client.recv(100) == b"#Login,0\\r\\n"
    assert epson_tcp.simulator.seed == 7
    assert re.fullmatch(r"assist\\+tcp://[\\w-]{22}@127\\.0\\.0\\.1:\\d+", epson_tcp.assist)

def test_the_one_in_process_has_a_url(epson_sim):
    from robolink.transport import open_transport
    open_transport(epson_sim.url).close()
    assert epson_sim.simulator.seed == 7

def test_a_crash_leaves_its_marker_to_nobody(epson_tcp, robolink_state):
    import robolink
    from robolink.model import Marker, MarkerKind
    controller = robolink.connect(epson_tcp.url)
    controller.outcomes.begin(Marker("a", MarkerKind.SET, "TLSet 1", "then"))
    controller.close()
    assert (robolink_state / "journal.db").exists()
"""


def run(folder, *arguments, **variables):
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *arguments],
        cwd=folder,
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        timeout=50,
        check=False,
    )


def test_its_fixtures_serve_simulators_with_the_seed_of_the_command_line(tmp_path):
    (tmp_path / "test_theirs.py").write_text(THEIRS)
    own = tmp_path / "developer"
    done = run(tmp_path, "-W", "error", "--robolink-seed", "7", ROBOLINK_STATE_DIR=str(own))
    assert done.returncode == 0, done.stdout + done.stderr
    assert "3 passed" in done.stdout
    assert not own.exists()
