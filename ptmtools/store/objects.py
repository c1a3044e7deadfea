"""Objects below a URL such as ``s3://bucket/prefix``, through fsspec.

A store gives each object a version and, where it can, the MD5 of its bytes in the same listing, so
that unchanged objects are known without a request for each. A store whose objects have HTTP headers
is one row of `KINDS`; any other protocol of fsspec stores bytes alone.

Tried and rejected: the SHA-256 in the metadata of each object, which needs one request per object;
`fsspec.generic.rsync`, which compares sizes and times.
"""

from __future__ import annotations

import base64
import os
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from ptmtools.errors import InputError, MissingComponentError, OutputError, PtmError
from ptmtools.lazy import component

_URL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://")
_MD5 = re.compile(r'"?([0-9a-f]{32})"?')
#: Fields of a listing that change when an object is written again.
_CHANGING = ("etag", "ETag", "mtime", "created", "modified", "last_modified", "size")


@dataclass(frozen=True)
class Headers:
    """The HTTP headers with which a store sends an object; an encoding may be ""."""

    media: str
    cache: str
    encoding: str = ""


@dataclass(frozen=True)
class ListedObject:
    """An object in a listing.

    Attributes
    ----------
    size: bytes.
    version: text that changes when the object is written again.
    md5: hexadecimal, of its bytes; "" if the store does not say.
    """

    size: int
    version: str
    md5: str


@dataclass(frozen=True)
class StoreKind:
    """A kind of store whose objects have headers.

    Attributes
    ----------
    arguments: the headers as arguments of fsspec's calls.
    version, md5: of a row of a listing, see `ListedObject`.
    condition: that an object still has a version, or with "" that there is none, as arguments.
    settings: arguments of the file system.
    """

    arguments: Callable[[Headers], dict[str, Any]]
    version: Callable[[Mapping[str, Any]], str]
    md5: Callable[[Mapping[str, Any]], str]
    condition: Callable[[str], dict[str, Any]]
    settings: Mapping[str, Any] = field(default_factory=dict)


def _s3_arguments(headers: Headers) -> dict[str, Any]:
    encoding = {"ContentEncoding": headers.encoding} if headers.encoding else {}
    return {"ContentType": headers.media, "CacheControl": headers.cache, **encoding}


def _s3_md5(row: Mapping[str, Any]) -> str:
    """The tag of an object that was sent in one part and is not encrypted with a key of KMS; other
    tags are either no MD5, or a number of 32 digits that no MD5 equals."""
    match = _MD5.fullmatch(str(row.get("ETag", "")))
    return match[1] if match else ""


def _gs_arguments(headers: Headers) -> dict[str, Any]:
    fixed = {"cache_control": headers.cache}
    if headers.encoding:
        fixed["content_encoding"] = headers.encoding
    return {"content_type": headers.media, "fixed_key_metadata": fixed}


def _gs_md5(row: Mapping[str, Any]) -> str:
    return base64.b64decode(row.get("md5Hash", "")).hex()


def _s3_condition(version: str) -> dict[str, Any]:
    return {"IfMatch": version} if version else {"IfNoneMatch": "*"}


def _gs_condition(version: str) -> dict[str, Any]:
    """gcsfs has no condition for objects that exist."""
    return {} if version else {"mode": "create"}


_S3 = StoreKind(
    _s3_arguments,
    lambda row: str(row.get("ETag", "")).strip('"'),
    _s3_md5,
    _s3_condition,
    # Otherwise s3fs asks for the size of each object before it reads it.
    {"max_concurrency": 1},
)
_GS = StoreKind(_gs_arguments, lambda row: str(row.get("generation", "")), _gs_md5, _gs_condition)
#: Stores whose objects have headers, by the protocol of their URLs.
KINDS = {"s3": _S3, "s3a": _S3, "gs": _GS, "gcs": _GS}
#: Protocols of web servers, which list no files.
_OF_PAGES = ("http", "https")


def is_url(target: str | os.PathLike[str]) -> bool:
    """Whether a target is a URL and not a path."""
    return isinstance(target, str) and bool(_URL.match(target))


def plain_path(target: str | os.PathLike[str]) -> str | os.PathLike[str]:
    """The path that a URL of this machine's files names, ``file:///path``; else the target."""
    if is_url(target):
        parts = urlsplit(str(target))
        if parts.scheme in ("file", "local"):
            return unquote(parts.path)
    return target


