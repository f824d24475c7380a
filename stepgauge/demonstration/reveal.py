"""The seal is opened: truth and answer side by side, in words, in one figure and in one page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from stepgauge.demonstration.conceal import SEALED, Concealed, open_seal
from stepgauge.demonstration.faults import FAULTS
from stepgauge.diagnosis.wording.findings import name_of
from stepgauge.diagnosis.wording.limits import predictions
from stepgauge.diagnosis.wording.notation import probability
from stepgauge.figures.legends import add_legend, axes_entries
from stepgauge.figures.style import COLORS, figure_style, new_figure, save_figure
from stepgauge.files.notation import printed_unit
from stepgauge.files.text import read_result
from stepgauge.reports.blocks import bullets, figure, part, table, words
from stepgauge.reports.diagnosis import story
from stepgauge.reports.render import write_report

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


UNITS = {"um", "mm", "ppm", "s", "K", "deg"}


@dataclass(frozen=True)
class NamedCandidate:
    """One candidate of the answer: what it is called, its probability, and whether it is what was concealed."""

    label: str
    probability: float
    is_truth: bool
    parameters: Mapping[str, Any]


@dataclass(frozen=True)
class Compared:
    """A number: what was concealed, what was found, its standard uncertainty (NaN where none is stated)."""

    name: str
    unit: str
    truth: float
    found: float
    u: float

    @property
    def deviation(self) -> float:
        """Found minus concealed in standard uncertainties."""
        return (self.found - self.truth) / self.u if self.u > 0.0 else float("nan")

    @property
    def u_text(self) -> str:
        """Its standard uncertainty with two digits."""
        return f"{self.u:.2g}" if self.u > 0.0 else "not stated"


@dataclass(frozen=True)
class RevealedFault:
    """``members``: candidates by probability; ``numbers``: of the one that is true, if it is among them; ``others``:
    effects that the diagnosis states beside it, which nobody concealed."""

    members: tuple[NamedCandidate, ...]
    numbers: tuple[Compared, ...]
    others: tuple[str, ...]

    @property
    def place(self) -> int:
        """1 where the truth is the most probable, 2, 3, .. further down in the set, 0 where it is not in it."""
        return next((number for number, one in enumerate(self.members, 1) if one.is_truth), 0)

    def sentence(self) -> str:
        """Right, right as one of a set, or wrong; with its probability."""
        if not self.place:
            return "The diagnosis did not name it."
        odds = f"with probability {probability(self.members[self.place - 1].probability)}"
        if len(self.members) == 1:
            return f"The diagnosis named it, {odds}."
        rank = "first" if self.place == 1 else f"number {self.place}"
        return f"The diagnosis named it {rank}, {odds}, of {len(self.members)} that these recordings cannot tell apart."


def compare_answer(truth: Mapping[str, Any], diagnosis: Mapping[str, Any]) -> RevealedFault:
    """The concealed effect (a table of a machine file) against ``diagnosis.json``."""
    sets = [tuple(_members(one, truth)) for one in diagnosis["effects"]]
    right = next((one for one in sets if any(member.is_truth for member in one)), sets[0] if sets else ())
    found = next((member.parameters for member in right if member.is_truth), {})
    numbers = tuple(_answer_numbers(truth, found))
    return RevealedFault(right, numbers, tuple(one[0].label for one in sets if one is not right))


def _members(finding: Mapping[str, Any], truth: Mapping[str, Any]) -> Iterator[NamedCandidate]:
    own = {
        "conditional_probability": finding["probability"],
        **{key: finding[key] for key in ("kind", "label", "parameters")},
    }
    for one in finding.get("set") or [own]:
        yield NamedCandidate(
            name_of(str(one["label"])), float(one["conditional_probability"]), _is_truth(one, truth), one["parameters"]
        )


def _is_truth(member: Mapping[str, Any], truth: Mapping[str, Any]) -> bool:
    """Whether kind and choices (axis, direction, ..) are those that were concealed."""
    choices = {key: value for key, value in truth.items() if key != "kind" and isinstance(value, str)}
    found = {key: member["parameters"].get(key, {}).get("value") for key in choices}
    return bool(member["kind"] == truth["kind"] and all(_same(found[key], choices[key]) for key in choices))


def _same(found: object, concealed: str) -> bool:
    """Directions may come back as vectors."""
    if isinstance(found, list | tuple) and concealed in "xyz":
        return bool(np.abs(np.asarray(found, float)["xyz".index(concealed)]) > np.cos(np.radians(10.0)))
    return found == concealed


def _answer_numbers(truth: Mapping[str, Any], found: Mapping[str, Any]) -> Iterator[Compared]:
    for name, value in truth.items():
        if name in found and not isinstance(value, str):
            estimate = found[name]
            u, unit, number = float(estimate.get("u") or "nan"), str(estimate["unit"]), float(estimate["value"])
            turned = round((value - number) / 360.0) * 360.0 if unit == "deg" else 0.0
            yield Compared(_without_unit(name), unit, float(value), number + turned, u)


def _without_unit(name: str) -> str:
    """``period_mm``: period; a parameter that is called by its unit alone is the size."""
    return " ".join(part for part in name.split("_") if part not in UNITS) or "size"


FIGURE, PAGE = "story.png", "story.html"
CAPTION = (
    "Residuals against the machine file before and after the finding is added; candidates with their probabilities;"
    " what was concealed beside what was found, with two standard uncertainties."
)


@dataclass(frozen=True)
class Revealed:
    """``fault``: what was concealed, in words; ``fit``: of ``diagnosis.json``; ``written``: figure and page."""

    fault: str
    answer: RevealedFault
    fit: Mapping[str, Any]
    written: tuple[Path, ...]

    def lines(self) -> list[str]:
        """What a terminal shows."""
        return [
            f"concealed was {self.fault}",
            *(f"  {_number(one)}" for one in self.answer.numbers),
            *(f"  also stated: {one}, which nobody concealed" for one in self.answer.others),
            self.answer.sentence(),
            _fit(self.fit),
        ]


def reveal(folder: Path, concealed: Concealed, diagnosis: Path) -> Revealed:
    """Open the seal, compare it with a diagnosis, and write figure and page into the folder.

    Raises
    ------
    InputError
        a seal that was changed, or a folder without a diagnosis
    """
    truth = open_seal(folder / SEALED, concealed.checksum)
    found = read_result(diagnosis / "diagnosis.json", "diagnosis", with_inputs=False)
    fault = next(one.words for one in FAULTS if one.kind == truth["kind"])
    answer = compare_answer(truth, found)
    drawn = story_figure(answer, fault, pd.read_csv(diagnosis / "residuals.csv"), found["fit"])
    write_report(folder / PAGE, _page(fault, answer, found, concealed.checksum, drawn))
    save_figure(drawn, folder / FIGURE, simulated=True)
    return Revealed(fault, answer, found["fit"], (folder / FIGURE, folder / PAGE))


def _number(one: Compared) -> str:
    return f"{one.name}: {one.truth:g} concealed, {one.found:.4g} found ({one.unit}), u = {one.u_text}"


def _fit(fit: Mapping[str, Any]) -> str:
    held = "; ".join(
        f"in {what} that the fit did not know {one['rms_before_um']:.2f} um before, {one['rms_after_um']:.2f} um after"
        for what, one in fit["holdout"].items()
    )
    rms = f"residuals (rms): {fit['rms_before_um']:.2f} um before, {fit['rms_after_um']:.2f} um after"
    return f"{rms}; {held}. {predictions(fit)}"


def _page(fault: str, answer: RevealedFault, found: Mapping[str, Any], checksum: str, drawn: Figure) -> dict[str, Any]:
    numbers = [[one.name, one.unit, f"{one.truth:g}", f"{one.found:.4g}", one.u_text] for one in answer.numbers]
    members = [[one.label, probability(one.probability), "concealed" if one.is_truth else ""] for one in answer.members]
    parts = [
        part(
            "What was concealed, and what was found",
            figure(FIGURE, CAPTION, drawn),
            table(["Parameter", "Unit", "Concealed", "Found", "u"], numbers, [0, 0, 0, 0, 1]) if numbers else None,
            words(_fit(found["fit"])),
        ),
        part("The candidates", table(["Cause", "Probability", ""], members, [0, 0, 1])),
        part(
            "How it was done",
            bullets(
                [
                    "A fault was drawn at random, or chosen by its name, and added to the virtual machine. What it is"
                    f" stood in a sealed file only; its SHA-256 was shown before the diagnosis: {checksum}.",
                    "The measuring programs ran on that machine, with the gauge along y and along x.",
                    "The diagnosis knew the recordings, the certificate and the machine file without the fault.",
                    "What it found was written to a new machine file; then the seal was opened.",
                ],
                ordered=True,
            ),
        ),
    ]
    title = "A concealed fault, found"
    return story(found, title, f"Concealed was {fault}. {answer.sentence()}", parts)


PLACED = {1: "gauge along y", 2: "gauge along x"}


@figure_style()
def story_figure(answer: RevealedFault, fault: str, residuals: pd.DataFrame, fit: Mapping[str, Any]) -> Figure:
    """Residuals before and after against the position along the gauge (above), candidates and numbers (below).

    Parameters
    ----------
    answer : the comparison
    fault : what was concealed, in words
    residuals : rows of ``residuals.csv``, um
    fit : of ``diagnosis.json``
    """
    figure = new_figure(180.0, 112.0)
    (before, after), (candidates, numbers) = figure.subplots(2, 2, height_ratios=(1.3, 1.0))
    after.sharey(before)
    figure.get_layout_engine().set(rect=(0.0, 0.025, 1.0, 0.975))  # type: ignore[union-attr, call-arg]
    figure.suptitle(f"Concealed: {fault}", fontweight="bold")
    _residuals(before, residuals, "before", f"machine file as it was, rms {fit['rms_before_um']:.2f} µm")
    _residuals(after, residuals, "after", f"with what was found, rms {fit['rms_after_um']:.2f} µm")
    before.set_ylabel("residual (µm)")
    add_legend(figure, axes_entries(before), "lower center")
    _candidates(candidates, answer)
    _numbers(numbers, answer)
    return figure


def _residuals(axes: Axes, residuals: pd.DataFrame, when: str, title: str) -> None:
    for number, placed in PLACED.items():
        rows = residuals[residuals["placement"] == number]
        color, marker = (COLORS["before"], "o") if number == 1 else (COLORS["after"], "s")
        axes.plot(
            rows["position_mm"],
            rows[f"{when}_um"],
            marker,
            color=color,
            ms=2.2,
            alpha=0.7,
            label=placed,
        )
    axes.set_title(title)
    axes.set_xlabel("position along the gauge (mm)")


def _candidates(axes: Axes, answer: RevealedFault) -> None:
    shown = answer.members[:5]
    height = np.arange(len(shown))[::-1]
    colors = [COLORS["measured"] if one.is_truth else COLORS["grey"] for one in shown]
    axes.barh(height, [one.probability for one in shown], color=colors, height=0.6)
    for at, one in zip(height, shown, strict=True):
        axes.text(one.probability + 0.02, at, f"{one.probability:.2f}", va="center", fontsize=7.0)
    axes.set_yticks(height, [one.label for one in shown])
    axes.set_xlim(0.0, 1.18)
    _centred(axes, len(shown))
    axes.set_title("candidates (green: concealed)" if answer.place else "candidates (none was concealed)")
    axes.set_xlabel("probability")
    axes.grid(axis="y", visible=False)


def _numbers(axes: Axes, answer: RevealedFault) -> None:
    height = np.arange(len(answer.numbers))[::-1]
    deviations = [one.deviation for one in answer.numbers]
    axes.axvline(0.0, color=COLORS["measured"], lw=1.2)
    axes.errorbar(deviations, height, xerr=2.0, fmt="o", color=COLORS["after"], capsize=2.0)
    names = [f"{one.name}\n{one.truth:g} | {one.found:.4g} {printed_unit(one.unit)}" for one in answer.numbers]
    axes.set_yticks(height, names)
    reach = max([4.0, *(abs(one) + 2.5 for one in deviations)])
    axes.set_xlim(-reach, reach)
    _centred(axes, len(height))
    axes.set_title("concealed | found, with ± 2u")
    axes.set_xlabel("(found − concealed) / u")
    axes.grid(axis="y", visible=False)


def _centred(axes: Axes, count: int) -> None:
    """Room for three, what there is in the middle."""
    room = max(count, 3) / 2.0
    axes.set_ylim((count - 1) / 2.0 - room, (count - 1) / 2.0 + room)
