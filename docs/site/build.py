"""Builds the pages of docs/ and API pages from the docstrings into build/docs/html.

Everything that pages link to is laid out first in build/docs/pages as it lies in the repository,
so that a relative link means the same on GitHub and here. Sphinx fails on a link to a page or a
heading that is not there; what it wrote is then looked through once more, link by link.
"""

import inspect
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from tools.api import public  # noqa: E402 - the tools are beside the packages

PAGES = ROOT / "build" / "docs" / "pages"
HTML = ROOT / "build" / "docs" / "html"
LINKED = ("docs", "simulators", "companions", "examples", "tests", "benchmarks")


def described(path: str, value: object) -> list[str]:
    """Return what makes Sphinx describe a thing, in reStructuredText."""
    if hasattr(value, "__origin__"):  # an alias has the docstring of its type
        return [f".. py:data:: {path}", "", f"   Stands for ``{value}``."]
    if isinstance(value, (int, float, str, tuple, dict)):  # autodoc would quote its type's words
        shown = [f"   :value: {value!r}"] if isinstance(value, (int, float, str)) else []
        return [f".. py:data:: {path}", *shown]
    if inspect.isclass(value):
        kind = "autoexception" if issubclass(value, BaseException) else "autoclass"
    else:
        kind = "autofunction" if inspect.isroutine(value) else "autodata"
    return [f".. {kind}:: {path}"]


def home(value: object, name: str, places: list[str]) -> str:
    """Return the package that describes a thing which several hand out: the nearest to it."""
    module = getattr(value, "__module__", "")
    return max(places, key=lambda place: (module.startswith(place), len(place)))


def api_page(package: str, names: dict[str, str], things: dict[str, object]) -> str:
    """Return the page of one package, in reStructuredText; ``names`` leads to their homes."""
    lines = [package, "=" * len(package), "", f".. automodule:: {package}", "   :no-members:", ""]
    if away := [f":py:obj:`{at}.{name}`" for name, at in names.items() if at != package]:
        lines += ["Also here: " + ", ".join(away) + ".", ""]
    for name, at in names.items():
        if at == package:
            lines += [*described(f"{package}.{name}", things[name]), ""]
    return "\n".join(lines)


def lay_out() -> None:
    """Copy what pages link to, and write the pages of the API."""
    shutil.rmtree(PAGES.parent, ignore_errors=True)
    PAGES.mkdir(parents=True)
    for name in LINKED:
        shutil.copytree(ROOT / name, PAGES / name, ignore=shutil.ignore_patterns("__pycache__"))
    for file in (*ROOT.glob("*.md"), *(ROOT / name for name in ("LICENSE", "NOTICE", "Makefile"))):
        shutil.copy(file, PAGES)
    write_api(PAGES / "api")


def write_api(api: Path) -> None:
    """Write a page for each package, their list, and where names are that several hand out."""
    api.mkdir()
    elsewhere: dict[str, str] = {}
    listed = ["API", "===", "", "What each package hands out.", "", ".. toctree::"]
    listed += ["   :maxdepth: 1", ""]
    found = public()
    for package, things in found.items():
        names = {
            name: home(thing, name, [p for p, named in found.items() if named.get(name) is thing])
            for name, thing in things.items()
        }
        (api / f"{package}.rst").write_text(api_page(package, names, things), encoding="utf-8")
        elsewhere |= {f"{package}.{n}": f"{at}.{n}" for n, at in names.items() if at != package}
        listed.append(f"   {package}")
    (PAGES / "elsewhere.json").write_text(json.dumps(elsewhere), encoding="utf-8")
    (api / "index.rst").write_text("\n".join([*listed, ""]), encoding="utf-8")


def toctree(caption: str, pages: list[str]) -> str:
    """Return a table of contents that shows in the sidebar only."""
    return "\n".join(["```{toctree}", ":hidden:", f":caption: {caption}", "", *pages, "```"])


def add_contents() -> None:
    """Give the sidebar what the index lists, under the index's own headings."""
    index = PAGES / "docs" / "README.md"
    text = index.read_text(encoding="utf-8")
    blocks = []
    for section in re.split(r"^##+ ", text, flags=re.M)[1:]:
        heading, _, body = section.partition("\n")
        pages = re.findall(r"\]\(([\w./-]+\.md)\)", body)
        blocks.append(
            "\n".join(["```{toctree}", ":hidden:", f":caption: {heading}", "", *pages, "```"])
        )
    blocks.append("```{toctree}\n:hidden:\n:caption: API\n\n../api/index\n```")
    index.write_text("\n\n".join([text, *blocks, ""]), encoding="utf-8")


class _Links(HTMLParser):
    """The anchors of one page and where its links lead."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: set[str] = set()
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, _tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for key, value in attrs:
            if key == "id" and value:
                self.anchors.add(value)
            elif key in ("href", "src") and value:
                self.links.add(value)


def dead_links() -> Iterator[str]:
    """Tell every link inside the built pages that leads nowhere."""
    pages = {page.resolve(): _Links(page) for page in HTML.rglob("*.html")}
    for page, content in pages.items():
        for link in content.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            anchor = unquote(parts.fragment)
            if not target.exists():
                yield f"{page.relative_to(HTML)}: {link}: no such file"
            elif anchor and target in pages and anchor not in pages[target].anchors:
                yield f"{page.relative_to(HTML)}: {link}: no such heading"


def main() -> int:
    lay_out()
    add_contents()
    options = ["-q", "-W", "--keep-going", "-j", "2", "-c", str(ROOT / "docs/site")]
    command = [sys.executable, "-m", "sphinx", *options, str(PAGES), str(HTML)]
    built = subprocess.run(command, check=False).returncode
    dead = sorted(dead_links())
    for line in dead:
        print(line, file=sys.stderr)
    print(f"{len(list(HTML.rglob('*.html')))} pages: {HTML / 'docs/README.html'}")
    return built or bool(dead)


if __name__ == "__main__":
    sys.exit(main())
