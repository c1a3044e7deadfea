"""A web page in headless Chromium.

A server on this machine hands out the page and folders beside it; the page posts what the console
says, and at last what it was made to find out. Only the loopback address can be reached.
"""

from __future__ import annotations

import functools
import io
import os
import re
import shutil
import signal
import subprocess
import tempfile
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

#: At the head of a page: `post`, and the console's complaints posted to /say. What is posted to
#: /done ends the visit.
REPORTING = """\
<!DOCTYPE html>
<meta charset="utf-8">
<style>body { margin: 0 }</style>
<script>
const post = (where, what) => fetch(where, { method: "POST", body: what });
for (const kind of ["warn", "error"]) {
  const say = console[kind];
  console[kind] = (...what) => { post("/say", `${kind}: ${what.join(" ")}`); say(...what); };
}
addEventListener("error", (event) => post("/say", `error: ${event.message}`));
addEventListener("unhandledrejection", (event) => post("/say", `error: ${event.reason}`));
</script>
"""
#: Switches off what playwright does, whose list this replaces, and the popups of the address bar:
#: each window of a headless browser starts two processes for them, in a second of processor time.
WITHOUT_POPUPS = "--disable-features=" + ",".join(
    (
        "AimEnabled",
        "AvoidCorsURLLoaderRestartOnRedirect",
        "AvoidUnnecessaryBeforeUnloadCheckSync",
        "DestroyProfileOnBrowserClose",
        "HttpsFirstBalancedModeAutoEnable",
        "HttpsUpgrades",
        "LensOverlay",
        "MediaRouter",
        "NetworkTimeServiceQuerying",
        "OptimizationHints",
        "PaintHolding",
        "PreconnectToSearch",
        "ThirdPartyStoragePartitioning",
        "WebUIOmniboxAimPopup",
        "WebUIOmniboxPopup",
    )
)
FLAGS = (
    "--headless",
    WITHOUT_POPUPS,
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1",
)


@dataclass
class Visit:
    """What a page posted to /done, the lines of its console, and what was asked of the server;
    ``ranges`` are (path, first byte, first byte behind), in order."""

    body: bytes = b""
    messages: list[str] = field(default_factory=list)
    paths: list[str] = field(default_factory=list)
    ranges: list[tuple[str, int, int]] = field(default_factory=list)
    done: threading.Event = field(default_factory=threading.Event)


def chromium() -> str | None:
    """The program, if it is installed."""
    names = ("chromium", "chromium-browser", "google-chrome")
    return next((actual for name in names if (actual := shutil.which(name))), None)


def visit(
    page: str,
    folders: Mapping[str, Path],
    *,
    width: int = 640,
    height: int = 480,
    seconds: float = 120,
) -> Visit:
    """Opens a page; ``folders`` are served as /NAME/….

    Raises FileNotFoundError without Chromium, TimeoutError if nothing is posted to /done.
    """
    program = chromium()
    if program is None:
        raise FileNotFoundError("chromium")
    seen = Visit()
    handler = functools.partial(_Handler, page=page, folders=folders, seen=seen)
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        with tempfile.TemporaryDirectory(prefix="chromium-", ignore_cleanup_errors=True) as home:
            quiet = subprocess.DEVNULL
            process = subprocess.Popen(
                [
                    program,
                    *FLAGS,
                    f"--user-data-dir={home}",
                    f"--window-size={width},{height + 100}",
                    f"http://127.0.0.1:{server.server_port}/page",
                ],
                stdin=quiet,
                stdout=quiet,
                stderr=quiet,
                start_new_session=True,
                env={**os.environ, "HOME": home},
            )
            try:
                if not seen.done.wait(seconds):
                    printed = "; ".join(seen.messages) or "and the console said nothing"
                    raise TimeoutError(f"the page was not done within {seconds:.0f} s: {printed}")
            finally:
                # A profile of its own: nothing is lost, and asked kindly it takes 10 s.
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
    return seen


class _Handler(SimpleHTTPRequestHandler):
    """/page; /NAME/… from the folders; what the page posts goes into the visit."""

    extensions_map = SimpleHTTPRequestHandler.extensions_map | {
        ".js": "text/javascript",
        ".glb": "model/gltf-binary",
    }

    def __init__(
        self, *arguments: object, page: str, folders: Mapping[str, Path], seen: Visit
    ) -> None:
        self.page, self.folders, self.seen = page, folders, seen
        super().__init__(*arguments)  # type: ignore[arg-type]

    def do_GET(self) -> None:
        path = urlsplit(self.path).path
        self.seen.paths.append(path)
        if path == "/page":
            body = self.page.encode()
            self.send_response(200)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)
        else:
            super().do_GET()

    def send_head(self) -> Any:
        """A range of a file, if one is asked for."""
        wanted = re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers.get("Range", ""))
        path = Path(self.translate_path(self.path))
        if wanted is None or not path.is_file():
            return super().send_head()
        size = path.stat().st_size
        begin, end = int(wanted[1]), min(int(wanted[2]) + 1, size)
        self.seen.ranges.append((urlsplit(self.path).path, begin, end))
        self.send_response(206 if begin < size else 416)
        self.send_header("Content-Type", "application/octet-stream")
        reported = f"{begin}-{end - 1}" if begin < size else "*"
        self.send_header("Content-Range", f"bytes {reported}/{size}")
        part = path.read_bytes()[begin:end]
        self.send_header("Content-Length", str(len(part)))
        self.end_headers()
        return io.BytesIO(part)

    def translate_path(self, path: str) -> str:
        _, name, rest = (path + "//").split("/", 2)
        self.directory = str(self.folders.get(name, "no such folder"))
        return super().translate_path("/" + rest.rstrip("/"))

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.send_response(204)
        self.end_headers()
        if self.path == "/done":
            self.seen.body = body
            self.seen.done.set()
        else:
            self.seen.messages.append(body.decode(errors="replace"))

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        if "favicon" not in self.path:
            self.seen.messages.append(f"error: {code} {self.path}")
        super().send_error(code, message, explain)

    def log_message(self, format: str, *arguments: object) -> None:
        pass
