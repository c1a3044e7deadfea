"""X_ITE in headless Chromium: the picture of a file's first viewpoint, as a web page shows it.

A server on this machine hands out the page, X_ITE and the files; the page posts what the console
said and, once nothing is loading any more and two pictures in a row are equal, the canvas as PNG.
So nothing waits for a guessed time: Chromium's virtual time and its own ``--screenshot`` fire
before WebGL has drawn. Only the loopback address can be reached.

X_ITE makes a texture of its own for every ImageTexture node, one per shape. The sample museum has
1,145 of them: 6 GB at 1024² in a software renderer, and no picture within 200 s. So the server
hands out PNG files reduced to `TEXTURE_SIDE` unless told otherwise; the VRML files are untouched.
"""

from __future__ import annotations

import base64
import functools
import io
import json
import os
import shutil
import signal
import subprocess
import tempfile
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import quote, urlsplit

from PIL import Image

TEXTURE_SIDE = 256
X_ITE_VERSION = "15.0.1"
ROOT = Path(__file__).resolve().parents[3]
DIST = Path("build/browsers/node_modules/x_ite/dist")
INSTALL = (
    "npm install --no-save --no-package-lock --ignore-scripts --no-audit --no-fund "
    f"--prefix build/browsers x_ite@{X_ITE_VERSION}"
)

PAGE = """\
<!DOCTYPE html>
<meta charset="utf-8">
<style>
body {{ margin: 0 }}
x3d-canvas {{ display: block; width: {width}px; height: {height}px }}
</style>
<script>
const post = (where, what) => fetch(where, {{ method: "POST", body: what }});
for (const kind of ["warn", "error"]) {{
  const say = console[kind];
  console[kind] = (...what) => {{ post("/say", `${{kind}}: ${{what.join(" ")}}`); say(...what); }};
}}
addEventListener("error", (event) => post("/say", `error: ${{event.message}}`));
addEventListener("unhandledrejection", (event) => post("/say", `error: ${{event.reason}}`));
</script>
<x3d-canvas preserveDrawingBuffer="true" splashScreen="false" notifications="false"
            contextMenu="false" contentScale="1"></x3d-canvas>
<!-- After the element: X_ITE reads preserveDrawingBuffer once, when the element is made. -->
<script src="/x_ite/x_ite.min.js"></script>
<script>
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
(async () => {{
  const canvas = document.querySelector("x3d-canvas");
  while (!canvas.browser) await pause(20);
  try {{
    await canvas.browser.loadURL(new X3D.MFString({url}));
    let last = "", picture = "";
    do {{
      last = picture;
      for (let k = 0; k < 5; ++k) await canvas.browser.nextFrame();
      await pause(150);
      picture = canvas.toDataURL("image/png");
    }} while (picture !== last);
    await post("/done", picture);
  }} catch (fault) {{
    await post("/say", `error: ${{fault}}`);
    await post("/done", "");
  }}
}})();
</script>
"""


@dataclass
class Shot:
    """A picture as PNG bytes (empty if there is none) and the lines of the console."""

    png: bytes = b""
    messages: list[str] = field(default_factory=list)
    done: threading.Event = field(default_factory=threading.Event)


def dist() -> Path | None:
    """The folder of X_ITE's files: named by PTM_X_ITE, else installed under ``build``."""
    folder = Path(os.environ.get("PTM_X_ITE", ROOT / DIST))
    return folder if (folder / "x_ite.min.js").is_file() else None


def chromium() -> str | None:
    names = ("chromium", "chromium-browser", "google-chrome")
    return next((found for name in names if (found := shutil.which(name))), None)


def missing() -> str | None:
    """What to install first, or None."""
    lacking = [] if chromium() else ["apt install chromium"]
    lacking += [] if dist() else [f"in the checkout: {INSTALL}"]
    return "; ".join(lacking) or None


