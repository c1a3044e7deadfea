"""`ptm serve` and `ptm publish`: a database in a browser."""

from __future__ import annotations

import re
import sys
import threading
import webbrowser
from dataclasses import asdict
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ptmtools.cli.console import Console
from ptmtools.cli.parameters import (
    Command,
    database_argument,
    force_option,
    json_option,
    option,
    options_of,
    output_option,
    take,
    with_console,
)
from ptmtools.folder_kinds import check_folder, folder_kind
from ptmtools.quantities import count, size
from ptmtools.site.about import element_tags, folder_of, frame_tag
from ptmtools.site.content import Site, SiteOptions, site_of
from ptmtools.site.forms import OPTIONS, form_site, form_weight
from ptmtools.site.lookup import files_of
from ptmtools.site.program import ELEMENT
from ptmtools.site.published import PublishOptions
from ptmtools.site.publishing import COARSE, publish as write, weight_of
from ptmtools.site.serving import ServeOptions, serving
from ptmtools.store.objects import is_url
from ptmtools.texture.model import Limits

if TYPE_CHECKING:
    from ptmtools.site.edit_requests import Editing

_ADDRESS = re.compile(r"https?://[^\s/?#@]+(/[^\s?#]*)?")
_ORIGIN = re.compile(r"\*|https?://[^\s/?#@]+")


def _origin(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    if value is not None and not _ORIGIN.fullmatch(value):
        raise click.BadParameter(
            f"{value!r} is not an origin such as https://example.org; put DB before --cors"
        )
    return value


@click.command("serve", cls=Command)
@database_argument
@options_of(ServeOptions)
@option("--open", "opened", is_flag=True, help="Open the page in the default browser.")
@option(
    "--cors",
    "origin",
    is_flag=False,
    flag_value="*",
    metavar="[ORIGIN]",
    callback=_origin,
    help="Let pages of this origin, such as https://example.org, read the files; without ORIGIN, "
    "pages of any origin.",
)
@with_console
def serve(console: Console, db: str, opened: bool, origin: str | None, **values: Any) -> None:
    """Serve DB to browsers on this machine until Ctrl-C, and print the URL of its page.

    DB is a database, or a folder that `ptm publish`, `ptm apo`, `ptm interlace` or `ptm campus`
    wrote. --bandwidth and --latency simulate a slow connection.
    """
    options = take(ServeOptions, values)
    if options.edit and origin:
        raise click.UsageError("--edit is for the page of this server: without --cors")
    editing = _editing(db) if options.edit else None
    files = files_of(db)
    try:
        with serving(
            files,
            host=options.host,
            port=options.port,
            throttle=options.throttle,
            origin=origin,
            editing=editing,
        ) as url:
            url += editing.address if editing else ""
            console.print(url)
            if not console.quiet and sys.stderr.isatty():
                click.echo("Press Ctrl-C to stop", err=True)
            if not _is_local(options.host):
                console.warn(
                    f"warning: listening on {options.host}: every machine that can reach this "
                    "address can read the files"
                )
            if opened and not _open_in_browser(url):
                console.warn("note: no browser could be started; open the URL yourself")
            threading.Event().wait()
    except KeyboardInterrupt:
        pass  # the usual end


def _editing(db: str) -> Editing:
    """The editing of the tour of a database."""
    from ptmtools.site.edit_requests import Editing
    from ptmtools.site.editing import TourEditor

    return Editing(TourEditor(db))


def _is_local(host: str) -> bool:
    """Whether only this machine can reach the address."""
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _open_in_browser(url: str) -> bool:
    """Whether a browser has opened the URL."""
    try:
        return webbrowser.open(url)
    except (OSError, webbrowser.Error):
        return False


def _only_target(url: str | None, output: str | None) -> str:
    """The one target that the user gave."""
    if url is not None and output is not None:
        raise click.UsageError("specify either a URL or -o, not both")
    if not (target := url if output is None else output):
        raise click.UsageError("specify a URL such as s3://bucket/prefix, or a folder with -o")
    if url is not None and not is_url(url):
        raise click.UsageError(f"{url!r} is no URL; specify a folder with -o")
    return target


@click.command("publish", cls=Command)
@database_argument
@click.argument("target", required=False, metavar="[URL]")
@output_option("Folder of the site to write; or the URL.", "output")
@options_of(SiteOptions, PublishOptions)
@force_option(
    "Write into a folder or URL that is not a site, and replace files with the same names in it."
)
@json_option
@with_console
def publish(
    console: Console, db: str, target: str | None, output: str | None, force: bool, **values: Any
) -> None:
    """Write DB as a web site: a folder that any web server can serve, or the objects below a URL
    such as s3://bucket/prefix or gs://bucket/prefix. DB is a database, or a folder that `ptm apo`,
    `ptm interlace` or `ptm campus` wrote.

    A second run rewrites only the files that have changed.
    """
    target = _only_target(target, output)
    site_options, options = take(SiteOptions, values), take(PublishOptions, values)
    if site_options.address and not _ADDRESS.fullmatch(site_options.address):
        raise click.UsageError(
            f"--address {site_options.address!r} is not the address of a folder, such as "
            "https://example.org/walk/"
        )
    kind = folder_kind(Path(db))
    kept = {name: getattr(site_options, name) for name in OPTIONS}
    if kind and site_options != SiteOptions(**kept):
        names = ", ".join(f"--{name}" for name in OPTIONS)
        raise click.UsageError(
            f"of the options of a site, a folder with {kind.index} has {names} only"
        )
    with console.progress() as progress:
        if kind:
            check_folder(Path(db), kind, Limits())
            site = form_site(Path(db), kind, site_options)
        else:
            site = site_of(db, site_options, progress)
        done = write(site, target, options, force=force, progress=progress)
    changed = {name: list(names) for name, names in asdict(done).items()}
    for note in site.notes if not console.as_json else ():
        console.warn(note)
    removed = f", {count(len(done.removed), 'file')} removed" if done.removed else ""
    first = (
        f"{target}: {count(len(done.written), 'file')} written, "
        f"{len(done.unchanged):,} unchanged{removed}"
    )
    weight, lines = _weight_of_form(site) if kind else _weight_of_walk(site)
    embed = _embedding(site, site_options.address)
    document = {**changed, "notes": list(site.notes), "bytes": weight, **embed}
    console.result(document, (first, *lines, *(f"{name}: {tags}" for name, tags in embed.items())))


def _embedding(site: Site, address: str) -> dict[str, str]:
    """The HTML that shows a site in another page; the element only for a walk."""
    folder = folder_of(address)
    tags = {"embed": frame_tag(site.title, folder)}
    if script := site.entries.get(ELEMENT):
        tags["element"] = element_tags(site.title, ELEMENT, script.read(), folder)
    return tags


def _weight_of_form(site: Site) -> tuple[dict[str, int], tuple[str, ...]]:
    """The bytes that a visitor downloads, and lines of text."""
    page, whole = form_weight(site)
    return {"page": page, "whole": whole}, (f"download: page {size(page)}, all {size(whole)}",)


def _weight_of_walk(site: Site) -> tuple[dict[str, int], tuple[str, ...]]:
    """As `_weight_of_form`, of a database."""
    weight = weight_of(site)
    return asdict(weight), (
        f"download: page {size(weight.page)}; with the first room {size(weight.first_room)} "
        f"(textures up to {COARSE} texels per side)",
        f"each further room {size(weight.mean_room)} on average, at most "
        f"{size(weight.worst_room)} (cell {weight.worst_cell}); everything {size(weight.whole)}",
    )
