"""Object stores on this machine: moto's S3 and an emulator of Google's, each with its requests."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

GUIDE = Path(__file__).parents[1] / "docs" / "guide"
#: What a client of the store needs; AWS_ENDPOINT_URL is added.
CREDENTIALS = {
    "AWS_ACCESS_KEY_ID": "tester",
    "AWS_SECRET_ACCESS_KEY": "secret",
    "AWS_DEFAULT_REGION": "us-east-1",
    "AWS_MAX_ATTEMPTS": "1",
}


@dataclass(frozen=True)
class Request:
    """A request to a store: method, path, the agent, the bytes of its body, and whether it asks for
    a range."""

    method: str
    path: str
    agent: str
    sent: int
    ranged: bool


@dataclass
class Store:
    """A running store.

    Attributes
    ----------
    url: of its interface, ``http://127.0.0.1:PORT``.
    requests: all so far, in order.
    refuse: requests that it answers with 403 instead.
    """

    url: str
    requests: list[Request] = field(default_factory=list)
    refuse: Callable[[Request], bool] = lambda request: False

    def written(self, bucket: str) -> list[str]:
        """The names of the objects that were sent, in order."""
        begin = f"/{bucket}/"
        return [
            request.path.removeprefix(begin)
            for request in self.requests
            if request.method == "PUT" and request.path.startswith(begin)
        ]

    def make_bucket(self, name: str) -> None:
        """A new bucket, with the policy of the guide: browsers may read its objects."""
        policy = (GUIDE / "publish.md").read_text()
        policy = policy[policy.index('{"Version"') :].partition("\n```")[0]
        client = self.client()
        client.create_bucket(Bucket=name)
        client.put_bucket_policy(Bucket=name, Policy=policy.replace("BUCKET", name))

    def client(self) -> Any:
        """A client that is not fsspec's."""
        import boto3

        return boto3.client("s3", endpoint_url=self.url)


@contextmanager
def s3_store() -> Iterator[Store]:
    """moto's S3 on a free port; ImportError without moto."""
    from moto.moto_server.werkzeug_app import (
        DomainDispatcherApplication,
        MotoRequestHandler,
        create_backend_app,
    )
    from werkzeug.serving import make_server

    class Quiet(MotoRequestHandler):
        def log_request(self, *_: object) -> None:
            pass

    application = DomainDispatcherApplication(create_backend_app)
    changing = threading.Lock()

    def recorded(environ: dict[str, Any], start: Callable[..., Any]) -> Iterable[bytes]:
        request = Request(
            environ["REQUEST_METHOD"],
            environ["PATH_INFO"],
            environ.get("HTTP_USER_AGENT", ""),
            int(environ.get("CONTENT_LENGTH") or 0),
            "HTTP_RANGE" in environ,
        )
        with changing:
            store.requests.append(request)
            refused = store.refuse(request)
        if refused:
            environ["wsgi.input"].read(request.sent)
            start("403 Forbidden", [("Content-Type", "application/xml")])
            return [b"<Error><Code>AccessDenied</Code><Message>refused</Message></Error>"]
        answer: Iterable[bytes] = application(environ, start)
        return answer

    server = make_server("127.0.0.1", 0, recorded, True, request_handler=Quiet)
    store = Store(f"http://127.0.0.1:{server.server_port}")
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield store
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@contextmanager
def gs_store(bucket: str) -> Iterator[str]:
    """An emulator of Google's store with a bucket on a free port; its URL. ImportError without."""
    from gcp_storage_emulator.server import create_server

    server = create_server("127.0.0.1", 0, in_memory=True, default_bucket=bucket)
    server.start()
    try:
        yield f"http://127.0.0.1:{server._api._httpd.server_port}"
    finally:
        server.stop()
