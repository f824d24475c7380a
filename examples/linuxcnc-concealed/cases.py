"""What is measured in each case; what is hidden there is no part of it."""

from __future__ import annotations

from pathlib import Path

from stepgauge.files.config import TomlTable, check_table, read_toml

CASES = Path(__file__).resolve().parent / "cases.toml"
GAUGE = "step-gauge-420"


class Case(TomlTable):
    """Every placement at every speed, and the blocks and cycles of each of these runs."""

    placements: list[str]
    speeds_mm_s: list[float]
    blocks: str
    cycles: int


def read_cases() -> dict[str, Case]:
    """All cases by name."""
    return {name: check_table(Case, entry, CASES, name) for name, entry in read_toml(CASES).items()}
