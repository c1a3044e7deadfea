"""An HTTP client of a server in a thread."""

from __future__ import annotations

import http.client
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from random import Random
from urllib.parse import urlsplit

PAGE = b"<!DOCTYPE html><p>hello</p>" * 20
TEXTS = b'{"cells": [1, 2, 3]}' * 500
NOISE = Random(1).randbytes(700_000)


@dataclass(frozen=True)
class Answer:
    """A response: status, headers by their names in small letters, body."""

    status: int
    headers: dict[str, str]
    body: bytes


class Client:
    """A connection that is kept."""

    def __init__(self, url: str) -> None:
        self.connection = http.client.HTTPConnection(urlsplit(url).netloc, timeout=20)

    def __call__(
        self, path: str, method: str = "GET", body: bytes | None = None, **headers: str
    ) -> Answer:
        """Headers are named with _ for -."""
        given = {name.replace("_", "-"): value for name, value in headers.items()}
        self.connection.request(method, path, body, headers=given)
        response = self.connection.getresponse()
        actual = {name.lower(): value for name, value in response.getheaders()}
        return Answer(response.status, actual, response.read())


@contextmanager
def client_of(url: str) -> Iterator[Client]:
    client = Client(url)
    try:
        yield client
    finally:
        client.connection.close()
