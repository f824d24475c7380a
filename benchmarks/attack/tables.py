"""Foreign layouts with one thing changed: how often is a file accepted with numbers that it does not have?

    python -m benchmarks.attack.tables --count 2000 --seed 48

A change either leaves the readings as they are (columns in another order, another name, a rival beside a column,
another unit with its numbers), or takes some away (empty cells, rows cut). So whatever is accepted must be readings of
the truth, each at its target, and what a file still has must be there or its loss be told. Changes that make a file
say something else in itself (the names of two columns exchanged, digits cut off the last number of a table that has no
end mark) cannot be judged by anyone and are not made. Misses are printed first.
"""

from __future__ import annotations

import argparse
import re
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random

import pandas as pd

from tests.importing.layouts.judge import (
    ASKED,
    AXIS,
    CERTIFICATE,
    GAUGE,
    LOST,
    REFUSED,
    RIGHT,
    SPOT,
    Layout,
    Verdict,
    judge,
    read_back,
)
from tests.importing.layouts.layouts import LAYOUTS

_MARKS = ("\t", ";", "|", ",")
_NUMBER = re.compile(r" *[-+]?\d+(?:[.,]\d+)? *")
_UNIT = re.compile(r"[\[(](mm|um|µm)[\])]|_(mm|um)\b")
_SCALED = {"mm": ("um", 1e3), "um": ("mm", 1e-3), "µm": ("mm", 1e-3)}
_TOLD = re.compile(r"dropped|left out|missing|remark|ignored")
_PAIR = {AXIS: ("target", "deviation"), SPOT: ("reading",), GAUGE: ("face", "x_mm")}
"""What belongs together in any order of rows."""


@dataclass(frozen=True)
class Sheet:
    """The one table of a text: what stands above, header, rows, what stands below."""

    above: list[str]
    header: list[str]
    rows: list[list[str]]
    below: list[str]
    mark: str

    def text(self) -> str:
        table = [self.mark.join(row) for row in (self.header, *self.rows)]
        return "\n".join([*self.above, *table, *self.below])

    def column(self, place: int, name: str | None, value: Callable[[str], str]) -> Sheet:
        """One column under another name, with other cells."""
        header = [name if name is not None and n == place else cell for n, cell in enumerate(self.header)]
        rows = [[value(cell) if n == place else cell for n, cell in enumerate(row)] for row in self.rows]
        return replace(self, header=header, rows=rows)


def sheet_of(text: str) -> Sheet | None:
    """The table of a text, where it has one whose cells a mark sets apart."""
    lines = text.split("\n")
    for mark in _MARKS:
        cells = [line.split(mark) for line in lines]
        for first in range(len(lines) - 3):
            width = len(cells[first])
            body = cells[first + 1 :]
            count = next((n for n, row in enumerate(body) if len(row) != width or not _is_row(row)), len(body))
            alone = not any(len(row) == width and _is_row(row) for row in body[count:])
            named = any(letter.isalpha() for letter in lines[first])  # not the rule below a header
            if width > 1 and count >= 4 and alone and named and not any(map(_NUMBER.fullmatch, cells[first])):
                return Sheet(lines[:first], cells[first], body[:count], lines[first + 1 + count :], mark)
    return None


def _is_row(cells: list[str]) -> bool:
    return any(_NUMBER.fullmatch(cell) for cell in cells)


Change = Callable[[Sheet, Random], Sheet | None]


def swapped(sheet: Sheet, random: Random) -> Sheet:
    """Two columns change places, with their names."""
    order = list(range(len(sheet.header)))
    a, b = random.sample(order, 2)
    order[a], order[b] = order[b], order[a]
    return replace(sheet, header=[sheet.header[n] for n in order], rows=[[row[n] for n in order] for row in sheet.rows])


def renamed(sheet: Sheet, random: Random) -> Sheet | None:
    """A column has a name that says nothing, or one that says too little; its unit stays.

    Not one that states an order of subtraction: without it nobody knows the sign.
    """
    place = random.randrange(len(sheet.header))
    if re.search(r"-|minus", sheet.header[place]):
        return None
    unit = _UNIT.search(sheet.header[place])
    name = random.choice(["Col 3", "A", "Data", "Value", "Ch1", "Position"]) + (
        f" [{unit[1] or unit[2]}]" if unit else ""
    )
    return sheet.column(place, name, str)


