"""Compiles the catalogues of sentences where a wheel, or an installation in place, is made.

Hatchling calls it (``pyproject.toml``). The wheel holds what gettext reads, so that whoever
installs it needs no Babel; the sources of the translations stay in the source archive.
"""

from pathlib import Path
from typing import Any

from babel.messages.mofile import write_mo
from babel.messages.pofile import read_po
from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CatalogueHook(BuildHookInterface):  # type: ignore[type-arg]
    """Writes a ``.mo`` beside each ``.po`` before files are gathered."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002
        """Compile every catalogue; a source archive needs none.

        Args:
            version: ``standard`` or ``editable``.
            build_data: What hatchling knows of the build.
        """
        if self.target_name != "wheel":
            return
        for source in sorted(Path(self.root, "robolink", "locale").glob("*/LC_MESSAGES/*.po")):
            with source.open("rb") as read, source.with_suffix(".mo").open("wb") as compiled:
                write_mo(compiled, read_po(read))
