"""Makes the page that a package index shows of robolink: README with links that lead somewhere.

In the source, links are relative to the repository; in a wheel there is no repository around them.
Hatchling calls this (``pyproject.toml``). Where robolink is published, two variables say so, for
``make build HOME_URL=... PAGES_URL=...``: links then are absolute, and the package names its home.
Without them, a link to a page becomes the command that shows it, since the wheel brings the pages.
"""

import os
import re
from pathlib import Path
from typing import Any, Final

from hatchling.metadata.plugin.interface import MetadataHookInterface

HOME: Final = "HOME_URL"
"""Environment variable with the URL of the project's home page."""

PAGES: Final = "PAGES_URL"
"""Environment variable with the base URL of the repository's files."""

_LINK: Final = re.compile(r"(?<!!)\[([^]]+)]\((?!https?://|#)([^)#]+)(#[^)]*)?\)")
_PAGE: Final = re.compile(r"docs/((?:reference/)?[\w-]+)\.md")


def package_page(readme: str, pages_url: str = "") -> str:
    """Return README as a package index shows it.

    Args:
        readme: Its text; links are relative to the repository.
        pages_url: Where the files of the repository are read; empty where they are nowhere.

    Raises:
        ValueError: ``pages_url`` is no https address.
    """
    if pages_url and not pages_url.startswith("https://"):
        raise ValueError(f"{PAGES} has to begin with https://: {pages_url}")

    def lead(found: re.Match[str]) -> str:
        words, target, heading = found[1], found[2], found[3] or ""
        if pages_url:
            return f"[{words}]({pages_url.rstrip('/')}/{target}{heading})"
        page = _PAGE.fullmatch(target)
        if page is None or page[1] == "README":
            return words
        command = f"`robolink docs {page[1]}`"
        return command if words == target else f"{words} ({command})"

    return _LINK.sub(lead, readme)


def urls(home_url: str, pages_url: str = "") -> dict[str, str]:
    """Return the addresses that a package names; none where robolink is not published.

    Args:
        home_url: Where the project is at home; may be empty.
        pages_url: Where its files are read; may be empty.
    """
    found = {"Homepage": home_url} if home_url else {}
    if pages_url:
        base = pages_url.rstrip("/")
        found |= {"Documentation": f"{base}/docs/README.md", "Changelog": f"{base}/CHANGELOG.md"}
        found |= {"Security": f"{base}/SECURITY.md"}
    return found


class PackagePageHook(MetadataHookInterface):
    """Gives hatchling ``readme`` and ``urls``."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Fill in what ``pyproject.toml`` calls dynamic.

        Args:
            metadata: The table ``[project]``.
        """
        home, pages = os.environ.get(HOME, ""), os.environ.get(PAGES, "")
        text = Path(self.root, "README.md").read_text(encoding="utf-8")
        page = package_page(text, pages)
        metadata["readme"] = {"content-type": "text/markdown", "text": page}
        metadata["urls"] = urls(home, pages)
