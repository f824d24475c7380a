"""``evaluate --draw`` and ``evaluate --mpe`` as a user runs them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Run, again

MAGIC = {"png": b"\x89PNG", "svg": b"<?xml"}
GAUGE = ("-g", "step-gauge-420")


@pytest.mark.parametrize("suffix", ["png", "svg"])
def test_every_figure_in_the_format_that_is_asked_for(run: Run, files: Path, suffix: str) -> None:
    drawn = ["all"] if suffix == "png" else ["arrows", "run"]
    only = [word for kind in drawn for word in ("--draw", kind)]
    line = ("evaluate", files / "recording.csv", *GAUGE, "-m", files / "machine.toml", "--mpe", "1.8 + L/350", *only)
    result = run(*line, "--figure", suffix, "-o", files / "f")
    assert result.code == 0, result.err
    names = sorted(path.name for path in (files / "f").iterdir() if not path.name.startswith("evaluation"))
    kinds = ["arrows", "bidirectional", "error", "repeatability", "run"] if suffix == "png" else ["arrows", "run"]
    assert names == [f"{kind}.{suffix}" for kind in kinds]
    assert all((files / "f" / name).read_bytes().startswith(MAGIC[suffix]) for name in names)


def test_several_placements_have_figures_of_their_own(run: Run, files: Path) -> None:
    both = (files / "recording.csv", again(run, files))
    result = run("evaluate", *both, *GAUGE, "--draw", "error", "--draw", "arrows", "-o", files / "f")
    assert result.code == 0, result.err
    names = {path.name for path in (files / "f").iterdir() if not path.name.startswith("evaluation")}
    assert names == {"error-placement-1.png", "error-placement-2.png", "arrows.png"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--mpe", "1.8 + L*350"], "--mpe: this is no maximum permissible error; found '1.8 + L*350'"),
        (["-m", "narrow"], "placement 1 is outside the travel of x"),
        (["--draw", "pie"], "--draw: not a choice; found 'pie'"),
        (["-g", "step-gauge-9"], "no such gauge file"),
    ],
)
def test_wrong_input_is_one_line(run: Run, files: Path, arguments: list[str], message: str) -> None:
    arguments = [str(files / "narrow.toml") if one == "narrow" else one for one in arguments]
    (files / "narrow.toml").write_text((files / "machine.toml").read_text().replace("x = [0, 700]", "x = [0, 20]"))
    result = run("evaluate", files / "recording.csv", *GAUGE, "--draw", "all", "-o", files / "f", *arguments)
    assert result.code == 2
    assert message in result.err
    assert "Traceback" not in result.err
    assert len(result.err.splitlines()) == 1
    assert not (files / "f").exists()


def test_evaluate_counts_what_is_beyond_the_mpe(run: Run, files: Path) -> None:
    line = ("evaluate", files / "recording.csv", *GAUGE, "-o", files / "r")
    said = run(*line, "--mpe", "50").err
    assert "Undecidable: MPE = ± 50 µm" in said
    assert "U lacks the uncertainty budget" in said
    assert "0 of 7 errors are beyond the limit" in said
    assert "errors are beyond the limit" in run(*line, "--mpe", "0.001 + L/1000000").err
    assert run(*line, "--mpe", "no").code == 2


def test_evaluate_takes_the_mpe_of_the_machine_file_where_no_other_is_stated(run: Run, files: Path) -> None:
    """And not that of another machine: nothing is written then."""
    own, other = files / "limited.toml", files / "other.toml"
    said = (files / "machine.toml").read_text()
    own.write_text(said.replace("[machine]\n", '[machine]\nmpe = "40"\n', 1))
    other.write_text(own.read_text().replace('name = "', 'name = "Another ', 1))
    line = ("evaluate", files / "recording.csv", *GAUGE, "-o", files / "limited")
    refused = run(*line, "-m", other)
    assert refused.code == 2
    assert "not the machine of this recording" in refused.err
    assert not (files / "limited").exists()
    assert "MPE" not in run(*line, "-m", files / "machine.toml").err
    assert "Undecidable: MPE = ± 40 µm" in run(*line, "-m", own).err
    assert "Undecidable: MPE = ± 50 µm" in run(*line, "-m", own, "--mpe", "50").err
