"""``stepgauge web``: the project in a browser."""

from __future__ import annotations

import threading
import webbrowser
from pathlib import Path
from tempfile import TemporaryDirectory

import click

from stepgauge.cli.options import say


@click.command("web")
@click.argument("project", required=False, metavar="[PROJECT]")
@click.option("--host", metavar="HOST", help="Listen here. Default: for this computer alone (127.0.0.1).")
@click.option("--port", type=click.IntRange(0, 65535), metavar="PORT", help="Default: 8420; where taken, a free one.")
@click.option("--no-browser", is_flag=True, help="Print the address, and do not open a browser.")
def command(project: str | None, host: str | None, port: int | None, no_browser: bool) -> None:
    """Show a project in a browser: locate, plan, measure, evaluate, diagnose, report.

    PROJECT is its folder; by default the nearest one from the working folder upward, else the working folder, in which
    the page then makes one. Everything the page shows is a file that the other verbs wrote or could write; it needs no
    network, and ends on Ctrl-C. Needs the extra: pip install 'stepgauge[web]'.

    The address carries a token: whoever has it can change the project and move the machine, and nobody else, other
    users of this computer neither. With --host other computers can reach it. There is no encryption: use it in a
    network that you trust.

    \b
    stepgauge web
    stepgauge web my-machine --port 8500 --no-browser
    """
    import os

    from stepgauge.cli import VERBS
    from stepgauge.errors import InputError
    from stepgauge.files.outputs import outside_of_sets
    from stepgauge.project.find import find_project

    try:
        from stepgauge.web.server import LOOPBACK, Listening, serve
    except ImportError as missing:
        what = f"the page needs the extra 'web' ({missing.name} is missing)"
        raise InputError("web", what, expected="pip install 'stepgauge[web]'") from None
    found = find_project() if project is None else None
    folder = Path(project or (found.parent if found else "."))
    if not folder.is_dir():
        raise InputError(folder, "no such folder", expected="the folder of a project")
    os.chdir(folder)

    listening = Listening(host or LOOPBACK, port)
    with outside_of_sets(), TemporaryDirectory(prefix="stepgauge-") as private:

        def ready(address: str) -> None:
            """Told once requests are answered."""
            if not listening.is_loopback:
                say("warning: whoever has this address can change the project and move the machine")
            click.echo(address)
            if not no_browser:
                _open_browser(address, Path(private))

        serve(Path.cwd(), VERBS, listening, ready)


def _open_browser(address: str, private: Path) -> None:
    """By a page in a folder of this user: every user of the computer sees what is on a command line."""
    page = private / "stepgauge.html"
    page.write_text(f'<!doctype html><meta http-equiv="refresh" content="0; url={address}">', encoding="ascii")
    threading.Thread(target=webbrowser.open, args=(page.as_uri(),), daemon=True).start()
