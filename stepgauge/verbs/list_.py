"""What there is: shipped files, effects, dialects."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import Repeated, Text, Writes
from stepgauge.verbs.shared import File, GaugeIfNeeded, MachineIfNeeded

if TYPE_CHECKING:
    from stepgauge.files.listing import Listing


def _shipped(folder: str) -> "Listing":
    from stepgauge.files.listing import Listing
    from stepgauge.files.resources import shipped_files

    files = [(path, words) for path, words in shipped_files().values() if path.suffix == ".toml"]
    return Listing.of([(path.stem, words) for path, words in files if path.parent.name == folder])


@verb(shows=True, in_project=False)
def list_gauges() -> "Listing":
    """The shipped gauges; every --gauge takes these names as well as paths."""
    return _shipped("calibration_data")


@verb(shows=True, in_project=False)
def list_machines() -> "Listing":
    """The shipped machines; every --machine takes these names as well as paths."""
    return _shipped("machines")


def write_copies(
    listing: "Listing", copy_to: Annotated[File | None, Writes("FOLDER", folder=True)] = None
) -> list[Path]:
    """A file that is there to be changed.

    Parameters
    ----------
    copy_to : copy the file (and what belongs to it) into this folder, to be changed
    """
    return [] if copy_to is None else listing.copy(copy_to)


@verb(write_copies, shows=True, in_project=False)
def list_files(name: Annotated[str | None, Text("[NAME]"), ARGUMENT] = None) -> "Listing":
    """The shipped gauges, machines, probes and templates; the text of one, or a copy of it to change.

    Parameters
    ----------
    name : print this file; default: list all

    Examples
    --------
    stepgauge list files
    stepgauge list files step-gauge-420.toml
    stepgauge list files dmis.j2 --copy-to my-templates
    """
    from stepgauge.files.listing import Listing
    from stepgauge.files.resources import find_shipped, shipped_files
    from stepgauge.files.text import read_text

    if name is None:
        return Listing.of([(path.name, words) for path, words in shipped_files().values()])
    path = find_shipped(name)
    return Listing(read_text(path).rstrip("\n"), [(path.name, "")])


@verb(shows=True, in_project=False)
def list_effects(
    kinds: Annotated["str | Iterable[str]", Repeated(Text("KIND"), "kind"), ARGUMENT] = (),
    gauge: GaugeIfNeeded = None,
    machine: MachineIfNeeded = None,
) -> "Listing":
    """The effects that a machine file can switch on and a diagnosis can name.

    Without a KIND one line each; with a KIND its equation, source and parameters with unit, bounds and the range that
    occurs on real machines, and an example for the machine file; and what a diagnosis takes to be usual before it has
    seen a reading, with the gauge and on the machine that are given.

    Parameters
    ----------
    kinds : what is to be explained
    gauge : gauge for which usual sizes are said
    machine : machine for which usual sizes are said

    Examples
    --------
    stepgauge list effects
    stepgauge list effects gauge_temperature probe_lobing
    stepgauge list effects gauge_bending -g step-gauge-420 -m my-machine.toml
    """
    from stepgauge.effects import effect_kinds
    from stepgauge.files.listing import Listing
    from stepgauge.verbs.effects_text import effects_text
    from stepgauge.verbs.inputs import resolve_gauge, resolve_machine, several

    known, asked = effect_kinds(every=True), several(kinds) if isinstance(kinds, str) else list(kinds)
    rows = [(kind, known[kind].title()) for kind in sorted(known) if kind in asked or not asked]
    if not asked:
        together = "geometric_errors: all errors of the geometry together, as a diagnosis names them."
        left_out = "'diagnose --without KIND' leaves out any of these."
        explained = "'stepgauge list effects KIND' explains one: equation, parameters, units and bounds."
        return Listing.of(rows, f"\n{together}\n{left_out}\n{explained}")
    steps = None if gauge is None else resolve_gauge(gauge)
    return Listing(effects_text(asked, steps, None if machine is None else resolve_machine(machine)), rows)


@verb(shows=True, in_project=False)
def list_dialects(name: Annotated[str | None, Text("[NAME]"), ARGUMENT] = None) -> "Listing":
    """The languages of controllers, their options, and what is understood of each.

    The options are those of 'stepgauge plan --set'. The statements are all that a program may hold, from the shipped
    template or from your own: anything else is refused, wherever it stands. Each has the source that confirms it.

    Parameters
    ----------
    name : explain this one; default: list all

    Examples
    --------
    stepgauge list dialects
    stepgauge list dialects fanuc
    """
    from stepgauge.files.listing import Listing
    from stepgauge.programs import DIALECTS, find_dialect
    from stepgauge.programs.describe import described

    if name is None:
        return Listing.of([(one.name, f"{one.suffix:8} {one.title}") for one in DIALECTS.values()])
    known = find_dialect(name)
    family = f"As '{known.family}', and:\n\n" if known.family else ""
    return Listing(family + described(known).rstrip("\n"), [(known.name, known.title)])


@verb(shows=True, in_project=False)
def list_priors() -> "Listing":
    """The shipped prior knowledge of a diagnosis: how common a cause is, and its usual size, with reasons."""
    from stepgauge.diagnosis.priors import priors_text
    from stepgauge.files.listing import Listing

    return Listing(priors_text().rstrip("\n"))
