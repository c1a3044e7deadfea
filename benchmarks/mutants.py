"""Changes constants, comparisons and signs of the product, one at a time, and runs the tests.

    python benchmarks/mutants.py [--count 40] [--only cells light] [--seed 1] [--limit 300]

A change that no test notices, a mutant that lives, marks code that no test guards. Mutants are
drawn from the folders of the product in turn; each is run against the tests of its folder
(``tests/FOLDER``), up to the first failure, in a copy of the files that git tracks. Folders whose
tests fail, or take too long, without a change are left out. The survivors are printed last, with
the line as changed. A run of 40 takes hours.
"""

from __future__ import annotations

import argparse
import ast
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PRODUCT = "ptmtools"
#: Operator → as written, and what replaces it.
COMPARISONS: dict[type[ast.cmpop], tuple[bytes, str]] = {
    ast.Lt: (b"<", "<="),
    ast.LtE: (b"<=", "<"),
    ast.Gt: (b">", ">="),
    ast.GtE: (b">=", ">"),
    ast.Eq: (b"==", "!="),
    ast.NotEq: (b"!=", "=="),
}
SIGNS: dict[type[ast.operator], tuple[bytes, str]] = {ast.Add: (b"+", "-"), ast.Sub: (b"-", "+")}


@dataclass(frozen=True)
class Mutant:
    """A change of one file: the source from ``start`` to ``end`` becomes ``text``."""

    path: Path
    line: int
    start: int
    end: int
    text: str

    @property
    def folder(self) -> str:
        """The folder below the product; of single files "."."""
        return self.path.parts[1] if len(self.path.parts) > 2 else "."

    def apply(self, source: str) -> str:
        data = source.encode()
        return (data[: self.start] + self.text.encode() + data[self.end :]).decode()


def find_mutants(path: Path, source: str) -> Iterator[Mutant]:
    """The changes that a file offers."""
    data = source.encode()
    offsets = [0]
    for line in data.splitlines(keepends=True):
        offsets.append(offsets[-1] + len(line))

    def begin(node: ast.expr) -> int:
        return offsets[node.lineno - 1] + node.col_offset

    def end(node: ast.expr) -> int:
        return offsets[(node.end_lineno or 1) - 1] + (node.end_col_offset or 0)

    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and type(node.value) in (int, float):
            changed = node.value + 1 if isinstance(node.value, int) else node.value * 1.5 + 0.1
            yield Mutant(path, node.lineno, begin(node), end(node), repr(changed))
            continue
        if isinstance(node, ast.Compare) and len(node.ops) == 1:
            change, first, second = (
                COMPARISONS.get(type(node.ops[0])),
                node.left,
                node.comparators[0],
            )
        elif isinstance(node, ast.BinOp):
            change, first, second = SIGNS.get(type(node.op)), node.left, node.right
        else:
            continue
        if change:  # parentheses and comments may stand beside the operator
            written, text = change
            place = data.find(written, end(first), begin(second))
            yield Mutant(path, node.lineno, place, place + len(written), text)


def is_valid(mutant: Mutant, source: str) -> bool:
    """Whether the changed source still parses, to another tree."""
    try:
        return ast.dump(ast.parse(mutant.apply(source))) != ast.dump(ast.parse(source))
    except (SyntaxError, ValueError):
        return False


def draw_mutants(root: Path, folders: list[str], count: int, seed: int) -> list[Mutant]:
    """``count`` mutants, of the folders in turn."""
    draw = random.Random(seed)
    by_folder: dict[str, list[Mutant]] = {}
    for path in sorted((root / PRODUCT).rglob("*.py")):
        source = path.read_text("utf-8")
        for mutant in find_mutants(path.relative_to(root), source):
            by_folder.setdefault(mutant.folder, []).append(mutant)
    names = [name for name in sorted(by_folder) if tests_of(root, name).is_dir()]
    names = [name for name in names if not folders or name in folders]
    drawn: list[Mutant] = []
    while names and len(drawn) < count:
        for name in list(names):
            rest = by_folder[name]
            while rest:
                mutant = rest.pop(draw.randrange(len(rest)))
                if is_valid(mutant, (root / mutant.path).read_text("utf-8")):
                    drawn.append(mutant)
                    break
            else:
                names.remove(name)
    return drawn[:count]


def tests_of(root: Path, folder: str) -> Path:
    return root / "tests" / folder


def tests_pass(copy: Path, folder: str, limit: float) -> bool:
    """Whether the tests of a folder pass within ``limit`` seconds."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider"]
    try:
        return not subprocess.run(
            [*command, str(tests_of(copy, folder))], cwd=copy, timeout=limit, capture_output=True
        ).returncode
    except subprocess.TimeoutExpired:
        return False


def lives(mutant: Mutant, copy: Path, limit: float) -> bool:
    """Whether the tests of a mutant's folder pass; tests that do not end notice it."""
    path = copy / mutant.path
    source = path.read_text("utf-8")
    path.write_text(mutant.apply(source), "utf-8")
    try:
        return tests_pass(copy, mutant.folder, limit)
    finally:
        path.write_text(source, "utf-8")


def copy_tracked(root: Path, target: Path) -> None:
    """Copies the files that git tracks."""
    names = subprocess.run(
        ["git", "ls-files", "-z"], cwd=root, check=True, capture_output=True, text=True
    ).stdout
    for name in filter(None, names.split("\0")):
        if (root / name).is_file():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(root / name, target / name)


def main(root: Path = ROOT) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--count", type=int, default=40, help="number of mutants")
    parser.add_argument("--only", nargs="*", default=[], metavar="FOLDER", help="of these folders")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=float, default=300, help="seconds for a run of tests")
    arguments = parser.parse_args()
    mutants = draw_mutants(root, arguments.only, arguments.count, arguments.seed)
    survivors = []
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        copy_tracked(root, copy)
        for name in sorted({mutant.folder for mutant in mutants}):
            if not tests_pass(copy, name, arguments.limit):
                print(f"tests/{name} do not pass without a change: left out", flush=True)
                mutants = [mutant for mutant in mutants if mutant.folder != name]
        for number, mutant in enumerate(mutants, 1):
            alive = lives(mutant, copy, arguments.limit)
            line = mutant.apply((root / mutant.path).read_text("utf-8")).splitlines()
            text = f"{mutant.path}:{mutant.line}: {line[mutant.line - 1].strip()}"
            print(f"{number}/{len(mutants)} {'lives' if alive else 'dies'} {text}", flush=True)
            survivors += [text] if alive else []
    print(f"\n{len(mutants) - len(survivors)} of {len(mutants)} die; alive:")
    print("\n".join(survivors))
    return 0


if __name__ == "__main__":
    sys.exit(main())