def rival(sheet: Sheet, random: Random) -> Sheet:
    """A column stands there twice, the other one with numbers of its own."""
    place = random.randrange(len(sheet.header))
    name = random.choice(["{}", "{} 2", "Copy of {}", "old {}", "{} raw"]).format(sheet.header[place].strip())
    where = random.choice([place, place + 1, len(sheet.header)])
    shift = random.choice([0.0005, 0.5, 3.0])

    def shifted(cell: str) -> str:
        if not _NUMBER.fullmatch(cell):
            return cell
        moved = float(cell.replace(",", ".")) + shift * (1.0 + 0.1 * random.random())
        return f"{moved:.4f}".replace(".", "," if "," in cell else ".")

    rows = [[*row[:where], shifted(row[place]), *row[where:]] for row in sheet.rows]
    return replace(sheet, header=[*sheet.header[:where], name, *sheet.header[where:]], rows=rows)


def other_unit(sheet: Sheet, random: Random) -> Sheet | None:
    """A column in another unit, name and numbers."""
    places = [n for n, cell in enumerate(sheet.header) if _UNIT.search(cell)]
    if not places:
        return None
    place = random.choice(places)
    unit = _UNIT.search(sheet.header[place])
    assert unit
    name, factor = _SCALED[unit[1] or unit[2]]

    def scaled(cell: str) -> str:
        if not _NUMBER.fullmatch(cell):
            return cell
        return f"{float(cell.replace(',', '.')) * factor:.9f}".replace(".", "," if "," in cell else ".")

    return sheet.column(place, sheet.header[place].replace(unit[1] or unit[2], name), scaled)


def no_unit(sheet: Sheet, random: Random) -> Sheet | None:
    """A column whose name has lost its unit."""
    places = [n for n, cell in enumerate(sheet.header) if _UNIT.search(cell)]
    if not places:
        return None
    place = random.choice(places)
    return sheet.column(place, _UNIT.sub("", sheet.header[place]).strip(), str)


def false_unit(sheet: Sheet, random: Random) -> Sheet | None:
    """One of two columns of positions in mm says inch: the two contradict each other."""
    places = [n for n, cell in enumerate(sheet.header) if re.search(r"[\[(]mm[\])]", cell) and _span(sheet, n) > 10.0]
    if len(places) < 2:
        return None
    place = random.choice(places)
    return sheet.column(place, sheet.header[place].replace("mm", "inch"), str)


def _span(sheet: Sheet, place: int) -> float:
    values = [float(row[place].replace(",", ".")) for row in sheet.rows if _NUMBER.fullmatch(row[place])]
    return max(values, default=0.0) - min(values, default=0.0)


def interleaved(sheet: Sheet, random: Random) -> Sheet:
    """Some rows stand elsewhere."""
    rows = list(sheet.rows)
    for _ in range(random.choice([1, 2, len(rows)])):
        rows.insert(random.randrange(len(rows)), rows.pop(random.randrange(len(rows))))
    return replace(sheet, rows=rows)


def emptied(sheet: Sheet, random: Random) -> Sheet:
    """Up to three cells are empty."""
    rows = [list(row) for row in sheet.rows]
    for _ in range(random.choice([1, 1, 2, 3])):
        rows[random.randrange(len(rows))][random.randrange(len(sheet.header))] = ""
    return replace(sheet, rows=rows)


