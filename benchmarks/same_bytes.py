"""Builds and publishes models in two checkouts, and names the files that differ.

    python benchmarks/same_bytes.py OLD [NEW] [--models two_rooms museum hospital …]

A change that is not meant to change the output is checked against the commit before it. Each
checkout has its own environment, ``.venv`` (`make setup`). Files of ``www/`` and of the published
site are compared, and the digests of a checkout are kept in its ``build/bench/bytes``, by commit;
a working tree with changes is always built again.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import time
from hashlib import sha256
from pathlib import Path

from scenes import ROOT, SHARED, TWO_ROOMS

#: Models, and further arguments of the build.
MODELS: dict[str, tuple[Path, tuple[str, ...]]] = {
    "two_rooms": (TWO_ROOMS, ()),
    "museum": (ROOT / "build/museum/museum.obj", ()),
    "hospital": (SHARED / "scenes/hospital/hospital.obj", ()),
    "gallery": (SHARED / "scenes/gallery/gallery.glb", ()),
    "office": (SHARED / "scenes/office/office.obj", ()),
    "willowgarage": (SHARED / "scenes/willowgarage/willowgarage.obj", ()),
    "apo": (TWO_ROOMS, ("--apo", "*", "--format", "vrml,gltf,interlace")),
    "ifc": (ROOT / "build/bench/house.ifc", ()),
}

Digests = dict[str, str]


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path, nargs="?", default=ROOT)
    parser.add_argument("--models", nargs="+", choices=MODELS, default=list(MODELS))
    given = parser.parse_args()
    print("| model | files | differ | s old | s new |\n|---|---|---|---|---|")
    different: list[str] = []
    for name in given.models:
        (old, before), (new, after) = (of_checkout(root, name) for root in (given.old, given.new))
        names = sorted(f for f in old.keys() | new.keys() if old.get(f) != new.get(f))
        different += [f"{name}: {file}" for file in names]
        print(f"| {name} | {len(new)} | {len(names)} | {before:.1f} | {after:.1f} |", flush=True)
    print("\n".join(different[:200]))
    return int(bool(different))


def of_checkout(root: Path, name: str) -> tuple[Digests, float]:
    """The SHA-256 of each served and published file of a model, and the seconds of its build."""
    root = root.resolve()
    commit = output(root, "git", "rev-parse", "--short=12", "HEAD")
    clean = not output(root, "git", "status", "--porcelain", "--untracked-files=no")
    kept = root / "build/bench/bytes" / commit / f"{name}.json"
    if clean and kept.is_file():
        digests, seconds = json.loads(kept.read_text("utf-8"))
        return digests, seconds
    digests, seconds = build(root, name)
    if clean:
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps([digests, seconds], indent=1))
    return digests, seconds


def build(root: Path, name: str) -> tuple[Digests, float]:
    """Builds and publishes a model with the code of a checkout."""
    model, options = MODELS[name]
    make_model(name, model)
    folder = root / "build/bench/bytes" / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    start = time.perf_counter()
    ptm(root, "build-scene", model, "-o", folder / "db", *options)
    seconds = time.perf_counter() - start
    ptm(root, "publish", folder / "db", "-o", folder / "site")
    digests = {
        str(file.relative_to(folder)): sha256(file.read_bytes()).hexdigest()
        for part in (folder / "db/www", folder / "site")
        for file in sorted(part.rglob("*"))
        if file.is_file()
    }
    shutil.rmtree(folder)
    return digests, seconds


def make_model(name: str, model: Path) -> None:
    """Writes a sample model that is missing."""
    if model.is_file():
        return
    model.parent.mkdir(parents=True, exist_ok=True)
    if name == "museum":
        subprocess.run([sys.executable, "-m", "ptmtools", "sample", "museum", "-o", model.parent])
    if name == "ifc":
        from tests.scene.ifc.ifc_house import Ifc, house

        house(Ifc()).write(model)


def ptm(root: Path, *arguments: object) -> None:
    call = [root / ".venv/bin/python", "-m", "ptmtools", "--quiet", *map(str, arguments)]
    subprocess.run(call, check=True, cwd=root)


def output(root: Path, *call: str) -> str:
    return subprocess.run(call, check=True, cwd=root, capture_output=True, text=True).stdout.strip()


if __name__ == "__main__":
    sys.exit(main())
