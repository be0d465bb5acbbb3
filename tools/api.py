"""Writes docs/api.md: what is public, as every ``__all__`` says.

::

    .venv/bin/python -m tools.api          # a test compares the page with what is public

A name of ``robolink`` itself is listed there alone, although it comes from a package beneath.
Sentences about the others are in their docstrings, and on the pages that ``make docs`` builds.
"""

import inspect
import re
from importlib import import_module
from pathlib import Path
from textwrap import fill
from typing import Any, Final

ROOT: Final = Path(__file__).parents[1]
PAGE: Final = ROOT / "docs" / "api.md"
TOPS: Final = {
    "robolink": ROOT / "robolink",
    "robolink_simulators": ROOT / "simulators" / "robolink_simulators",
}
_LISTS: Final = "## robolink\n"
"""Heading above the generated lists. The text before it is written by hand."""

_KINDS: Final = ("Classes", "Errors", "Functions", "Constants and types")
_ROLE: Final = re.compile(r":(?:py:)?\w+:`~?([^`<]*?)(?: ?<[^`]*>)?`")


def public() -> dict[str, dict[str, Any]]:
    """Return what each public package and module hands out, by name."""
    found: dict[str, dict[str, Any]] = {}
    for top, folder in TOPS.items():
        for path in sorted(folder.rglob("*.py")):
            if "__all__" not in path.read_text(encoding="utf-8"):
                continue
            parts = path.relative_to(folder).with_suffix("").parts
            dotted = ".".join((top, *(part for part in parts if part != "__init__")))
            module = import_module(dotted)
            names: list[str] = getattr(module, "__all__", [])
            if names:
                found[dotted] = {name: getattr(module, name) for name in names}
    return dict(sorted(found.items()))


def page() -> str:
    """Return the page."""
    found = public()
    front = found.pop("robolink")
    written, _, _ = PAGE.read_text(encoding="utf-8").partition(_LISTS)
    rows = (f"| `{name}` | {_sentence(thing)} |" for name, thing in front.items())
    parts = [written + _LISTS, "| name | what it is |\n|---|---|", *rows]
    for package, names in found.items():
        parts.append(f"\n## {package}\n\n{_sentence(import_module(package))}")
        for kind in _KINDS:
            here = [
                f"`{name}`"
                for name, thing in sorted(names.items())
                if _kind(thing) == kind and front.get(name, _LISTS) is not thing
            ]
            if here:
                parts.append("\n" + fill(f"{kind}: {', '.join(here)}.", 120))
    return "\n".join(parts) + "\n"


def _kind(thing: object) -> str:
    if inspect.isclass(thing):
        return "Errors" if issubclass(thing, BaseException) else "Classes"
    return "Functions" if inspect.isroutine(thing) else "Constants and types"


def _sentence(thing: object) -> str:
    """Return the first sentence about a thing, as Markdown."""
    first = " ".join((inspect.getdoc(thing) or "").partition("\n\n")[0].split())
    first = _ROLE.sub(r"`\1`", first).replace("``", "`")
    return first.partition(". ")[0].rstrip(".") + "."


def main() -> None:
    """Write the page."""
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
