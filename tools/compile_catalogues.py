"""Compiles the catalogues of sentences, and gathers the pages, where a wheel is made.

Hatchling calls it (``pyproject.toml``). The wheel holds what gettext reads, so that whoever
installs it needs no Babel; the sources of the translations stay in the source archive. Of the
folder of pages it holds what ``robolink docs`` shows: pages and pictures, no program that makes
them.
"""

from pathlib import Path
from typing import Any

from babel.messages.mofile import write_mo
from babel.messages.pofile import read_po
from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CatalogueHook(BuildHookInterface):  # type: ignore[type-arg]
    """Writes a ``.mo`` beside each ``.po`` before files are gathered, and names the pages."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile every catalogue and gather the pages; a source archive needs none.

        Args:
            version: ``standard`` or ``editable``.
            build_data: What hatchling knows of the build.
        """
        if self.target_name != "wheel":
            return
        for source in sorted(Path(self.root, "robolink", "locale").glob("*/LC_MESSAGES/*.po")):
            with source.open("rb") as read, source.with_suffix(".mo").open("wb") as compiled:
                write_mo(compiled, read_po(read))
        if version == "standard":
            build_data["force_include"].update(self._pages())

    def _pages(self) -> dict[str, str]:
        """Return where each page and picture goes; installed in place they are where they are."""
        docs = Path(self.root, "docs")
        patterns = (
            "*.md",
            "*.json",
            "reference/*.md",
            "decisions/*.md",
            "pictures/*.svg",
            "pictures/*.png",
        )
        found = (path for pattern in patterns for path in docs.glob(pattern))
        return {
            str(path): f"robolink_cli/docs/{path.relative_to(docs).as_posix()}" for path in found
        }
