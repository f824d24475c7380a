"""Monte Carlo: the same numbers however it is run, and the numbers that others compute for the same budget."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from GTC import reporting, ureal
from numpy.testing import assert_allclose, assert_array_equal
from scipy import stats

from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.files.resources import find_data
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement, make_placement
from stepgauge.machine.file import Machine, read_machine
from stepgauge.machine.uncertain import Uncertain
from stepgauge.machine.virtual import RunConditions, probing_settings, run_program
from stepgauge.montecarlo import MonteCarloModel, Summary, program_model, recording_model, run_monte_carlo
from stepgauge.montecarlo.inputs import draw
from stepgauge.montecarlo.model import ModelQuantity
from stepgauge.montecarlo.run import make_schedule
from stepgauge.montecarlo.summary import symmetric_interval
from stepgauge.motion.moves import Program
from stepgauge.planning.plan import PlanOptions, make_program
from stepgauge.recording import join_recordings

START = np.array([120.0, 150.0, 200.0])
WARM = RunConditions(gauge_temperature_C=22.0)
EFFECTS = """
[[effect]]
kind = "scale_error"
axis = "x"
ppm = { value = 2.5, u = 0.8 }
[[effect]]
kind = "periodic_scale_error"
axis = "x"
period_mm = { value = 37.0, u = 0.5, distribution = "uniform" }
amplitude_um = { value = 1.0, u = 0.1, distribution = "triangular" }
[[effect]]
kind = "thermal_drift"
direction = "x"
rate_um_per_h = { value = 0.0, u = 3.0, distribution = "student", dof = 8 }
[[effect]]
kind = "empirical"
formula = "a * side * sin(position_mm / 50)"
coefficients = { a = { value = 0.2, u = 0.1 } }
"""


def machine_from(folder: Path, text: str = "", **changed: str) -> Machine:
    """The shipped machine with effects added and keys of its file replaced."""
    source = find_data("bridge-cmm", "machine", "machines").read_text(encoding="utf-8")
    for key, value in changed.items():
        lines = [f"{key} = {value}" if line.startswith(f"{key} ") else line for line in source.splitlines()]
        source = "\n".join(lines)
    (folder / "machine.toml").write_text(source + "\n" + text, encoding="utf-8")
    return read_machine(folder / "machine.toml")


def placed(gauge: Gauge, direction: tuple[float, float, float] = (1.0, 0.0, 0.0)) -> Placement:
    a = np.asarray(direction) / np.linalg.norm(direction)
    return make_placement(START, START + a * (gauge.block_centre_mm[-1] - gauge.block_centre_mm[0]), 1, gauge.n_blocks)


def program_of(gauge: Gauge, machine: Machine, placement: Placement, cycles: int = 2) -> Program:
    return make_program(placement, gauge, PlanOptions(1, gauge.n_blocks, cycles=cycles), probing_settings(machine, 2.0))


@pytest.fixture
def model(gauge: Gauge, tmp_path: Path) -> MonteCarloModel:
    machine = machine_from(tmp_path, EFFECTS, pretravel_um="{ value = 3.0, u = 0.2 }")
    placement = placed(gauge)
    program = program_of(gauge, machine, placement)
    return program_model(program, machine, gauge, placement, WARM, u_gauge_temperature_K=0.1)


def numbers(summary: Summary) -> dict[str, bytes]:
    """All that is summed up, to the last bit."""
    columns = {name: getattr(summary, name) for name in ("value", "mean", "u", "low", "high")}
    return {name: column.tobytes() for name, column in {**columns, **summary.contribution}.items()}


@pytest.mark.parametrize(("jobs", "chunk"), [(1, 7), (2, None)])
def test_processes_and_chunks_change_no_number(
    model: MonteCarloModel, jobs: int, chunk: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("stepgauge.montecarlo.run.PROBINGS_PER_JOB", 1)
    parts = run_monte_carlo(model, 600, seed=5, jobs=jobs, chunk=chunk)
    assert numbers(parts) == numbers(run_monte_carlo(model, 600, seed=5))


def test_another_seed_gives_other_numbers_and_more_runs_keep_the_first_ones(model: MonteCarloModel) -> None:
    values = model.values(5, range(10))
    assert_array_equal(model.values(5, range(4, 8)), values[4:8])
    assert not np.array_equal(model.values(6, range(10)), values)


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_interrupted_run_goes_on_and_ends_in_the_same_numbers(
    model: MonteCarloModel, tmp_path: Path, jobs: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("stepgauge.montecarlo.run.PROBINGS_PER_JOB", 1)
    folder = tmp_path / "runs"
    seen: list[int] = []

    def interrupt(done: int, total: int) -> None:
        seen.append(done)
        if done > total / 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_monte_carlo(model, 2000, seed=1, jobs=jobs, checkpoint=folder, progress=interrupt)
    interrupted_at = seen[-1]
    resumed = run_monte_carlo(model, 2000, seed=1, checkpoint=folder, progress=lambda done, _: seen.append(done))
    assert seen[seen.index(interrupted_at) + 1] > interrupted_at
    assert len(seen) == len(make_schedule(model, 2000).blocks)
    assert numbers(resumed) == numbers(run_monte_carlo(model, 2000, seed=1))
    assert not folder.exists()


def test_runs_whose_values_were_damaged_meanwhile_are_computed_again(model: MonteCarloModel, tmp_path: Path) -> None:
    def interrupt(done: int, total: int) -> None:
        raise KeyboardInterrupt

    folder = tmp_path / "runs"
    with pytest.raises(KeyboardInterrupt):
        run_monte_carlo(model, 500, seed=1, checkpoint=folder, progress=interrupt)
    values = bytearray((folder / "values.f64").read_bytes())
    place = next(at for at, byte in enumerate(values) if byte)
    values[place] ^= 0x40
    (folder / "values.f64").write_bytes(values)
    again = run_monte_carlo(model, 500, seed=1, checkpoint=folder)
    assert numbers(again) == numbers(run_monte_carlo(model, 500, seed=1))


def test_a_checkpoint_of_another_computation_is_not_mistaken_for_this_one(
    model: MonteCarloModel, tmp_path: Path
) -> None:
    def interrupt(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_monte_carlo(model, 500, seed=1, checkpoint=tmp_path / "runs", progress=interrupt)
    again = run_monte_carlo(model, 500, seed=2, checkpoint=tmp_path / "runs")
    assert numbers(again) == numbers(run_monte_carlo(model, 500, seed=2))


def test_a_run_is_what_the_virtual_cmm_measures_with_its_drawn_inputs(model: MonteCarloModel, gauge: Gauge) -> None:
    """The batch against run_program + evaluate, one after the other, without repeatability."""
    runs = range(6)
    placement = placed(gauge)
    quiet = replace(model, inputs=replace(model.inputs, repeatability=False))
    got = quiet.values(3, runs)
    draws = draw(quiet.inputs, 3, runs, gauge.n_faces, model.n_rows)
    assert draws.certificate is not None
    for run in runs:
        x = {key: float(value[run, 0]) for key, value in draws.scalar.items()}
        tables = [dict(table) for table in model.machine.effects]
        tables[0]["ppm"] = x["effect[1].ppm"]
        tables[1] |= {"period_mm": x["effect[2].period_mm"], "amplitude_um": x["effect[2].amplitude_um"]}
        tables[2]["rate_um_per_h"] = x["effect[3].rate_um_per_h"]
        tables[3]["coefficients"] = {"a": x["effect[4].coefficients.a"]}
        table = model.machine.table.model_copy(update={"repeatability_um": 0.0})
        probe = model.machine.probe.model_copy(update={"pretravel_um": x["probe.pretravel_um"]})
        machine = replace(model.machine, table=table, probe=probe, effects=tuple(tables))
        lies = gauge.position_mm + draws.certificate[run] * gauge.u_um * 1e-3
        expansion = gauge.table.model_copy(update={"expansion_per_K": x["gauge.expansion_per_K"]})
        true = replace(gauge, table=expansion, position_mm=lies)
        program = program_of(gauge, model.machine, placement)
        # the gauge is anchored at the middle of its first block, the Monte Carlo at its face 1: a common shift
        start = START + np.array([lies[:2].mean() - gauge.position_mm[:2].mean(), 0.0, 0.0])
        there = make_placement(start, start + np.array([100.0, 0.0, 0.0]), 1, gauge.n_blocks)
        conditions = replace(WARM, gauge_temperature_C=22.0 + x["gauge temperature"])
        recording = run_program(program, machine, true, there, 0, conditions).recording
        recording.frame["gauge_temperature_C"] = 22.0
        result = evaluate(recording, gauge).results[0]
        expected = np.concatenate(
            [
                *(getattr(result, f"{name}_um") for name in ("xf", "sf", "xb", "sb", "xm", "xr")),
                [result.radius.r_eff_mm, result.radius.u_mm],
            ]
        )
        scalars = [got[run, -5], got[run, -4]]
        assert_allclose(np.concatenate([got[run, :-5], scalars]), expected, atol=2e-5)
        assert_allclose(got[run, -2:], [result.band_um, result.worst_two_sigma_um], atol=2e-5)


def test_a_budget_in_the_style_of_gum_h1_against_gtc(gauge: Gauge, tmp_path: Path) -> None:
    """GUM H.1: standard, comparator readings, expansion and temperature of the gauge, here for XF at the last front.

    GTC propagates by the law of propagation (JCGM 100); both must agree within the Monte Carlo error.
    """
    machine = machine_from(tmp_path, '[[effect]]\nkind = "scale_error"\naxis = "x"\nppm = { value = 2.5, u = 0.8 }\n')
    placement = placed(gauge)
    cycles, runs, theta, u_theta = 5, 20_000, 2.0, 0.1
    program = program_of(gauge, machine, placement, cycles)
    model = program_model(program, machine, gauge, placement, WARM, u_theta)
    summary = run_monte_carlo(model, runs, seed=11)
    i = summary.index("xf_um", 41)

    length = gauge.position_mm[40]
    s_last = ureal(length * 1e3, gauge.u_um[40])
    s_first = ureal(0.0, gauge.u_um[0])
    alpha = ureal(gauge.table.expansion_per_K, gauge.table.expansion_uncertainty_per_K)
    temperature = ureal(theta, u_theta)
    ppm = ureal(2.5, 0.8)
    noise = machine.table.repeatability_um
    readings_last = sum(ureal(0.0, noise) for _ in range(cycles)) / cycles
    readings_first = sum(ureal(0.0, noise) for _ in range(cycles)) / cycles
    true = (s_last - s_first) * (1 + alpha * temperature)
    reading = true * (1 + ppm * 1e-6) + readings_last - readings_first
    xf = reading - length * 1e3 * (1 + gauge.table.expansion_per_K * theta)

    u_of_u = 1.0 / np.sqrt(2.0 * runs)
    assert_allclose(summary.u[i], xf.u, rtol=4 * u_of_u)
    assert_allclose(summary.mean[i], xf.x, atol=4 * xf.u / np.sqrt(runs))
    assert_allclose(summary.value[i], xf.x, atol=1e-4)
    assert_allclose([summary.low[i], summary.high[i]], xf.x + np.array([-1.96, 1.96]) * xf.u, atol=0.05 * xf.u)
    for key, one in (("gauge.expansion_per_K", alpha), ("gauge temperature", temperature), ("effect[1].ppm", ppm)):
        component = abs(reporting.u_component(xf, one))
        assert_allclose(summary.contribution[key][i], component, rtol=4 / np.sqrt(2 * summary.contribution_runs))
    total = np.sqrt(sum(u[i] ** 2 for u in summary.contribution.values()))
    assert_allclose(total, summary.u[i], rtol=0.05)


def test_a_recording_keeps_its_errors_and_its_own_repeatability(gauge: Gauge, tmp_path: Path) -> None:
    machine = machine_from(tmp_path, repeatability_um="0.9")
    placement = placed(gauge, (0.6, 0.8, 0.0))
    recording = run_program(program_of(gauge, machine, placement, 5), machine, gauge, placement, 4, WARM).recording
    drift = '[[effect]]\nkind = "scale_error"\naxis = "x"\nppm = { value = 40.0, u = 1.0 }\n'
    model = recording_model(recording, machine_from(tmp_path, drift, repeatability_um="5.0"), gauge)
    assert_allclose(model.machine.table.repeatability_um, 0.9, rtol=0.1)
    summary = run_monte_carlo(model, 4000)
    result = evaluate(recording, gauge).results[0]
    i = summary.index("xm_um", 40)
    assert_allclose(summary.value[i], result.xm_um[39])
    assert_allclose(summary.mean[i], result.xm_um[39], atol=4 * summary.u[i] / np.sqrt(4000))
    along_x_m = 0.6 * 0.6 * gauge.position_mm[39] * 1e-3  # what 1 ppm on x is worth along the gauge
    assert_allclose(summary.contribution["effect[1].ppm"][i], along_x_m, rtol=0.1)
    assert_allclose(summary.mean[summary.index("worst_two_sigma_um")], 2.9, atol=0.5)


@pytest.mark.parametrize(
    ("distribution", "expected"),
    [
        ("normal", stats.norm(2.0, 0.5)),
        ("uniform", stats.uniform(2.0 - 0.5 * 3**0.5, 3**0.5)),
        ("triangular", stats.triang(0.5, 2.0 - 0.5 * 6**0.5, 6**0.5)),
        ("arcsine", stats.arcsine(2.0 - 0.5 * 2**0.5, 2**0.5)),
        ("student", stats.t(8, 2.0, 0.5)),
    ],
)
def test_distributions_are_those_of_scipy(distribution: Any, expected: Any) -> None:
    p = np.linspace(1e-4, 1 - 1e-4, 201)
    dof = 8.0 if distribution == "student" else None
    assert_allclose(Uncertain("k", 2.0, 0.5, distribution, dof).draw(p), expected.ppf(p), rtol=1e-9)


def test_the_interval_leaves_out_as_many_below_as_above() -> None:
    """JCGM 101:2008, 7.7.2: M = 1000, q = 950, r = 25."""
    low, high = symmetric_interval(np.random.default_rng(1).permutation(np.arange(1.0, 1001.0))[None, :])
    assert (low[0], high[0]) == (25.0, 975.0)


@pytest.mark.parametrize(
    ("text", "changed", "message"),
    [
        ("", {"measuring_speed_mm_s": "{ value = 3.0, u = 0.1 }"}, "measuring_speed_mm_s cannot carry an uncertainty"),
        ("", {"repeatability_um": "{ value = 0.3, u = 0.1 }"}, "may be drawn from -0.2 to 0.8"),
        ("", {"pretravel_um": "{ value = 3.0, u = -0.1 }"}, "pretravel_um.u is wrong"),
        ("", {"pretravel_um": '{ value = 3.0, u = 0.1, distribution = "gauss" }'}, "distribution is wrong"),
        ("", {"pretravel_um": '{ value = 3.0, u = 0.1, distribution = "student" }'}, "dof together with"),
    ],
)
def test_uncertainties_that_make_no_sense_are_refused(
    gauge: Gauge, tmp_path: Path, text: str, changed: dict[str, str], message: str
) -> None:
    program = program_of(gauge, read_machine("bridge-cmm"), placed(gauge))

    def build() -> MonteCarloModel:
        return program_model(program, machine_from(tmp_path, text, **changed), gauge, placed(gauge))

    with pytest.raises(InputError, match=message):
        build()


def test_nothing_uncertain_is_said_so(gauge: Gauge, tmp_path: Path) -> None:
    machine = machine_from(tmp_path, repeatability_um="0.0")
    table = gauge.table.model_copy(update={"expansion_uncertainty_per_K": 0.0})
    certain = replace(gauge, table=table, u_um=np.zeros(gauge.n_faces))
    model = program_model(program_of(gauge, machine, placed(gauge)), machine, certain, placed(gauge))
    with pytest.raises(InputError, match="nothing carries an uncertainty"):
        run_monte_carlo(model, 10)


@pytest.mark.parametrize("compensated", [True, False])
def test_the_temperature_of_the_scales_counts_compensated_or_not(
    gauge: Gauge, tmp_path: Path, compensated: bool
) -> None:
    """0.1 K of steel: 1.15 um/m, as an error of the sensor or of the room."""
    machine = machine_from(tmp_path, temperature_C="{ value = 22.0, u = 0.1 }")
    table = machine.table.model_copy(update={"scales_compensated": compensated})
    machine = replace(machine, table=table)
    model = program_model(program_of(gauge, machine, placed(gauge)), machine, gauge, placed(gauge))
    summary = run_monte_carlo(model, 1000)
    i = summary.index("xf_um", 41)
    length_m = gauge.position_mm[40] * 1e-3
    assert_allclose(summary.contribution["machine.temperature_C"][i], 1.15 * length_m, rtol=0.1)
    assert_allclose(summary.value[i], 0.0 if compensated else -23.0 * length_m, atol=1e-3)


def test_placements_share_the_gauge_and_not_the_noise(gauge: Gauge, tmp_path: Path) -> None:
    """XF of one placement minus XF of the other: certificate and expansion drop out, the repeatability doubles."""
    machine = machine_from(tmp_path)
    recordings = []
    for number, direction in enumerate([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)], 1):
        placement = placed(gauge, direction)
        conditions = replace(WARM, placement=number)
        program = program_of(gauge, machine, placement, 5)
        recordings.append(run_program(program, machine, gauge, placement, number, conditions).recording)
    model = recording_model(join_recordings(recordings), machine, gauge)
    values = model.values(2, range(3000))
    names = list(model.quantities)
    one, other = (values[:, names.index(ModelQuantity("xf_um", number, 41))] for number in (1, 2))
    noise = model.machine.table.repeatability_um
    assert_allclose((one - other).std(), np.sqrt(4 * noise**2 / 5), rtol=0.06)
    assert one.std() > 1.5 * (one - other).std() / np.sqrt(2)
