"""The report of a fleet's inference: causes with their owners, what is left open, what settles it, what is in order."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from stepgauge.files.notation import counted, rounded
from stepgauge.files.text import read_result
from stepgauge.fleet.hierarchical.answer import WORDS, began, owner_of, words_of
from stepgauge.recording.simulated import SIMULATED_WARNING
from stepgauge.reports.blocks import Block, bullets, figure, heading, part, table, words
from stepgauge.reports.diagnosis import STORY
from stepgauge.reports.kinds import FLEET

Said = Mapping[str, Any]
FIGURE = "sizes.svg"
DIGITS = 8
"""Of the key of a recording: enough to find it among millions."""
KEYS = f"A recording is named by the first {DIGITS} digits of its key, the column recording of the view recordings."


def fleet_story(said: Said, drawn: bool = True) -> dict[str, Any]:
    """The content of a page on an inference; ``said``: content of the JSON file of ``fleet infer``.

    ``drawn``: with its figure, which stands in the page.
    """
    sizes = _sizes(said["causes"]) if drawn and said["causes"] else ()
    return {
        "layout": STORY,
        "title": "What the fleet tells",
        "verdict": f"{counted(len(said['causes']), 'cause')} named",
        "summary": _sentence(said),
        "warnings": [SIMULATED_WARNING] if said["simulated"] else [],
        "example": False,
        "parts": [
            part("Causes and their owners", *_causes(said)),
            part("What the fleet cannot tell apart", *_open(said)),
            part("Sizes, and by which recordings", *sizes, *_settled(said)),
            part("What was looked for", *_looked_for(said)),
            part("What is nothing wrong", *_scatter_section(said)),
        ],
        "data": {"name": "fleet.json", "text": json.dumps(said, indent=1, ensure_ascii=False)},
        "version": said["stepgauge"],
    }


def read_story(path: str | Path) -> dict[str, Any]:
    """The page of the JSON file of an inference."""
    return fleet_story(read_result(path, FLEET, with_inputs=False))


def _sentence(said: Said) -> str:
    owners = ", ".join(
        counted(number, "machine type" if kind == "type" else kind) for kind, number in said["owners"].items()
    )
    share, count = said["expected_false_share"], len(said["causes"])
    false = f"; {share * count:.1f} of the causes ({100.0 * share:.1f} %) are expected to be false" if count else ""
    return f"{counted(said['visits'], 'visit')} (placements of a gauge on a machine): {owners}{false}."


def _causes(said: Said) -> Iterator[Block]:
    if not said["causes"]:
        yield words("None. That is no proof: the table of what was looked for says what size a cause usually has.")
        return
    rows = [
        (
            owner_of(one),
            words_of(one),
            f"{rounded(one['size'], 3, plus=True)} {one['unit']}",
            rounded(2.0 * one["u"], 2),
            began(one) or "before the first visit",
            f"{one['probability']:.3f}{' *' if one.get('instead') else ''}",
        )
        for one in said["causes"]
    ]
    columns = ("owner", "what is wrong", "size", "U", "began", "probability")
    note = "U: expanded uncertainty, k = 2, in the unit of the size. * one of a set, whose probability it is."
    yield table(columns, rows, (1.0, 1.4, 0.0, 0.0, 1.4, 0.0), note=note)


def _open(said: Said) -> Iterator[Block]:
    left = [one for one in said["causes"] if one.get("instead")]
    if not left:
        yield words("Nothing: every cause has one owner." if said["causes"] else "Nothing was named.")
        return
    yield bullets([_set(one) for one in left])


def _set(one: Said) -> str:
    rivals = [f"or {owner_of(other)}, {words_of(other)} ({other['probability']:.2f})" for other in one["instead"]]
    return f"{owner_of(one)}, {words_of(one)}, {', '.join(rivals)}. To settle it, {one['would_settle']}."


def _sizes(causes: Sequence[Said]) -> Iterator[Block]:
    from stepgauge.figures.fleet import MOST_CAUSES, causes_figure

    shown = f" The likeliest {MOST_CAUSES} of {len(causes)}." if len(causes) > MOST_CAUSES else ""
    caption = f"Sizes with their expanded uncertainty U (k = 2); hollow: one of a set.{shown}"
    yield figure(FIGURE, caption, causes_figure(causes))


def _settled(said: Said) -> Iterator[Block]:
    if not said["causes"]:
        yield words("There is nothing to settle.")
        return
    rows = [
        (f"{owner_of(one)}: {words_of(one)}", _visits(one["settled_by"]["with"]), _visits(one["settled_by"]["without"]))
        for one in said["causes"]
    ]
    yield table(("cause", "shows in", "not without its owner in"), rows, (1.0, 1.2, 1.2), note=KEYS)


def _visits(some: Sequence[Said]) -> str:
    return "\n".join(f"{one['date']} {one['machine']}, {one['gauge']} ({one['recording'][:DIGITS]})" for one in some)


def _looked_for(said: Said) -> Iterator[Block]:
    rows = [
        (one["owner_kind"], _kind(one["kind"]), one["owners"], one["named"], f"{one['usual']:g} {one['unit']}")
        for one in said["looked_for"]
    ]
    note = "Usual size: median of the prior. A cause of half that size is often missed."
    yield table(("owner", "cause", "in how many", "named in", "usual size"), rows, (0.0, 1.0, 0.0, 0.0, 0.0), note=note)
    if said["alone"]:
        yield heading("Single visits that are wrong, whosever it is")
        yield bullets([_alone(one) for one in said["alone"]])
    if said["left_out"]:
        yield heading("Recordings that could not be used")
        yield bullets(said["left_out"])


def _kind(kind: str) -> str:
    """A kind of cause without its place."""
    return WORDS[kind].partition(" of the {where}")[0].partition(" of {where}")[0].partition(" {where}")[0]


def _alone(one: Said) -> str:
    visit = f"{one['recording'][:DIGITS]}, placement {one['placement']}"
    size = f"{rounded(one['size'], 3, plus=True)} (U = {rounded(2.0 * one['u'], 2)})"
    return f"{visit}: {_kind(one['kind'])} {size}, probability {one['probability']:.3f}"


def _scatter_section(said: Said) -> Iterator[Block]:
    yield words("Standard deviations of what machines in order, days and visits differ by, estimated over the fleet.")
    yield bullets([f"{name}: {rounded(sd, 2)}" for name, sd in said["in_order"].items()])