class _Handler(SimpleHTTPRequestHandler):
    """/page; /x_ite/… and /db/… from their folders; what the page posts goes into the shot."""

    def __init__(
        self,
        *arguments: object,
        page: str,
        folders: dict[str, Path],
        shot: Shot,
        reduced: Callable[[Path], bytes],
    ) -> None:
        self.page, self.folders, self.shot, self.reduced = page, folders, shot, reduced
        super().__init__(*arguments, directory=str(folders["db"]))  # type: ignore[arg-type]

    def guess_type(self, path: str | os.PathLike[str]) -> str:
        return "model/vrml" if str(path).endswith(".wrl") else super().guess_type(path)

    def do_GET(self) -> None:
        path = urlsplit(self.path).path
        file = Path(self.translate_path(path))
        if path == "/page":
            self._answer("text/html; charset=utf-8", self.page.encode())
        elif path.startswith("/db/") and file.suffix == ".png" and file.is_file():
            self._answer("image/png", self.reduced(file))
        else:
            super().do_GET()

    def _answer(self, kind: str, body: bytes) -> None:
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def translate_path(self, path: str) -> str:
        _, name, rest = (path + "//").split("/", 2)
        self.directory = str(self.folders.get(name, self.folders["db"] / "no such folder"))
        return super().translate_path("/" + rest.rstrip("/"))

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.send_response(204)
        self.end_headers()
        if self.path == "/done":
            self.shot.png = base64.b64decode(body.partition(b",")[2])
            self.shot.done.set()
        else:
            self.shot.messages.append(body.decode(errors="replace"))

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        if "favicon" not in self.path:
            self.shot.messages.append(f"error: {code} {self.path}")
        super().send_error(code, message, explain)

    def log_message(self, format: str, *arguments: object) -> None:
        pass


def _reducer(side: int | None) -> Callable[[Path], bytes]:
    """Reads a PNG file, reduced to at most ``side`` texels, once."""
    lock = threading.Lock()
    held: dict[Path, bytes] = {}

    def read(path: Path) -> bytes:
        with lock:
            if path not in held:
                out = io.BytesIO(path.read_bytes())
                with Image.open(out) as image:
                    if side is not None and max(image.size) > side:
                        image.thumbnail((side, side), Image.Resampling.BOX)
                        out = io.BytesIO()
                        image.save(out, "PNG")
                held[path] = out.getvalue()
        return held[path]

    return read


def screenshot(
    path: Path,
    *,
    width: int = 640,
    height: int = 480,
    seconds: float = 120,
    texture_side: int | None = TEXTURE_SIDE,
) -> Shot:
    """Shows a file, whose folder is served with all that is below it.

    Raises FileNotFoundError without Chromium or X_ITE, TimeoutError if no picture comes.
    """
    program, library = chromium(), dist()
    if program is None or library is None:
        raise FileNotFoundError(missing())
    shot = Shot()
    url = json.dumps(f"/db/{quote(path.name)}")
    page = PAGE.format(width=width, height=height, url=url)
    folders = {"x_ite": library, "db": path.parent}
    handler = functools.partial(
        _Handler, page=page, folders=folders, shot=shot, reduced=_reducer(texture_side)
    )
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        with tempfile.TemporaryDirectory(prefix="chromium-", ignore_cleanup_errors=True) as home:
            command = [
                program,
                "--headless",
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
                f"--user-data-dir={home}",
                f"--window-size={width},{height + 100}",
                f"http://127.0.0.1:{server.server_port}/page",
            ]
            quiet = subprocess.DEVNULL
            process = subprocess.Popen(
                command,
                stdin=quiet,
                stdout=quiet,
                stderr=quiet,
                start_new_session=True,
                env={**os.environ, "HOME": home},
            )
            try:
                if not shot.done.wait(seconds):
                    said = "; ".join(shot.messages) or "and the console said nothing"
                    raise TimeoutError(f"no picture of {path} within {seconds:.0f} s: {said}")
            finally:
                # A profile of its own: nothing is lost, and asked kindly it takes 10 s.
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
    return shot
