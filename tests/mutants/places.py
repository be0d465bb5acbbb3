"""The mutants of the product: all of them, and some drawn by a seed."""

import ast
import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from tests.mutants.changes import Mutant, mutants_of

ROOT: Final = Path(__file__).parents[2]
PACKAGES: Final = ("robolink", "cli/robolink_cli")
"""The product. The simulators are the judges."""

LEFT_OUT: Final = ("robolink/version.py", "robolink/locale/", "robolink/lazy_exports.py")


def modules(root: Path) -> Iterator[Path]:
    """Yield the modules of the product, in an order that is always the same."""
    for package in PACKAGES:
        for path in sorted((root / package).rglob("*.py")):
            if not path.relative_to(root).as_posix().startswith(LEFT_OUT):
                yield path


def sources(root: Path) -> str:
    """Return a short hash over the product's lines; a new hash outdates all results."""
    digest = hashlib.sha256()
    for path in modules(root):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:12]


def mutants(root: Path) -> list[Mutant]:
    """Return every mutant that there is, in an order that is always the same."""
    found: list[Mutant] = []
    for path in modules(root):
        found += mutants_of(path.relative_to(root).as_posix(), path.read_bytes())
    return found


def drawn(root: Path, *, seed: int, count: int) -> list[Mutant]:
    """Return some of them in a random order, so that the first ones are a sample too.

    Each place has the same chance. A line added elsewhere does not change another's draw.

    Args:
        root: The tree.
        seed: The seed of the draw.
        count: The number of mutants.
    """

    def lot(mutant: Mutant) -> bytes:
        return hashlib.sha256(f"{seed} {mutant.name}".encode()).digest()

    texts = {path.relative_to(root).as_posix(): path.read_bytes() for path in modules(root)}
    chosen: list[Mutant] = []
    for one in sorted(mutants(root), key=lot):
        if len(chosen) == count:
            break
        if _compiles(one.applied(texts[one.file]), texts[one.file]):
            chosen.append(one)
    return chosen


def _compiles(changed: bytes, sound: bytes) -> bool:
    """Return whether a mutant is valid Python, and differs from the original."""
    try:
        return ast.dump(ast.parse(changed)) != ast.dump(ast.parse(sound))
    except SyntaxError:
        return False
