"""A CPython for Windows in a folder, made from packages of the indexes, and wine to run it.

The DLLs of CPython 3.11 come from a win_amd64 wheel that ships them for programs with their own
interpreter; they carry the signature of the Python Software Foundation. The modules written in
Python are those of the CPython 3.11 that runs this. The wheels are those that ``requirements.lock``
names for win_amd64. Two DLLs that every Windows 10 has and wine 8 has in part are added (the ``.c``
files here).
"""

import hashlib
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[2]
FOLDER: Final = ROOT / "build" / "windows"

INTERPRETER: Final = "panda3d==1.10.16"
"""Its wheel for CPython 3.11 on win_amd64 holds the DLLs of CPython 3.11.9 in deploy_libs."""

TESTS_NEED: Final = ("pytest", "pytest-timeout", "hypothesis", "lark", "wcwidth")
"""Imports of the suite's named files besides robolink; versions as in the lock file."""

_WHEEL_TARGET: Final = (
    *("--only-binary=:all:", "--no-deps", "--platform", "win_amd64"),
    *("--python-version", "3.11", "--implementation", "cp"),
)
_COMPILER: Final = "x86_64-w64-mingw32-gcc"


def missing() -> list[str]:
    """Return what this machine lacks, in words; empty if a Windows Python can be made."""
    lacks = [
        f"{program} (Debian: apt-get install {package})"
        for program, package in (("wine", "wine wine64"), (_COMPILER, "gcc-mingw-w64-x86-64"))
        if shutil.which(program) is None
    ]
    if sys.version_info[:2] != (3, 11):
        lacks.append(f"CPython 3.11 to run this; it is {sys.version.split()[0]}")
    return lacks


@dataclass(frozen=True, slots=True)
class WindowsPython:
    """A Windows Python with robolink's wheel installed."""

    folder: Path

    @property
    def program(self) -> Path:
        """Return python.exe."""
        return self.folder / "python" / "python.exe"

    def run(
        self,
        *arguments: str,
        seconds: float = 300,
        cwd: Path = ROOT / "build",
        **environment: str,
    ) -> subprocess.CompletedProcess[str]:
        """Run python.exe to its end and return its output and its exit code."""
        # stdout has to be a pipe: wine hands a plain file on as a handle that CPython refuses.
        return subprocess.run(
            self.command(*arguments),
            env=self.environment(environment),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            timeout=seconds,
            check=False,
            cwd=cwd,
        )

    def start(self, *arguments: str, **environment: str) -> "subprocess.Popen[str]":
        """Start python.exe with a pipe at each end."""
        return subprocess.Popen(
            self.command(*arguments),
            env=self.environment(environment),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            errors="replace",
            cwd=ROOT / "build",
        )

    def command(self, *arguments: str) -> list[str]:
        """Return the command line that runs python.exe with these arguments."""
        return ["wine", str(self.program), *arguments]

    def environment(self, more: Mapping[str, str]) -> dict[str, str]:
        """Return the environment: its own wine, UTF-8, no messages of wine itself."""
        # In the folder of this pytest, that of Windows would tidy up what others are using.
        left = re.compile("ROBOLINK|PYTHONDONTWRITEBYTECODE|PYTEST")
        kept = {name: value for name, value in os.environ.items() if not left.search(name)}
        own = {
            "WINEPREFIX": str(self.folder / "prefix"),
            "WINEDEBUG": "-all",
            "WINEDLLOVERRIDES": "ucrtbase,wineucrt,bcryptprimitives=n,b",
            "PYTHONUTF8": "1",
            "OPENBLAS_NUM_THREADS": "1",
        }
        return kept | own | dict(more)


def made() -> WindowsPython:
    """Return the Windows Python, with the wheel of this source.

    Its base is made anew only if the lock file or these files changed.
    """
    site = FOLDER / "python" / "Lib" / "site-packages"
    sources = [ROOT / "requirements-dev.lock", Path(__file__)]
    sources += sorted(Path(__file__).parent.glob("*.c"))
    state = hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()
    stamp = FOLDER / "made-of"
    if not stamp.exists() or stamp.read_text() != state:
        shutil.rmtree(FOLDER / "python", ignore_errors=True)
        _interpreter(FOLDER / "python")
        _packages(site)
        stamp.write_text(state)
    for old in site.glob("robolink*"):
        shutil.rmtree(old)
    _pip("install", "--no-deps", "--no-compile", "--target", str(site), str(_wheel_of_robolink()))
    return WindowsPython(FOLDER)


