"""Settings of Sphinx for `make docs`; the pages are laid out by build.py beside this file."""

import inspect
import json
import re
from pathlib import Path

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.util import logging

import robolink

project = "robolink"
author = "the robolink authors"
release = robolink.__version__
html_title = f"robolink {release}"

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "docs/README"
include_patterns = [
    "*.md",
    "api/*.rst",
    "docs/**.md",
    "simulators/README.md",
    "examples/README.md",
    "companions/**.md",
    "examples/**.md",
    "tests/**.md",
]
exclude_patterns = ["docs/site"]

myst_heading_anchors = 4
myst_links_external_new_tab = False
# Attributes of dataclasses share names such as x_mm, and a type may be exported twice.
suppress_warnings = ["ref.python", "toc.not_included"]
html_theme_options = {"navigation_with_keys": True}

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_default_options = {"members": True}
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
python_use_unqualified_type_names = True

html_theme = "furo"
html_show_sphinx = False
html_copy_source = False
templates_path = ["templates"]

_log = logging.getLogger("robolink.docs")


def _find_elsewhere(
    app: Sphinx, env: BuildEnvironment, node: pending_xref, content: nodes.Element
) -> nodes.Element | None:
    """Resolve a name by the package that describes it; warn of a role that leads nowhere.

    Types in signatures may lead nowhere: what no package hands out has no page.
    """
    elsewhere = json.loads((Path(app.srcdir) / "elsewhere.json").read_text(encoding="utf-8"))
    if there := elsewhere.get(str(node.get("reftarget", ""))):
        python = env.domains["py"]
        page, kind = node["refdoc"], node["reftype"]
        return python.resolve_xref(env, page, app.builder, kind, there, node, content)
    source = str(node.source or getattr(node.parent, "source", ""))
    ours = "docstring of" in source and str(node.get("reftarget", "")).startswith("robolink")
    if isinstance(content, nodes.literal) and node.get("refdomain") == "py" and ours:
        _log.warning("%s leads nowhere", node["reftarget"], location=node)
    return None


_COLON = "\x1f"
_PAGE = re.compile(r"(?<![`/\w])(docs/[\w/-]+)\.md(?!`)")


def _before_napoleon(
    app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Keep what reStructuredText and Napoleon would take for a sign of theirs.

    A bar is a bar: ``|e|`` is a length in our docstrings and no substitution. A colon in the first
    line of a property is a colon; Napoleon would take what stands before it for its type. And the
    page that a docstring cites becomes a link to it.
    """
    for number, line in enumerate(lines):
        bars = line if "``" in line else line.replace("|", "\\|")
        lines[number] = _PAGE.sub(r"`\g<0> <../\1.html>`__", bars)
    if lines and what in ("property", "attribute", "data"):
        lines[0] = lines[0].replace(": ", f"{_COLON} ")


def _after_napoleon(
    app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    lines[:] = [line.replace(_COLON, ":") for line in lines]


def _plain_signature(
    app: Sphinx,
    what: str,
    name: str,
    thing: object,
    options: object,
    signature: str | None,
    returns: str | None,
) -> tuple[str, str | None] | None:
    """Leave out annotations that hold limits and sentences; docs/methods.md shows these."""
    if not signature or "Annotated[" not in signature or not callable(thing):
        return None
    found = inspect.signature(thing)
    bare = [one.replace(annotation=one.empty) for one in found.parameters.values()]
    return str(found.replace(parameters=bare, return_annotation=found.empty)), returns


def setup(app: Sphinx) -> None:
    """Connect what is above."""
    app.connect("autodoc-process-docstring", _before_napoleon, priority=400)
    app.connect("autodoc-process-docstring", _after_napoleon, priority=600)
    app.connect("autodoc-process-signature", _plain_signature)
    app.connect("missing-reference", _find_elsewhere)
