"""Writes the software bill of materials of the wheel: CycloneDX 1.6, as JSON.

    python release/bill.py -o build/dist

Lists the package and every library that it installs without extras, in the versions of this
environment, with licences, package URLs and the graph of their requirements. The page and its
decoder are our own sources, so nothing in the wheel comes from elsewhere.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from importlib.metadata import Distribution, distribution
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from ptmtools.version import __version__

ROOT = "ptmtools"


def main() -> None:
    """Writes the file and prints its path and the number of libraries."""
    parser = argparse.ArgumentParser(prog="release/bill.py")
    parser.add_argument("-o", dest="folder", type=Path, default=Path("build/dist"))
    folder = parser.parse_args().folder
    libraries = installed(ROOT)
    check_version(libraries[ROOT])
    text = bill_of(libraries)
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{ROOT}-{libraries[ROOT].version}.cdx.json"
    file.write_text(text, "utf-8")
    print(f"{file}: {len(libraries) - 1} libraries")


def installed(root: str) -> dict[str, Distribution]:
    """The distribution of ``root`` and all that it requires here, by canonical name.

    Raises PackageNotFoundError: one of them is missing."""
    known: dict[str, Distribution] = {}
    left = [root]
    while left:
        name = canonicalize_name(left.pop())
        if name not in known:
            known[name] = distribution(name)
            left += requirements(known[name])
    return known


def check_version(of: Distribution) -> None:
    """Raises SystemExit if the package was installed as another version than it now has: its
    requirements may be those of that version, too."""
    if of.version != __version__:
        raise SystemExit(
            f"{ROOT} {of.version} is installed, but ptmtools/version.py has {__version__}; "
            "install it again: pip install --editable ."
        )


def requirements(of: Distribution) -> Iterator[str]:
    """Names of what a distribution requires on this system without extras."""
    for text in of.requires or ():
        requirement = Requirement(text)
        if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
            yield canonicalize_name(requirement.name)


def bill_of(libraries: dict[str, Distribution]) -> str:
    """The bill as JSON. Libraries are in the order of their names."""
    from cyclonedx.model.bom import Bom
    from cyclonedx.model.component import ComponentType
    from cyclonedx.output.json import JsonV1Dot6

    bom = Bom()
    components = {name: _component(own) for name, own in sorted(libraries.items())}
    root = components[ROOT]
    root.type = ComponentType.APPLICATION
    bom.metadata.component = root
    bom.components.update(one for name, one in components.items() if name != ROOT)
    for name, one in components.items():
        needs = {*requirements(libraries[name])} & components.keys()
        bom.register_dependency(one, [components[need] for need in sorted(needs)])
    return JsonV1Dot6(bom).output_as_string(indent=1)


def _component(of: Distribution) -> Any:
    from cyclonedx.contrib.license.factories import LicenseFactory
    from cyclonedx.model.component import Component
    from packageurl import PackageURL

    name = canonicalize_name(of.name)
    about = of.metadata.json
    licence = str(about.get("license_expression") or about.get("license") or "").strip()
    if not licence or "\n" in licence:  # a whole text
        kinds = (row for row in about.get("classifier", ()) if "License ::" in row)
        licence = next(kinds, "").rpartition(" :: ")[2]
    return Component(
        name=name,
        version=of.version,
        purl=PackageURL("pypi", name=name, version=of.version),
        bom_ref=f"{name}=={of.version}",
        description=str(about.get("summary", "")),
        licenses=[LicenseFactory().make_from_string(licence)] if licence else [],
    )


if __name__ == "__main__":
    main()
