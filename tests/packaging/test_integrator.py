"""The project of an integrator, outside of this one, against the wheel and nothing else."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROJECT = ROOT / "tests" / "integrator"


@pytest.mark.soak
def test_the_tests_of_an_integrator_pass_with_the_wheel(tmp_path):
    def run(*command, **more):
        environment = {
            name: value
            for name, value in os.environ.items()
            if name != "PYTHONPATH" and not name.startswith(("PYTEST", "ROBOLINK"))
        }
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, check=False, **more
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    build = (sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path))
    run(*build, cwd=ROOT)
    (wheel,) = tmp_path.glob("robolink-*.whl")
    run(sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-compile",
        "--target", str(tmp_path / "installed"), str(wheel))  # fmt: skip
    project = tmp_path / "project"
    shutil.copytree(PROJECT, project)
    # What robolink needs is taken from here; robolink itself stands before it, from the wheel.
    boot = (
        f"import sys; sys.path.insert(0, {str(tmp_path / 'installed')!r});"
        "import robolink, pytest; print('robolink is', robolink.__file__);"
        "sys.exit(pytest.main(['-q', '-p', 'no:cacheprovider', '--strict-markers', '-n', '2']))"
    )
    shown = run(sys.executable, "-c", boot, cwd=project)
    assert f"robolink is {tmp_path}" in shown
    assert "15 passed" in shown
