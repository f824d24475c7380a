"""``stepgauge probe``: what a probe does, and what is done about it."""

from __future__ import annotations

import click

from stepgauge.cli import LazyGroup

VERBS = {
    "map": ("stepgauge.cli.probe.map", "a probe's construction -> trigger force and pre-travel in every direction"),
    "sphere": ("stepgauge.cli.probe.sphere", "a probe's construction -> its points on a sphere, virtually"),
    "qualify": ("stepgauge.cli.probe.qualify", "points on a reference sphere -> effective radius, lobes, form error"),
    "compensate": ("stepgauge.cli.probe.compensate", "recorded points -> surface points without the pre-travel"),
    "bench": ("stepgauge.cli.probe.bench", "a probe bench's recording -> pre-travel, hysteresis, repeatability"),
}


@click.group(cls=LazyGroup, tasks={"Verbs": VERBS})
def command() -> None:
    """The touch-trigger probe: its physics, its qualification and its compensation."""
