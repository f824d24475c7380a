"""``stepgauge fleet watch``: what changes, what drifts, what leaves its peers or its limits, and what is due."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from stepgauge.cli.fleet.options import STORE, bar, engine_from, engine_options, say_errors
from stepgauge.cli.options import SUFFIX, FiniteRange, limits_option, output, say, say_written, show

# Written out so that --help needs no numpy; a test compares it with what is watched.
LIMITS = ("scale", "squareness", "reversal", "certificate_scale", "wear")


@click.command("watch")
@STORE
@output("Folder for watch.json, watch.csv and the figure (made if missing).")
@limits_option(LIMITS, f"Maximum permissible size; repeatable. Names: {', '.join(LIMITS)} (um/m, urad, um).")
@click.option(
    "--risk",
    type=FiniteRange(0.0, 0.5, min_open=True),
    default=0.05,
    show_default=True,
    help="Probability of being out of limits that is accepted until the next calibration.",
)
@SUFFIX
@engine_options
def command(store: str, output: str, limits: dict[str, float], risk: float, suffix: str, **options: Any) -> None:
    """Machines and gauges against their own history, their peers and their limits.

    Every visit counts for a machine without the shares of gauge, hall and probe, as 'fleet infer' finds them, so that a
    worn gauge moves no machine. Stated are level, rate and dated changes with U; who leaves the machines of its line
    (at most 5 % of those named are expected to be wrong); with a limit the decision by ISO 14253-1, and the day on
    which the risk of being out of limits is no longer accepted. watch.json is for other programs, docs/fleet.md has its
    schema.

    \b
    stepgauge fleet watch fleet --limit scale=5 --limit reversal=2 -o watch
    """
    from stepgauge.figures.fleet import draw_watch
    from stepgauge.fleet.crossed.feed import write_feed
    from stepgauge.fleet.crossed.stored import infer_store
    from stepgauge.fleet.crossed.watch import watch

    engine = engine_from(options)
    with bar("reading") as progress:
        found, errors = infer_store(store, engine, progress)
    watched = watch(found, limits, risk)
    written = write_feed(output, watched, limits, risk)
    figure = Path(output) / f"watch.{suffix}"
    draw_watch(figure, watched)
    show("\n".join(_lines(watched)))
    say(f"{len(watched)} quantities of {len({(one.owner_kind, one.owner) for one in watched})} machines and gauges")
    say_written(*written, figure)
    say_errors(store, errors, "used")


def _lines(watched: Sequence[Any]) -> list[str]:
    """What needs a look: changed, drifting, beside its peers, out of limits; and the next that are due."""
    from stepgauge.fleet.crossed.answer import date_text

    lines = []
    for one in watched:
        said = [f"changed between {date_text(first)} and {date_text(last)}" for first, last in one.changes]
        said += [f"drifts by {one.rate:+.3g} {one.unit} a year (U = {2.0 * one.u_rate:.2g})"] if one.drifts else []
        said += [f"beside its peers ({one.peers[0]:+.3g} {one.unit})"] if one.leaves_peers and one.peers else []
        said += [one.outcome] if one.outcome not in (None, "conforms") else []
        if said:
            size = f"{one.level[-1]:+.3g} {one.unit} (U = {2.0 * one.u[-1]:.2g})"
            lines.append(f"{one.owner_kind} {one.owner} {one.quantity} {size}: {', '.join(said)}")
    due = sorted((one for one in watched if one.due is not None), key=lambda one: one.due)
    lines += [f"due {date_text(one.due)}: {one.owner_kind} {one.owner} ({one.quantity})" for one in due[:10]]
    return lines or ["nothing changed, nothing due"]
