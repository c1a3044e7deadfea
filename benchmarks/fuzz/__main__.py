"""Damaged and hostile files for every reader: only an error of ours or a result may come out.

    python -m benchmarks.fuzz [--count 100000] [--seed 1] [--jobs 1] [--only obj,mtl]
    python -m benchmarks.fuzz --show obj:1234 [-o a.obj]

An input is a finding if anything but a `PtmError` is raised, if it takes more than five seconds of
processor time or does not end, if the process grows by more than the limit that the reader was
given and a fixed allowance, if memory that it asked for was not to be had, if the process dies, and
if anything is written, opened, started or called outside of the folder that it may use. Inputs
follow from seed, kind and number: ``--show`` makes one again, reads it with the traceback, and with
``-o`` writes it to a file. Exit status 1 if there was a finding.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

from benchmarks.fuzz.child import generator
from benchmarks.fuzz.kinds import KINDS
from benchmarks.fuzz.runner import Summary, run


def main() -> None:
    """Prints the figures."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fuzz", description="Mutated files.")
    parser.add_argument("--count", type=int, default=100_000, help="inputs of all kinds together")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--start", type=int, default=0, help="number of the first input")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--only", default="", help=f"kinds, of {','.join(KINDS)}")
    parser.add_argument("--show", default="", metavar="KIND:NUMBER", help="one input, read aloud")
    parser.add_argument("-o", "--output", help="where that input goes")
    given = parser.parse_args()
    if given.show:
        show(given.show, given.seed, given.output)
        return
    names = [name for name in KINDS if not given.only or name in given.only.split(",")]
    whole = sum(KINDS[name].weight for name in names)
    os.nice(19)
    print(f"{'kind':<10}{'inputs':>9}{'read':>8}{'refused':>9}{'s each':>9}{'longest':>9}"
          f"{'most':>9}  findings", flush=True)  # fmt: skip
    actual: list[Summary] = []
    for name in names:
        count = max(1, round(given.count * KINDS[name].weight / whole))
        summary = run(name, KINDS[name].make, given.seed, given.start, count, given.jobs)
        actual.append(summary)
        print_summary(summary)
    total = sum(summary.read for summary in actual)
    findings = sum(len(summary.tally.findings) for summary in actual)
    seconds = sum(summary.seconds for summary in actual)
    print(f"{total:,} inputs, seed {given.seed}, in {seconds:,.0f} s: {findings} findings")
    sys.exit(bool(findings))


def print_summary(summary: Summary) -> None:
    """Prints one line for a kind, and its findings."""
    tally = summary.tally
    refused = sum(n for code, n in tally.outcomes.items() if code.startswith("PTM-"))
    each = summary.seconds * 1000 / max(1, summary.read)
    print(
        f"{summary.name:<10}{summary.read:>9,}{summary.read - refused:>8,}{refused:>9,}"
        f"{each:>6.1f} ms{tally.longest:>7.2f} s{tally.most / 1e6:>6.0f} MB  {len(tally.findings)}",
        flush=True,
    )
    common = ", ".join(f"{what} {n:,}" for what, n in tally.outcomes.most_common(12))
    print(f"          {common}")
    alike: dict[str, list[int]] = {}
    for number, what in tally.findings:
        alike.setdefault(what, []).append(number)
    for what, numbers in list(alike.items())[:15]:
        more = f" and {len(numbers) - 1} more" if len(numbers) > 1 else ""
        print(f"          ! {summary.name}:{numbers[0]}{more}: {what}", flush=True)


def show(which: str, seed: int, output: str | None) -> None:
    """Makes an input again, and reads it here; what is raised is shown."""
    name, _, number = which.partition(":")
    with tempfile.TemporaryDirectory() as scratch:
        inside, outside = Path(scratch) / "inside", Path(scratch) / "outside"
        inside.mkdir()
        outside.mkdir()
        target = KINDS[name].make(inside, outside)
        case = target.make(generator(seed, name, int(number)))
        print(f"{len(case.data)} bytes, {case.facts!r:.200}")
        if output:
            Path(output).write_bytes(case.data)
        print(target.read(case))


if __name__ == "__main__":
    main()
