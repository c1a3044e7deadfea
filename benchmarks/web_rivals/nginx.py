"""Debian's nginx as the server of the benchmark: static files as public hosts send them. The tests
also run the lines of the guide by it.

HTTP/1.1 comes without TLS, HTTP/2 with TLS 1.3 and a certificate of our own. Files that compress
have a ``.gz`` beside them (``gzip_static``). The server runs in a temporary folder with a
configuration of its own, on 127.0.0.1, and ends with the benchmark.
"""

from __future__ import annotations

import base64
import hashlib
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import unquote

from benchmarks.web_rivals.link import BUFFER
from ptmtools.output.emission import compress
from ptmtools.site.entry import SiteEntry

HTTP = ("1.1", "2")
#: s until it must accept connections.
_START = 10.0
_CONFIGURATION = """\
daemon off;
master_process off;
pid {folder}/pid;
error_log {folder}/error.log;
events {{ worker_connections 512; }}
http {{
  log_format short '$status $request';
  access_log {folder}/access.log short;
  client_body_temp_path {folder}/body;
  proxy_temp_path {folder}/proxy;
  fastcgi_temp_path {folder}/fastcgi;
  uwsgi_temp_path {folder}/uwsgi;
  scgi_temp_path {folder}/scgi;
{servers}
}}
"""
_SERVERS = """\
  types {{ {types} }}
  default_type application/octet-stream;
  tcp_nodelay on;
  keepalive_timeout 75;
  keepalive_requests 100000;
  gzip_static on;
  gzip_vary on;
  ssl_certificate {certificate};
  ssl_certificate_key {key};
  ssl_protocols TLSv1.3;
  server {{
    listen 127.0.0.1:{port} sndbuf={buffer}{secure};
    root {folder}/files;
    add_header Cache-Control "public, max-age=31536000";
  }}
"""


@dataclass(frozen=True)
class Certificate:
    """A certificate for 127.0.0.1: its files, and the fingerprint by which Chromium accepts it."""

    file: Path
    key: Path
    spki: str

    @property
    def flag(self) -> str:
        """Chromium treats the certificate as valid, so that it caches as it does elsewhere."""
        return f"--ignore-certificate-errors-spki-list={self.spki}"


@dataclass(frozen=True)
class Server:
    """A running nginx: its port, and the requests so far."""

    port: int
    log: Path

    def requests(self) -> list[str]:
        """A line for each, status and request line."""
        return self.log.read_text().splitlines() if self.log.is_file() else []


def require() -> None:
    """Raises SystemExit with what to install."""
    for program, package in (("nginx", "nginx-light"), ("openssl", "openssl")):
        if program_of(program) is None:
            raise SystemExit(f"{program} is missing; apt install {package}")


def program_of(name: str) -> str | None:
    """Debian keeps nginx where only root's path leads."""
    return shutil.which(name) or shutil.which(name, path="/usr/sbin:/sbin")


@contextmanager
def certificate() -> Iterator[Certificate]:
    """One for a day; elliptic, as most are."""
    require()
    with TemporaryDirectory(prefix="certificate-") as name:
        file, key = Path(name) / "own.pem", Path(name) / "own.key"
        curve = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1"]
        names = ["-subj", "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1"]
        files = ["-keyout", str(key), "-out", str(file)]
        command = ["openssl", "req", "-x509", "-nodes", "-days", "2", *curve, *names, *files]
        subprocess.run(command, check=True, capture_output=True)
        public = ["openssl", "x509", "-in", str(file), "-pubkey", "-noout"]
        text = subprocess.run(public, check=True, capture_output=True).stdout
        der = ["openssl", "pkey", "-pubin", "-outform", "der"]
        data = subprocess.run(der, check=True, capture_output=True, input=text).stdout
        yield Certificate(file, key, base64.b64encode(hashlib.sha256(data).digest()).decode())


@contextmanager
def nginx(files: Mapping[str, SiteEntry], http: str, own: Certificate) -> Iterator[Server]:
    """Serves files by one of `HTTP`.

    Raises SystemExit if it is not installed, RuntimeError with its log if it does not start.
    """
    require()
    with TemporaryDirectory(prefix="nginx-") as name:
        folder = Path(name)
        _write(files, folder / "files")
        port = free_port()
        servers = _SERVERS.format(
            folder=folder,
            types=" ".join(f'"{media}" {suffix};' for suffix, media in _types(files).items()),
            certificate=own.file,
            key=own.key,
            port=port,
            buffer=BUFFER,
            secure=" ssl http2" if http == "2" else "",
        )
        with running(servers, port, folder) as server:
            yield server


@contextmanager
def running(servers: str, port: int, folder: Path) -> Iterator[Server]:
    """Runs nginx with directives of its block ``http``, of which one listens on a port; its own
    files are in a folder. RuntimeError with its log if it does not start."""
    configuration, log = folder / "nginx.conf", folder / "error.log"
    configuration.write_text(_CONFIGURATION.format(folder=folder, servers=servers))
    command = [program_of("nginx") or "nginx", "-p", str(folder), "-c", str(configuration)]
    process = subprocess.Popen([*command, "-e", str(log)])
    try:
        _wait_for(port, process, log)
        yield Server(port, folder / "access.log")
    finally:
        process.terminate()
        try:
            process.wait(30)
        except subprocess.TimeoutExpired:
            # A signal that comes while it starts its worker can be lost.
            process.kill()
            process.wait()


def _write(files: Mapping[str, SiteEntry], folder: Path) -> None:
    for name, entry in files.items():
        path = folder / unquote(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(entry.source, Path) and not entry.compressed:
            path.symlink_to(entry.source.resolve())
            continue
        data = entry.read()
        path.write_bytes(data)
        if entry.compressed and len(small := compress(data)) < len(data):
            path.with_name(f"{path.name}.gz").write_bytes(small)


def _types(files: Mapping[str, SiteEntry]) -> dict[str, str]:
    """Media type by suffix."""
    return {name.rsplit(".", 1)[-1]: entry.media for name, entry in files.items() if "." in name}


def free_port() -> int:
    """A port of this machine that nothing listens on."""
    with socket.create_server(("127.0.0.1", 0)) as one:
        return int(one.getsockname()[1])


def _wait_for(port: int, process: subprocess.Popen[bytes], log: Path) -> None:
    end = time.monotonic() + _START
    while time.monotonic() < end and process.poll() is None:
        try:
            socket.create_connection(("127.0.0.1", port), timeout=1).close()
        except OSError:
            time.sleep(0.02)
        else:
            return
    raise RuntimeError(f"nginx did not start: {log.read_text() if log.is_file() else ''}")