def cut(sheet: Sheet, random: Random) -> Sheet:
    """The file ends early, after a row or after a cell of it."""
    rows = sheet.rows[: random.randrange(max(3, len(sheet.rows) // 2), len(sheet.rows))]
    if random.random() < 0.5:
        rows = [*rows[:-1], rows[-1][: random.randrange(1, len(rows[-1]))]]
    return replace(sheet, rows=rows, below=[])


CHANGES: tuple[Change, ...] = (swapped, renamed, rival, other_unit, no_unit, false_unit, interleaved, emptied, cut)


def lines_changed(text: str, random: Random) -> tuple[str, str]:
    """Of a text that is no table: a line gone, two exchanged, the end gone, and which."""
    lines = text.rstrip("\n").split("\n")
    kind = random.choice(["line gone", "lines exchanged", "end gone"])
    at, other = sorted(random.sample(range(len(lines)), 2))
    if kind == "line gone":
        lines.pop(at)
    elif kind == "lines exchanged":
        lines[at], lines[other] = lines[other], lines[at]
    else:
        lines = lines[: max(len(lines) // 2, other)]
    return kind, "\n".join(lines) + "\n"


def mutated(layout: Layout, random: Random) -> tuple[str, Layout] | None:
    """The kind of a change and the layout with it; None where this one cannot have it."""
    if not isinstance(layout.content, str):
        return None
    sheet = sheet_of(layout.content)
    if sheet is None and layout.content.strip().count("\n") < 4:
        return None
    if sheet is None:
        kind, text = lines_changed(layout.content, random)
        return kind, replace(layout, content=text)
    change = random.choice(CHANGES)
    changed = change(sheet, random)
    return None if changed is None else (change.__name__, replace(layout, content=changed.text()))


def wrong(layout: Layout, folder: Path, verdict: Verdict) -> str:
    """What an accepted result says that the truth does not; empty where it says nothing else."""
    if layout.truth is None:
        return "a file that nobody can read"
    name = "result.toml" if layout.kind == CERTIFICATE else "result.csv"
    found, off = read_back(layout, folder / name)
    truth, by = layout.truth, list(_PAIR.get(layout.kind, ()))
    if off and layout.kind == AXIS and truth["target"].nunique() == 1:  # one target is one spot
        truth, by, off = truth.assign(reading=truth["target"] + truth["deviation"] * 1e-3), ["reading"], ""
    if off:
        return off
    by = [one for one in by if one in truth]
    have, want = (Counter(map(tuple, table[by].astype(float).round(3).to_numpy())) for table in (found, truth))
    extra = have - want
    return f"{sum(extra.values())} readings such as {next(iter(extra))} of {tuple(by)}" if extra else ""


@dataclass(frozen=True)
class Outcome:
    """One mutation: its kind, the layout, how it ended."""

    kind: str
    layout: str
    verdict: str
    words: str = ""


def base(folder: Path, layouts: list[Layout] | None = None) -> list[tuple[Layout, Verdict]]:
    """Layouts that come in right as they are, with the answers that they needed."""
    found = []
    for number, layout in enumerate(layouts or LAYOUTS):
        (here := folder / f"base{number}").mkdir()
        verdict = judge(layout, here)
        if layout.kind in _PAIR and verdict.kind in (RIGHT, ASKED, LOST):
            found.append((layout, verdict))
    return found


def run(count: int, seed: int, folder: Path, layouts: list[Layout] | None = None) -> list[Outcome]:
    """``count`` mutations of layouts that are right as they are."""
    random = Random(seed)
    known = base(folder, layouts)
    done: list[Outcome] = []
    while len(done) < count:
        layout, verdict = random.choice(known)
        one = mutated(layout, random)
        if one is None or one[1].content == layout.content:
            continue
        (here := folder / f"{len(done)}").mkdir()
        now = judge(one[1], here, verdict.answers)
        if now.kind == REFUSED:
            done.append(Outcome(one[0], layout.name, REFUSED))
            continue
        words = wrong(one[1], here, now)
        done.append(Outcome(one[0], layout.name, "wrong" if words else "right", words))
    return done


def table(done: list[Outcome]) -> str:
    """Counts by kind, misses first."""
    frame = pd.DataFrame([(one.kind, one.verdict) for one in done], columns=["change", "ended"])
    counts = pd.crosstab(frame["change"], frame["ended"])
    misses = [f"{one.kind}: {one.layout}: {one.words}" for one in done if one.verdict == "wrong"]
    accepted = sum(one.verdict != REFUSED for one in done)
    return "\n".join(
        [*misses, counts.to_string(), f"accepted and wrong: {len(misses)} of {len(done)} ({accepted} accepted)"]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=48)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        print(table(run(chosen.count, chosen.seed, Path(folder))))


if __name__ == "__main__":
    main()
