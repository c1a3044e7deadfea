"""Windows and macOS: the package without modules and calls that only POSIX, or only Linux, has."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TWO_ROOMS = ROOT / "sample_data/two_rooms/two_rooms.obj"
#: Windows lacks these modules and names.
MODULES = ("fcntl", "resource", "pwd", "grp", "termios", "_posixsubprocess", "_posixshmem")
NAMES = {
    "os": (
        *("O_NOFOLLOW", "O_CLOEXEC", "O_NONBLOCK", "O_NOCTTY", "O_TMPFILE", "pwrite", "pread"),
        *("fork", "getuid", "geteuid", "mkfifo", "sched_getaffinity", "killpg", "setsid"),
    ),
    "signal": ("pthread_sigmask", "SIGKILL", "SIGHUP"),
}
#: Everything that numpy and numba take from them has been imported before they go.
WITHOUT = """
import os, signal, sys, tempfile
import numpy, numba, shapely, embreex, PIL.Image, subprocess, multiprocessing.context
import multiprocessing.spawn, multiprocessing.popen_spawn_posix, multiprocessing.resource_tracker
import logging, uuid, platform, rich.console
{imports}
locked = {{}}  # file: descriptor

class Msvcrt:
    '''Locks of one byte, in one process; by file, as on Windows.'''
    LK_NBLCK, LK_UNLCK = 2, 0

    @staticmethod
    def locking(descriptor, mode, count):
        status = os.fstat(descriptor)
        key = status.st_dev, status.st_ino
        if key in locked:
            raise PermissionError(13, 'locked')
        locked[key] = descriptor
        assert os.lseek(descriptor, 0, os.SEEK_CUR) >= 1 << 20, 'the name must stay readable'

close, path_exists = os.close, os.path.exists

def closing(descriptor):
    for key in [key for key, held in locked.items() if held == descriptor]:
        del locked[key]
    close(descriptor)

os.close = closing
tempfile.TemporaryFile = tempfile.NamedTemporaryFile
os.path.exists = lambda path: not str(path).startswith('/proc/') and path_exists(path)
os.kill = lambda *_: sys.exit('signal 0 ends the process on Windows')
sys.modules['msvcrt'] = Msvcrt
for module in {modules}:
    sys.modules[module] = None
for owner, names in {names}.items():
    for name in names:
        if hasattr(sys.modules[owner], name):
            delattr(sys.modules[owner], name)
"""


def without_posix(script: str, folder: Path, imports: str = "") -> str:
    """Runs a script in a Python that lacks them; returns what it prints."""
    head = WITHOUT.format(modules=MODULES, names=NAMES, imports=imports)
    done = subprocess.run(
        [sys.executable, "-c", head + script],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_every_module_can_be_imported(tmp_path: Path) -> None:
    script = """
import importlib, pkgutil
import ptmtools
from ptmtools.errors import PtmError
for module in pkgutil.walk_packages(ptmtools.__path__, 'ptmtools.'):
    if not module.name.endswith('__main__'):
        importlib.import_module(module.name)
print('all')
"""
    libraries = "import asyncio, distributed, fsspec, ifcopenshell, matplotlib.figure, starlette"
    libraries += "\nimport uvicorn, xatlas, trimesh, moderngl, pymeshlab, webbrowser, pxr.Usd"
    assert without_posix(script, tmp_path, libraries) == "all\n"


def test_a_database_is_built_locked_and_updated(tmp_path: Path) -> None:
    script = f"""
from ptmtools.cli.main import main
model = {str(TWO_ROOMS)!r}
assert main(['-q', 'build-scene', model, '-o', 'db', '-j', '1']) == 0
from ptmtools.store.lock import acquire, holder, is_held
from pathlib import Path
folder = Path('db')
assert not is_held(folder) and not (folder / '.ptm-lock').exists()
release = acquire(folder)
assert is_held(folder) and holder(folder).pid == os.getpid()
assert main(['-q', 'build-scene', model, '-o', 'db', '-j', '1', '--max-leaves', '3']) == 5
release()
assert not is_held(folder) and not (folder / '.ptm-lock').exists()
assert main(['-q', 'build-scene', model, '-o', 'db', '-j', '1']) == 0
assert main(['-q', 'validate', 'db']) == 0
"""
    without_posix(script, tmp_path)


def test_workers_share_a_value_by_a_file_with_a_name(tmp_path: Path) -> None:
    script = """
import operator, numpy as np
from ptmtools.parallel import _shared_file, _over_file
tempfile.tempdir = os.getcwd()
with _shared_file(np.arange(10000)) as file:
    assert os.path.dirname(file.path) == os.getcwd()
    answers, fault = _over_file(file, operator.getitem, [3, 5])
assert (list(answers), fault) == ([3, 5], None), (answers, fault)
assert os.listdir('.') == []
"""
    without_posix(script, tmp_path)


#: Calls of one system → the condition that guards them, or why each is safe.
GUARDED = {
    "ptmtools/store/lock.py": {"import fcntl": "except ImportError", "os.kill": "fcntl is None"},
    "ptmtools/scene/sandbox.py": {"import resource": "suppress(ImportError"},
    "ptmtools/pipeline/report.py": {"import resource": "except ImportError"},
    "ptmtools/parallel.py": {
        "os.sched_getaffinity": "except AttributeError",
        "signal.pthread_sigmask": 'hasattr(signal, "pthread_sigmask")',
    },
    "ptmtools/files.py": {"os.O_TMPFILE": "except (AttributeError", "os.O_CLOEXEC": "os.O_TMPFILE"},
}
PATTERN = re.compile(
    rf"import (?:fcntl|resource|pwd|grp|termios)\b|os\.(?:kill|{'|'.join(NAMES['os'])})\b"
    rf"|signal\.(?:{'|'.join(NAMES['signal'])})\b"
)


def test_calls_of_one_system_have_an_alternative() -> None:
    for file in ROOT.glob("ptmtools*/**/*.py"):
        text = file.read_text(encoding="utf-8")
        guards = GUARDED.get(file.relative_to(ROOT).as_posix(), {})
        for call in {match.group() for match in PATTERN.finditer(text)}:
            assert call in guards, f"{file}: {call} has no alternative on another system"
            assert guards[call] in text