def _wheel_of_robolink() -> Path:
    folder = FOLDER / "wheel"
    shutil.rmtree(folder, ignore_errors=True)
    _said(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder))
    (wheel,) = folder.glob("*.whl")
    return wheel


def _interpreter(folder: Path) -> None:
    downloads = FOLDER / "downloads"
    _pip("download", *_WHEEL_TARGET, "--dest", str(downloads), INTERPRETER)
    (vendor,) = downloads.glob("panda3d-*.whl")
    folder.mkdir(parents=True)
    with zipfile.ZipFile(vendor) as archive:
        for member in archive.namelist():
            path = Path(member)
            # The C library is wine's own: what is in the wheel only points to it.
            wanted = path.suffix in {".dll", ".pyd"} and not path.name.startswith("api-ms-")
            if wanted and path.parent.name == "deploy_libs":
                (folder / path.name).write_bytes(archive.read(member))
    sources = Path(__file__).parent
    _said(
        _COMPILER, "-municode", "-O2", "-o", str(folder / "python.exe"), str(sources / "launcher.c")
    )
    _said(
        *(_COMPILER, "-shared", "-O2", "-o", str(folder / "bcryptprimitives.dll")),
        *(str(sources / "process_prng.c"), "-ladvapi32"),
    )
    _c_library(folder)
    library = Path(sysconfig.get_path("stdlib"))
    leave = shutil.ignore_patterns("site-packages", "dist-packages", "lib-dynload", "test", "*.pyc")
    shutil.copytree(library, folder / "Lib", ignore=leave)


def _c_library(folder: Path) -> None:
    """Put a ucrtbase.dll with the complex functions there, and wine's own beside it."""
    wines = next(Path("/usr/lib").glob("*/wine/x86_64-windows/ucrtbase.dll"))
    contents = wines.read_bytes()
    # Only in its own folder does wine load what carries its mark.
    (folder / "wineucrt.dll").write_bytes(contents.replace(b"Wine builtin DLL", bytes(16), 1))
    source = Path(__file__).parent / "complex_functions.c"
    own = set(re.findall(r"^ALL_\w+\((\w+)\)", source.read_text(), re.MULTILINE))
    own = {name + kind for name in own for kind in ("", "f", "l")}
    table = _said("x86_64-w64-mingw32-objdump", "-p", str(wines)).split("[Ordinal/Name Pointer]")[1]
    names = re.findall(r"^\s+\[ *\d+\].* (\S+)$", table, re.MULTILINE)
    lines = [f'"{name}" = "wineucrt.{name}"' for name in names if name not in own]
    lines += [f"{name} = own_{name}" for name in sorted(own)]
    definition = folder / "ucrtbase.def"
    definition.write_text("\n".join(["LIBRARY ucrtbase", "EXPORTS", *lines, ""]))
    output = str(folder / "ucrtbase.dll")
    _said(_COMPILER, "-shared", "-static-libgcc", "-O2", "-o", output, str(source), str(definition))


def _packages(folder: Path) -> None:
    lines = (ROOT / "requirements-dev.lock").read_text(encoding="utf-8").splitlines()
    pinned = [line.split()[0] for line in lines if line[:1].isalpha()]
    needed = {line.split("==")[0] for line in _locked()} | set(TESTS_NEED) | _needed_by_tests()
    wanted = [pin for pin in pinned if pin.split("==")[0] in needed]
    _pip("install", *_WHEEL_TARGET, "--no-compile", "--target", str(folder), *wanted)


def _locked() -> list[str]:
    lines = (ROOT / "requirements.lock").read_text(encoding="utf-8").splitlines()
    return [line for line in lines if line[:1].isalpha()]


def _needed_by_tests() -> set[str]:
    return {"iniconfig", "pluggy", "sortedcontainers", "packaging", "pygments"}


def _pip(*arguments: str) -> None:
    _said(sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", *arguments)


def _said(*command: str) -> str:
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
    return done.stdout


TAKEN_ALONG: Final = ("pyproject.toml", "docs/documents.schema.json")
"""The files of the source that the tests read besides themselves."""


def suite_beside(python: WindowsPython) -> Path:
    """Return a folder with the tests and their settings, in which they import the wheel."""
    folder = python.folder / "suite"
    shutil.rmtree(folder, ignore_errors=True)
    leave = shutil.ignore_patterns("__pycache__", "soak", "peers")
    shutil.copytree(ROOT / "tests", folder / "tests", ignore=leave)
    for name in TAKEN_ALONG:
        (folder / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    return folder
