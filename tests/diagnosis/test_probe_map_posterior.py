"""What the posterior of probe maps rests on: sizes summed exactly, laws that say the same by their priors, no less."""

from dataclasses import replace

import numpy as np
import pytest

from stepgauge.diagnosis.maps.candidates import candidates_for
from stepgauge.diagnosis.maps.data import estimate_scatter
from stepgauge.diagnosis.maps.diagnose import diagnose_map
from stepgauge.diagnosis.maps.model import MapModel
from stepgauge.diagnosis.maps.signatures import MapRows, make_problem
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.inference.search import Search
from tests.diagnosis.test_probe_map import changed, measured, probe_file, table  # noqa: F401

FORCE = ("trigger_force_N",)


def search_of(table, data, quantities=FORCE):  # noqa: F811
    model = MapModel(table, "probe", data)
    rows = MapRows(model, estimate_scatter(data, model.residuals(())).sigma)
    problem = make_problem(rows, candidates_for(table, quantities), shipped_priors(), np.zeros(len(rows.um)))
    return Search(problem, shipped_priors().scatter)


def added(search, label):
    look = next(look for look in search.screen(search.start) if look.candidate.label == label)
    return search.added(search.start, look)


def test_sizes_are_summed_as_the_exact_number_has_them(table):  # noqa: F811
    search = search_of(table, measured(changed(table, preload_N=6.5), quantities=FORCE))
    state = added(search, "preload")
    (term,) = state.terms
    sizes = term.candidate.sizes
    each = [
        search.evidence((replace(term, sd=float(sd), log_prior=float(w)),), state.noise).log_posterior
        for sd, w in zip(sizes.sd, sizes.log_weight, strict=True)
    ]
    expected = np.logaddexp.reduce(each) + term.candidate.log_odds
    assert state.log_posterior == pytest.approx(float(expected), abs=0.1)


def test_changes_that_say_the_same_differ_by_their_priors_alone(table):  # noqa: F811
    """Every force is proportional to the spring's and to the gauge's factor, so that the evidence tells nothing."""
    search = search_of(table, measured(changed(table, preload_N=6.5), quantities=FORCE))
    preload, gauge = (added(search, label) for label in ("preload", "force_gauge_scale"))
    kinds = shipped_priors().maps.laws
    share = 0.59 / 5.91

    def log_prior(kind):
        sizes = shipped_priors().sizes.about(kinds.of(kind).usual)
        density = np.exp(sizes.log_weight - 0.5 * (share / sizes.sd) ** 2) / sizes.sd
        return np.log(kinds.of(kind).odds * density.sum())

    expected = log_prior("preload") - log_prior("force_gauge_scale")
    assert preload.log_posterior - gauge.log_posterior == pytest.approx(expected, abs=0.15)


def test_a_law_is_computed_at_the_size_that_it_has(table):  # noqa: F811
    search = search_of(table, measured(changed(table, carrier_mm=21.0), quantities=FORCE))
    state = added(search, "lever_arm")
    size = float(state.amplitudes(0)[0][0])
    assert size == pytest.approx(21.0, abs=1.5)
    assert state.terms[0].shape.size == pytest.approx(size, rel=0.02)


def test_what_is_usual_decides_between_laws_that_say_the_same(table):  # noqa: F811
    """A lever that is known makes a contact radius of what was called a lever."""
    shipped = shipped_priors()
    known = shipped.maps.laws.of("lever_arm").model_copy(update={"odds": 1e-4})
    laws = shipped.maps.laws.model_copy(update={"kinds": {**shipped.maps.laws.kinds, "lever_arm": known}})
    priors = shipped.model_copy(update={"maps": shipped.maps.model_copy(update={"laws": laws})})
    data = measured(changed(table, carrier_mm=6.0))
    for given, kind in ((shipped, "lever_arm"), (priors, "contact_radius")):
        assert diagnose_map(MapModel(table, "probe", data), priors=given).findings[0].kind == kind
