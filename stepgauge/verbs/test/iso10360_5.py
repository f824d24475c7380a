"""``test iso10360-5``: probing performance of a CMM by ISO 10360-5."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated

from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import Flag, Number, Reads, Repeated
from stepgauge.verbs.shared import CoverageFactor, File, MachineName
from stepgauge.verbs.statements import write_test

if TYPE_CHECKING:
    import pandas as pd

    from stepgauge.probes.results import SpherePoints
    from stepgauge.reports.outcome import StandardTest

    One = File | pd.DataFrame | SpherePoints

Limit = Annotated[float | None, Number("um", above=0.0)]
Known = Annotated[float | None, Number("um", 0.0)]


@verb(write_test)
def iso10360_5(
    points: Annotated["One | Iterable[One]", Repeated(Reads("POINTS.csv"), "points"), ARGUMENT],
    *,
    sphere_diameter_mm: Annotated[float, Number("mm", above=0.0)],
    tip_diameters_mm: Annotated["float | Iterable[float]", Repeated(Number("mm", above=0.0), "tip-diameter")],
    mpe_form_um: Limit = None,
    mpe_size_um: Limit = None,
    mpe_location_um: Limit = None,
    u_sphere_diameter_um: Known = None,
    sphere_form_um: Known = None,
    u_sphere_form_um: Known = None,
    another_sphere: Annotated[bool, Flag()] = False,
    coverage_factor: CoverageFactor = 2.0,
    machine_name: MachineName = None,
) -> "StandardTest":
    """Probing performance of a CMM by ISO 10360-5, from 25 points on a test sphere.

    By ISO 10360-5:2020: P_Form and P_Size. POINTS.csv holds recorded tip centres, before any radius compensation, and
    the unit vectors of travel, as for 'probe qualify': x_mm,y_mm,z_mm,approach_i,approach_j,approach_k. One file is the
    test of a single stylus; five files, one for each stylus or way of it, are the multi-stylus test, with the location
    value L_Dia. The sphere must not be the one that the probe was qualified on. The decision rule is that of ISO
    14253-1.

    Parameters
    ----------
    points : files of points, one or one for each stylus
    sphere_diameter_mm : calibrated diameter of the test sphere
    tip_diameters_mm : effective tip diameter as the machine's qualification gave it; once for all styli or once for
        each
    mpe_form_um : maximum permissible error of P_Form; default: no decision
    mpe_size_um : maximum permissible error of P_Size; default: no decision
    mpe_location_um : maximum permissible error of L_Dia; default: no decision
    u_sphere_diameter_um : standard uncertainty of the diameter; default: not stated
    sphere_form_um : form error of the test sphere; default: not stated
    u_sphere_form_um : standard uncertainty of that form error; default: not stated
    another_sphere : the probe was qualified on another sphere, as the standard asks; without it no conformity is stated
    machine_name : the machine, for the report

    Returns
    -------
    The test: ``test.values`` has P_Form, P_Size and L_Dia, with figure, table and report.

    Examples
    --------
    stepgauge probe sphere omp40-2-50mm --sphere-diameter 25 -o sphere.csv
    stepgauge test iso10360-5 sphere.csv --sphere-diameter 25 --tip-diameter 5.991 --mpe-form 12 --mpe-size 10 \\
        --sphere-form 0.1 --u-sphere-form 0.03 --u-sphere-diameter 0.1 -o probing
    """
    from stepgauge.files.tables import given_table
    from stepgauge.probes.files import read_points
    from stepgauge.reports.iso10360_5 import probing_outcome
    from stepgauge.standards.iso10360_5 import ProbingLimits, TestSphere, probing_test
    from stepgauge.verbs.inputs import several

    named = {"P_Form": mpe_form_um, "P_Size": mpe_size_um, "L_Dia": mpe_location_um}
    limits = ProbingLimits(named, coverage_factor)
    stated = (u_sphere_diameter_um, sphere_form_um, u_sphere_form_um, another_sphere or None)
    sphere = TestSphere(sphere_diameter_mm, *stated)
    probed = [read_points(given_table(one)) for one in several(points)]
    return probing_outcome(probing_test(probed, sphere, several(tip_diameters_mm), limits), machine_name)
