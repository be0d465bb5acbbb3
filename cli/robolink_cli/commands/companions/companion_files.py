"""The programs that are shipped for the controllers themselves."""

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.files.durable import sync_folder, write_whole
from robolink.files.named import holds
from robolink.messages import tr

_EPSON: Final = (
    "epson/robolink_tools.prg",
    "epson/robolink_vision.prg",
    "epson/calc_tool.prg",
    "epson/calc_board_tool.prg",
    "LICENSE",
)


def companion_texts() -> Mapping[str, bytes]:
    """Return the EPSON companions' files by the name they get, with the line ends of RC+'s PC."""
    packaged = files("robolink_cli").joinpath("companions")
    # A source checkout holds them at its top; only a wheel brings them in the package.
    folder = packaged if packaged.is_dir() else Path(__file__).parents[4] / "companions"
    texts = {Path(name).name: folder.joinpath(name).read_bytes() for name in _EPSON}
    return {name: text.replace(b"\n", b"\r\n") for name, text in texts.items()}


def export_companions(folder: Path, *, replace: bool = False) -> list[Path]:
    """Write the files into ``folder``, which is made when it is missing.

    A file that is there already with the same content is fine.

    Raises:
        ConfigError: A file is there that differs, or one cannot be written.
    """
    texts = companion_texts()
    if not replace:
        _require_own(folder, texts)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, data in texts.items():
            write_whole(folder / name, data, mode=0o666)
        sync_folder(folder)
    except OSError as error:
        raise ConfigError(
            tr(
                "{folder} cannot be written: {cause}.",
                folder=folder,
                cause=error.strerror or error,
            ),
            remedy=tr("Name a folder that can be written."),
        ) from error
    return [folder / name for name in texts]


def _require_own(folder: Path, texts: Mapping[str, bytes]) -> None:
    for name, data in texts.items():
        path = folder / name
        if path.exists() and not holds(path, data):
            raise ConfigError(
                tr("{path} is there already and differs; it was not written over.", path=path),
                remedy=tr("Name another folder, or give --force."),
            )
