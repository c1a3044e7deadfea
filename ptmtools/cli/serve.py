"""`ptm serve`: a database, or a published folder, to look at in a browser."""

from __future__ import annotations

import re
import sys
import threading
import webbrowser
from ipaddress import ip_address
from typing import Any

import click

from ptmtools.cli.common import database, voiced
from ptmtools.cli.output import Voice
from ptmtools.cli.parameters import options_of, take
from ptmtools.server.opening import files_of
from ptmtools.server.options import ServeOptions
from ptmtools.server.running import require, serving

_ORIGIN = re.compile(r"\*|https?://[^\s/?#@]+")


def _origin(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    if value is not None and not _ORIGIN.fullmatch(value):
        raise click.BadParameter(
            f"{value!r} is not an origin such as https://example.org; put DB before --cors"
        )
    return value


@click.command("serve")
@database
@options_of(ServeOptions)
@click.option("--open", "opened", is_flag=True, help="Open the page in the default browser.")
@click.option(
    "--cors",
    "origin",
    is_flag=False,
    flag_value="*",
    metavar="[ORIGIN]",
    callback=_origin,
    help="Let pages of this origin, such as https://example.org, read the files; of any origin "
    "without one.",
)
@voiced
def serve(voice: Voice, db: str, opened: bool, origin: str | None, **values: Any) -> None:
    """Serve DB to browsers on this machine, until Ctrl-C, and print the URL of its page.

    DB is a database, or a folder that `ptm publish` wrote. --bandwidth and --latency simulate
    a slow connection.
    """
    options = take(ServeOptions, values)
    require()
    files = files_of(db)
    try:
        with serving(
            files,
            host=options.host,
            port=options.port,
            throttle=options.throttle,
            origin=origin,
        ) as url:
            voice.say(url)
            if not voice.quiet and sys.stderr.isatty():
                click.echo("Press Ctrl-C to stop", err=True)
            if not _own(options.host):
                voice.warn(
                    f"warning: listening on {options.host}: anyone who can reach this machine "
                    "there can read what is served"
                )
            if opened and not _shown(url):
                voice.warn("note: no browser could be started; open the page yourself")
            threading.Event().wait()
    except KeyboardInterrupt:
        pass  # which is how one ends it


def _own(host: str) -> bool:
    """Whether only this machine reaches the address."""
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _shown(url: str) -> bool:
    """Whether a browser took it."""
    try:
        return webbrowser.open(url)
    except (OSError, webbrowser.Error):
        return False
