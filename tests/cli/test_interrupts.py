"""Ctrl-C while compiled code calls Python, which can pass no exception on."""

from __future__ import annotations

import ctypes
import signal
import sys
import time
from collections.abc import Callable, Iterator

import click
import pytest

from ptmtools.cli.main import main


@pytest.fixture(autouse=True)
def heeding_interrupts() -> Iterator[None]:
    """A suite in the background of a shell ignores Ctrl-C, and so would the program."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def callback() -> None:
    """As LLVM calls Numba while it compiles a loop."""
    ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGINT))()


def goes_on() -> None:
    callback()
    time.sleep(20)


def fails() -> None:
    callback()
    raise RuntimeError("no compiled object yet")


def wraps() -> None:
    """As C does where a function has a result and an exception."""
    try:
        signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt as fault:
        raise SystemError("returned a result with an exception set") from fault


@pytest.mark.parametrize("command", [goes_on, fails, wraps])
def test_an_interrupt_in_a_callback_is_an_interrupt(
    command: Callable[[], None],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(click.Group, "invoke", lambda *_: command())
    hook = sys.unraisablehook
    start = time.monotonic()
    assert main(["info"]) == 130
    assert time.monotonic() - start < 10
    printed = capsys.readouterr()
    assert printed.err == "ptm: interrupted; run the same command again to resume [PTM-X130]\n"
    assert sys.unraisablehook == hook
