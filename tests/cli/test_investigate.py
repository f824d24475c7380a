"""``stepgauge investigate``: what is refused before anything moves, and how a person answers or leaves."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Run

COMMON = ("-g", "step-gauge-420", "-m", "bridge-cmm")


@pytest.fixture
def placement(tmp_path: Path) -> Path:
    path = tmp_path / "placement.toml"
    path.write_text("c1_mm = [350, 300, 150]\nc2_mm = [350, 700, 150]\nfirst_block = 1\nlast_block = 21\n")
    return path


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "either --server or --simulate"),
        (("--simulate", "--server", "127.0.0.1:1"), "either --server or --simulate"),
        (("--server", "127.0.0.1:1", "--faults", "f.toml"), "expected --simulate"),
        (("--simulate", "--within", "0:700,900:100,0:600"), "not a box"),
        (("--simulate", "--within", "0:700,0:600,0:600"), "the gauge lies outside of it now"),
        (("--simulate", "--resume"), "there is no journal to resume"),
        (("--server", "127.0.0.1:1"), "127.0.0.1:1"),
        (("--simulate", "--faults", "none.toml"), "none.toml"),
    ],
)
def test_what_is_wrong_is_said_before_anything_moves(
    run: Run, placement: Path, tmp_path: Path, options: tuple[str, ...], message: str
) -> None:
    result = run("investigate", *COMMON, "-p", placement, *options, "-o", tmp_path / "cause")
    assert result.code == 2
    assert message in result.err
    assert not list((tmp_path / "cause").glob("run-*.csv"))


def test_without_a_placement_a_server_has_to_send_points_by_hand(run: Run, tmp_path: Path) -> None:
    result = run("investigate", *COMMON, "--simulate", "-o", tmp_path / "cause")
    assert result.code == 2
    assert "--simulate: needs --placement" in result.err


def test_shipped_gauge_and_machine_are_investigated_to_the_end(run: Run, placement: Path, tmp_path: Path) -> None:
    """With all laws of the vocabulary, of which some have tolerances of their shape; no cause is there."""
    options = ("--simulate", "--yes", "--minutes", "9")
    result = run("investigate", *COMMON, "-p", placement, *options, "-o", tmp_path / "cause")
    assert result.code == 0, result.err
    assert "Nothing was found" in result.err
    assert (tmp_path / "cause" / "investigation.json").exists()
