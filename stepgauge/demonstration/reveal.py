"""The seal is opened: truth and answer side by side, in words, in one figure and in one page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from stepgauge.demonstration.answer import Compared, RevealedFault, compare_answer
from stepgauge.demonstration.conceal import SEALED, Concealed
from stepgauge.demonstration.faults import FAULTS
from stepgauge.demonstration.figure import story_figure
from stepgauge.demonstration.seal import open_seal
from stepgauge.diagnosis.wording.limits import predictions
from stepgauge.diagnosis.wording.notation import probability
from stepgauge.figures.style import save_figure
from stepgauge.files.text import read_result
from stepgauge.reports.blocks import bullets, figure, part, table, words
from stepgauge.reports.diagnosis import story
from stepgauge.reports.render import write_report

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
