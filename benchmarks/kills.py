"""Kills a build repeatedly and verifies that the next build repairs the result.

Builds the model once undisturbed. Then, repeatedly and in a new folder, starts the build, kills it
(SIGKILL) at a random instant, or before its n-th change of a name on the disk (rename, link,
unlink, mkdir, rmdir) for every n, and runs it again. The result must equal the undisturbed
database byte for byte and contain nothing else.

With ``--update`` the killed build updates a finished database with other options.

    python benchmarks/kills.py MODEL [--random 50] [--names] [--update]
"""

from __future__ import annotations

import argparse
import hashlib
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from ptmtools.cli.main import main as ptm

#: Events of Python's audit hooks that change names on the disk.
NAMES = frozenset({"os.rename", "os.link", "os.remove", "os.mkdir", "os.rmdir"})
UPDATE = ("--samples", "3", "--profile", "raw", "--title", "updated")


def dying(n: int, folder: Path) -> None:
    """From now on this process kills itself before its ``n``-th change of a name below a folder."""
    left = n
    below = os.fsencode(folder.absolute())

    def hook(event: str, values: tuple[object, ...]) -> None:
        nonlocal left
        if event in NAMES and any(_is_below(value, below) for value in values):
            left -= 1
            if left == 0:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(hook)


def _is_below(value: object, folder: bytes) -> bool:
    if not isinstance(value, str | bytes | os.PathLike):
        return False
    return os.fsencode(os.path.abspath(os.fsencode(value))).startswith(folder)


def state(folder: Path) -> dict[str, str]:
    """Every file and folder below a folder; of files the digest."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        if path.is_file()
        else ""
        for path in sorted(folder.rglob("*"))
    }


def child(db: Path, n: int, arguments: Sequence[str]) -> list[str]:
    """The command of a build that dies at its ``n``-th change of a name; 0 is none."""
    return [sys.executable, __file__, "--child", str(n), "--below", str(db), "--", *arguments]


def quietly(command: Sequence[str]) -> int:
    return subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode


class Trial:
    """Builds of one model in new folders."""

    def __init__(self, model: Path, folder: Path, options: Sequence[str], update: bool) -> None:
        self.model, self.folder, self.options, self.update = model, folder, options, update
        self.whole = folder / "whole"
        start = time.perf_counter()
        assert self.build(self.whole, ()) == 0
        if update:
            self.old = Path(shutil.copytree(self.whole, folder / "old"))
            start = time.perf_counter()
            assert self.build(self.whole, UPDATE) == 0
        self.seconds = time.perf_counter() - start
        self.wanted = state(self.whole)

    def build(self, db: Path, more: Sequence[str]) -> int:
        return quietly([sys.executable, "-m", "ptmtools", *self.arguments(db, more)])

    def arguments(self, db: Path, more: Sequence[str]) -> list[str]:
        return ["-q", "build-scene", str(self.model), "-o", str(db), *self.options, *more]

    def killed(self, kill: Callable[[Path, Sequence[str]], bool]) -> str | None:
        """What is wrong after a kill and another run: "" nothing, None it was not killed."""
        db = self.folder / "killed"
        shutil.rmtree(db, ignore_errors=True)
        more: Sequence[str] = UPDATE if self.update else ()
        if self.update:
            shutil.copytree(self.old, db)
        if not kill(db, more):
            return None
        if (status := ptm(self.arguments(db, more))) != 0:
            return f"the next run ends with {status}"
        actual = state(db)
        wrong = [n for n in {**actual, **self.wanted} if actual.get(n) != self.wanted.get(n)]
        return ", ".join(sorted(wrong)[:3])

    def at_name(self, n: int) -> str | None:
        def kill(db: Path, more: Sequence[str]) -> bool:
            return quietly(child(db, n, self.arguments(db, more))) == -signal.SIGKILL

        return self.killed(kill)

    def after(self, seconds: float) -> str | None:
        def kill(db: Path, more: Sequence[str]) -> bool:
            quiet = subprocess.DEVNULL
            command = [sys.executable, "-m", "ptmtools", *self.arguments(db, more)]
            with subprocess.Popen(command, stdout=quiet, stderr=quiet) as process:
                try:
                    process.wait(seconds)
                except subprocess.TimeoutExpired:
                    process.kill()
            return process.returncode == -signal.SIGKILL

        return self.killed(kill)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("model", type=Path, nargs="?")
    parser.add_argument("--random", type=int, default=50, metavar="N", help="kills at random")
    parser.add_argument("--names", action="store_true", help="and one before each change of a name")
    parser.add_argument("--update", action="store_true", help="of a build that updates a database")
    parser.add_argument("--options", default="", help="of the build")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--child", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--below", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("arguments", nargs="*", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.child is not None:
        dying(asked.child, asked.below)
        return ptm([str(asked.model), *asked.arguments])

    with tempfile.TemporaryDirectory(prefix="kills-") as folder:
        trial = Trial(asked.model, Path(folder), asked.options.split(), asked.update)
        print(f"undisturbed: {trial.seconds:.1f} s, {len(trial.wanted)} files and folders")
        draw = random.Random(asked.seed)
        failed = done = late = 0
        while done < asked.random:
            instant = draw.uniform(0, trial.seconds)
            wrong = trial.after(instant)
            late += wrong is None
            done += wrong is not None
            failed += bool(wrong)
            if wrong:
                print(f"killed after {instant:.3f} s: {wrong}")
        print(
            f"{done - failed} of {done} killed at random instants ended as undisturbed "
            f"({late} had ended before)"
        )
        n = 1
        while asked.names and (wrong := trial.at_name(n)) is not None:
            failed += bool(wrong)
            if wrong:
                print(f"killed before change {n} of a name: {wrong}")
            n += 1
        if asked.names:
            print(f"killed before each of {n - 1} changes of names: {failed} failures in all")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