class Objects:
    """The objects below a URL. All methods may be called from several threads.

    ``reading``: they are an input, so that failures are InputErrors PTM-I122.

    Raises
    ------
    InputError: PTM-I111 the URL names no bucket or is that of a web server, or fsspec does not know
        its protocol.
    MissingComponentError: PTM-M100 a package is not installed.
    """

    def __init__(self, url: str, *, reading: bool = False) -> None:
        self.url = url.rstrip("/")
        self._reading = reading
        protocol, _, place = url.partition("://")
        if protocol.lower() in _OF_PAGES:
            raise InputError(
                "PTM-I111",
                "a web server does not list its files",
                file=url,
                remedy="use a local path, or an object store such as s3://BUCKET/PREFIX",
            )
        if not place.strip("/"):
            raise InputError("PTM-I111", "the URL names no bucket", file=url)
        fsspec = component("fsspec", "PTM-M100", f"{url}: object stores need fsspec", "cloud")
        self.kind = KINDS.get(protocol.lower())
        with self._asking("cannot be opened"):
            try:
                settings = self.kind.settings if self.kind else {}
                opened = fsspec.core.url_to_fs(
                    self.url, use_listings_cache=False, skip_instance_cache=True, **settings
                )
            except ImportError as fault:
                extra = "pip install 'ptmtools[cloud]'" if self.kind else None
                raise MissingComponentError(
                    "PTM-M100", f"{protocol}:// needs a package ({fault})", file=url, remedy=extra
                ) from None
            except ValueError as fault:
                raise InputError("PTM-I111", f"is no URL of a store ({fault})", file=url) from None
        self._system, self._root = opened[0], str(opened[1]).rstrip("/")

    def listing(self) -> dict[str, ListedObject]:
        """All objects by their names below the URL; empty if there are none.

        Raises OutputError PTM-O012, as all methods.
        """
        with self._asking("cannot be listed"):
            try:
                rows = self._system.find(self._root, detail=True)
            except FileNotFoundError:
                if self.kind:
                    raise  # no such bucket
                return {}
        begin = f"{self._root}/"
        return {
            name.removeprefix(begin): self._listed_object(row)
            for name, row in rows.items()
            if name.startswith(begin) and not name.endswith("/")
        }

    def info(self, name: str) -> ListedObject | None:
        """An object as a listing has it; None if there is none."""
        if not self.kind:  # other properties than in a listing
            return self.listing().get(name)
        with self._asking("cannot be read", name):
            try:
                return self._listed_object(self._system.info(self._path(name)))
            except FileNotFoundError:
                return None

    def _listed_object(self, row: Mapping[str, Any]) -> ListedObject:
        size = int(row["size"])
        if self.kind:
            return ListedObject(size, self.kind.version(row), self.kind.md5(row))
        return ListedObject(size, " ".join(str(row[key]) for key in _CHANGING if key in row), "")

    def read(self, name: str, start: int = 0, end: int | None = None) -> bytes:
        """The bytes of an object, or those from ``start`` to before ``end``."""
        limits = {"start": start, "end": end} if start or end is not None else {}
        with self._asking("cannot be read", name):
            return bytes(self._system.cat_file(self._path(name), **limits))

    def write(
        self, name: str, source: bytes | Path, headers: Headers, *, instead_of: str | None = None
    ) -> None:
        """Writes an object whole, or not at all; replaces one of the same name, and with
        ``instead_of`` only one of that version, "" for none, where the store can check that."""
        arguments = self.kind.arguments(headers) if self.kind else {}
        if self.kind and instead_of is not None:
            arguments |= self.kind.condition(instead_of)
        with self._asking("cannot be written", name):
            if isinstance(source, bytes):
                self._system.pipe_file(self._path(name), source, **arguments)
            else:
                self._system.put_file(str(source), self._path(name), **arguments)

    def remove(self, name: str) -> None:
        """Removes an object."""
        with self._asking("cannot be removed", name):
            self._system.rm_file(self._path(name))

    def _path(self, name: str) -> str:
        return f"{self._root}/{name}"

    @contextmanager
    def _asking(self, what: str, name: str = "") -> Iterator[None]:
        """Turns the failures of a store into errors. Their classes differ from package to package
        and have no common base below Exception."""
        try:
            yield
        except PtmError:
            raise
        except Exception as fault:
            reason = str(fault) or type(fault).__name__
            file = f"{self.url}/{name}" if name else self.url
            raise self.failure(f"{what} ({reason})", file) from fault

    def failure(self, what: str, file: str) -> PtmError:
        """The error that something fails."""
        remedy = "check the URL, the credentials and their rights, and the connection"
        if self._reading:
            return InputError("PTM-I122", what, file=file, remedy=remedy)
        return OutputError("PTM-O012", what, file=file, remedy=remedy)
