"""Says what robolink runs on, with versions and licences: for ``make build``.

Two files, made from the metadata of what is installed: a bill of materials in CycloneDX 1.6 (JSON),
which programs compare with lists of known defects, and a list of licences for people. Neither holds
a time or a random number: the same packages give the same files.
"""

import argparse
import json
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Final

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

_SHORT: Final = 60
"""Longest licence name in characters. A longer field holds the text of the licence."""


@dataclass(frozen=True, slots=True)
class Material:
    """A package that is installed.

    Attributes:
        name: As package indexes write it, normalized.
        version: Of what is installed.
        licence: Its SPDX expression where it gives one, else the name that it gives.
        spdx: Whether it is an expression.
        needs: Names of what it asks for here.
    """

    name: str
    version: str
    licence: str
    spdx: bool
    needs: tuple[str, ...]

    @property
    def reference(self) -> str:
        """Its package URL."""
        return f"pkg:pypi/{self.name}@{self.version}"


def material(name: str) -> Material:
    """Return what is installed under a name.

    Raises:
        PackageNotFoundError: Nothing is.
    """
    found = metadata.distribution(name)
    about = found.metadata
    expression = _field(about, "License-Expression")
    wanted = [Requirement(text) for text in found.requires or ()]
    here = [one for one in wanted if one.marker is None or one.marker.evaluate({"extra": ""})]
    return Material(
        name=canonicalize_name(name),
        version=found.version,
        licence=expression or _named_licence(about),
        spdx=bool(expression),
        needs=tuple(sorted({canonicalize_name(one.name) for one in here})),
    )


def _named_licence(about: metadata.PackageMetadata) -> str:
    classes: list[str] = [
        text for text in about.get_all("Classifier") or () if text.startswith("License ::")
    ]
    if classes:
        return classes[0].rpartition(" :: ")[2]
    first = _field(about, "License").strip().partition("\n")[0]
    return first[:_SHORT] or "unknown"


def _field(about: metadata.PackageMetadata, name: str) -> str:
    return next(iter(about.get_all(name) or ()), "")


def materials(name: str = "robolink") -> list[Material]:
    """Return a package and all that it needs at run time here, the package first."""
    found: dict[str, Material] = {}
    left: list[str] = [canonicalize_name(name)]
    while left:
        wanted = left.pop(0)
        if wanted not in found:
            found[wanted] = material(wanted)
            left += found[wanted].needs
    first, *others = found.values()
    return [first, *sorted(others, key=lambda other: other.name)]


def bill(found: list[Material]) -> dict[str, object]:
    """Return the bill of materials (CycloneDX 1.6)."""
    product, *parts = found
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": _component(product, "application")},
        "components": [_component(part, "library") for part in parts],
        "dependencies": [
            {
                "ref": one.reference,
                "dependsOn": [other.reference for other in found if other.name in one.needs],
            }
            for one in found
        ],
    }


def _component(one: Material, kind: str) -> dict[str, object]:
    licence = {"expression": one.licence} if one.spdx else {"license": {"name": one.licence}}
    return {
        "type": kind,
        "bom-ref": one.reference,
        "name": one.name,
        "version": one.version,
        "purl": one.reference,
        "licenses": [licence],
    }


def licence_list(found: list[Material]) -> str:
    """Return a line for each package: name, version, licence."""
    rows = [(one.name, one.version, one.licence) for one in found]
    widths = [max(len(row[column]) for row in rows) for column in (0, 1)]
    return "".join(
        f"{name:{widths[0]}}  {version:{widths[1]}}  {licence}\n" for name, version, licence in rows
    )


def main() -> None:
    """Write both files into the folder that is named."""
    parser = argparse.ArgumentParser(description="Write bill of materials and list of licences.")
    parser.add_argument("folder", type=Path)
    folder: Path = parser.parse_args().folder
    found = materials()
    stem = f"robolink-{found[0].version}"
    document = json.dumps(bill(found), indent=2) + "\n"
    (folder / f"{stem}.cdx.json").write_text(document, encoding="ascii")
    (folder / f"{stem}.licences.txt").write_text(licence_list(found), encoding="utf-8")


if __name__ == "__main__":
    main()
