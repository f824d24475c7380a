"""Hide causes in a fleet: only where the crossing determines them, and a few where nothing does.

Candidates are drawn at random and kept if the best single rival leaves enough of them (:mod:`observer`) at strength 1,
with everything else that was hidden before allowed for. So a cause of strength 0.5 keeps a quarter of that chi2.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np

from benchmarks.fleet.causes import CLEAR, SPREAD, Cause, bump_on_faces_um, bump_sd_mm
from benchmarks.fleet.design import DAYS, Fleet
from benchmarks.fleet.observer import RATE_TERMS, TRIGGER_TERMS, Observer, Patterns, rate_observer, trigger_observer
from benchmarks.fleet.parts import HALLS, LINES, Array

ENOUGH_CHI2 = 64.0
"""Left of a cause of strength 1 by its best rival: eight standard deviations, four at strength 0.5."""
MACHINE_KINDS = ("scale", "knocked_scale", "squareness", "reversal", "local_scale")
OF_EACH_KIND = 0.02
"""Share of the machines with each of these."""
RATE_KINDS = {"scale", "squareness", "certificate_scale", "gauge_expansion", "temperature"}
RIVALS_TRIED = 6
"""Rivals that are computed, those that share most recordings."""
LEAST_MACHINES = 3
"""On so many machines a block or worn blocks must have been seen, so that it follows the gauge."""

BAD_PARTS = {"certificate_scale": 1, "gauge_expansion": 1, "block": 3}
"""How many causes the shared gauge has of a kind."""

Terms = tuple[tuple[str, str], ...]


class Planter:
    """Draws causes for one fleet; sizes are of strength 1."""

    def __init__(self, fleet: Fleet, seed: int) -> None:
        self.fleet, self.random = fleet, np.random.default_rng([seed, 2])
        self.patterns = Patterns(fleet)
        self.rate, self.trigger = rate_observer(self.patterns), trigger_observer(self.patterns)
        self.causes: list[Cause] = []

    def plant(self) -> list[Cause]:
        """All causes: first what many recordings share, so that the rest is judged with it allowed for."""
        self._hall()
        self._lines()
        self._gauges()
        self._probes()
        self._machines()
        self._captives()
        return self.causes

    # --- what is drawn ------------------------------------------------------------------------------------------------

    def _size(self, kind: str, signed: bool = True) -> float:
        size = CLEAR[kind][0] * self.random.uniform(1.0 - SPREAD, 1.0 + SPREAD)
        return float(size * (self.random.choice([-1.0, 1.0]) if signed else 1.0))

    def _hall(self) -> None:
        """Poor air conditioning: a seasonal error and one of the day, the same for all gauges in the hall."""
        for hall in self.random.permutation(HALLS):
            days = np.unique(self.fleet.day_of[self.fleet.hall_of == hall])
            if len(days) == 0:
                continue
            season = np.sin(2.0 * np.pi * days / 365.25 + self.random.uniform(0.0, 6.28))
            kelvin = 0.8 * season + self.random.normal(0.0, 0.8, len(days))
            kelvin *= self._size("temperature", signed=False) / np.sqrt(np.mean(kelvin**2))
            of_day = {int(day): float(value) for day, value in zip(days, kelvin, strict=True)}
            size = float(np.sqrt(np.mean(kelvin**2)))
            cause = Cause("hall", str(hall), "temperature", "", size, details={"kelvin_of_day": of_day})
            if self._keep(cause):
                return

    def _lines(self) -> None:
        """One line with a wrong scale, another with a pitch law; what single machines have scatters about it."""
        lines = [str(line) for line in self.random.permutation(LINES)]
        scales = [Cause("type", line, "scale", axis, self._size("scale")) for line in lines for axis in "xy"]
        wrong = next((c for c in map(self._individual, scales) if self._enough_members(c) and self._keep(c)), None)
        for line in lines:
            cause = self._pitch_law(line)
            if (wrong is None or line != wrong.owner) and self._enough_members(cause):
                self.causes.append(cause)
                return

    def _individual(self, cause: Cause) -> Cause:
        members = [machine.name for machine in self.fleet.machines if machine.line == cause.owner]
        scatter = np.clip(self.random.standard_normal(len(members)), -2.0, 2.0)
        of = {name: float(cause.size * (1.0 + SPREAD * own)) for name, own in zip(members, scatter, strict=True)}
        return replace(cause, size=float(np.mean(list(of.values()))), details={"of_machine": of}) if of else cause

    def _pitch_law(self, line: str) -> Cause:
        """One period for the line; amplitude and phase are each machine's own."""
        axis = str(self.random.choice(["x", "y"]))
        cause = self._individual(Cause("type", line, "periodic", axis, self._size("periodic", signed=False)))
        amplitudes = {name: abs(value) for name, value in cause.details.get("of_machine", {}).items()}
        phases = {name: float(self.random.uniform(0.0, 2.0 * np.pi)) for name in amplitudes}
        details = {"of_machine": amplitudes, "phase_rad_of_machine": phases}
        return replace(cause, details={**details, "period_mm": float(self.random.uniform(33.0, 75.0))})

    def _enough_members(self, cause: Cause) -> bool:
        """Whether the line has machines that were measured along the axis of the cause."""
        along = self.patterns.of("type", cause.owner, "scale", cause.where) > 0.4
        return len(np.unique(self.fleet.machine_of[along])) >= LEAST_MACHINES

    def _gauges(self) -> None:
        """The shared gauge is bad; a quarter of the others are worn, dropped, or wrong from the first."""
        shared = self.fleet.gauges[self.fleet.shared].name
        kinds = [str(kind) for kind in self.random.permutation(["certificate_scale", "gauge_expansion", "block"])]
        done = [shared]
        for kind in kinds:
            # Of blocks several are wrong: a row of the certificate's table was copied wrongly.
            if sum(self._first([self._gauge_cause(shared, kind)]) is not None for _ in range(BAD_PARTS[kind])):
                break
        free = [g.name for k, g in enumerate(self.fleet.gauges) if k not in self.fleet.captive and g.name != shared]
        wanted = ["wear_fronts", "dropped", "gauge_expansion", "block", "wear_used", "certificate_scale"]
        for kind in wanted[: max(1, round(len(self.fleet.gauges) * 0.25))]:
            drawn = [str(name) for name in self.random.permutation([name for name in free if name not in done])]
            if cause := self._first(self._gauge_cause(name, kind) for name in drawn):
                done.append(cause.owner)

    def _gauge_cause(self, name: str, kind: str) -> Cause:
        gauge = next(gauge for gauge in self.fleet.gauges if gauge.name == name)
        if kind in ("block", "dropped"):
            hidden = {cause.where for cause in self.causes if cause.owner == name}
            block = str(self.random.choice([b for b in range(3, gauge.blocks - 1) if str(b) not in hidden]))
            start = self._start("gauge", name) if kind == "dropped" else None
            return Cause("gauge", name, "block", block, self._size("block"), start)
        if kind.startswith("wear"):
            details = {"blocks": int(gauge.blocks * self.random.uniform(0.3, 0.5))} if kind == "wear_used" else {}
            where = kind.removeprefix("wear_")
            return Cause("gauge", name, "wear", where, self._size("wear", signed=False), details=details)
        return Cause("gauge", name, kind, "", self._size(kind))

    def _start(self, owner_kind: str, owner: str) -> int | None:
        """A day between two visits, not in the first or last fifth of them; None if there are too few."""
        days = np.unique(self.fleet.day_of[self.fleet.owned(owner_kind, owner)])
        if len(days) < 2:
            return None
        after = int(self.random.integers(max(1, len(days) // 5), max(2, len(days) - len(days) // 5)))
        return int(self.random.integers(days[after - 1] + 1, days[after] + 1))

    def _probes(self) -> None:
        names = [str(name) for name in self.random.permutation(np.unique(self.fleet.probe_of))]
        for part in (names[::2], names[1::2]):
            self._first(Cause("probe", name, "radius", "", self._size("radius")) for name in part)

    def _machines(self) -> None:
        """Machines knocked on some day, and machines that were wrong from the first."""
        taken = set(self.fleet.captive.values())
        lines = self._wrong_lines()  # of those machines a scale error of their own is a matter of words
        free = [m.name for k, m in enumerate(self.fleet.machines) if k not in taken and m.line not in lines]
        for kind in MACHINE_KINDS * max(1, round(OF_EACH_KIND * len(self.fleet.machines))):
            done = {cause.owner for cause in self.causes}
            drawn = [str(name) for name in self.random.permutation([name for name in free if name not in done])]
            self._first(cause for name in drawn for cause in self._machine_causes(name, kind))

    def _machine_causes(self, name: str, kind: str) -> Iterator[Cause]:
        """A candidate, or none where the machine was never measured so that it would be seen."""
        if kind == "local_scale":
            yield from self._local(name)
            return
        plain = kind.removeprefix("knocked_")
        where = "xy" if plain == "squareness" else str(self.random.choice(["x", "y"]))
        start = None if kind == "scale" else self._start("machine", name)
        if kind == "scale" or start is not None:
            yield Cause("machine", name, plain, where, self._size(plain), start)

    def _local(self, name: str) -> Iterator[Cause]:
        """A bump of the scale as wide as a block, where a block of a gauge lies in the fixture."""
        own = np.flatnonzero(self.fleet.owned("machine", name))
        if len(own) == 0:
            return
        recording = self.fleet.recordings[int(self.random.choice(own))]
        if recording.placement not in ("x", "y"):
            return
        gauge = self.fleet.gauges[recording.gauge]
        axis = "xy".index(recording.placement)
        block = int(self.random.integers(3, gauge.blocks - 1))
        middle = (2 * block - 1.5) / (2 * gauge.blocks) - 0.5
        at_mm = recording.middle_mm[axis] + middle * gauge.length_mm * recording.axis[axis]
        details = {"at_mm": float(at_mm), "sd_mm": bump_sd_mm(gauge), "gauge": gauge.name, "block": block}
        yield Cause("machine", name, "local_scale", recording.placement, self._size("local_scale"), details=details)

    def _captives(self) -> None:
        """Pairs that nothing determines: a gauge and its only machine; the last of three pairs is sound."""
        for number, (bar, host) in enumerate(sorted(self.fleet.captive.items())):
            gauge, machine = self.fleet.gauges[bar], self.fleet.machines[host]
            if number == 2 or np.sum(self.fleet.gauge_of == bar) < 2:
                continue
            faces = self._captive_face(gauge.name, machine.name)
            if number == 1 and faces:
                self.causes.append(replace(faces[self.random.integers(2)], determined=False))
            elif machine.line not in self._wrong_lines():
                self.causes.append(replace(self._captive_rate(gauge.name, machine.name), determined=False))

    def _wrong_lines(self) -> set[str]:
        return {cause.owner for cause in self.causes if (cause.owner_kind, cause.kind) == ("type", "scale")}

    def _captive_rate(self, gauge: str, machine: str) -> Cause:
        ways = (("gauge", gauge, "certificate_scale"), ("machine", machine, "scale"))
        own, rival = ways if self.random.random() < 0.5 else ways[::-1]
        return Cause(*own, "x" if own[0] == "machine" else "", self._size("scale"), rivals=(rival,))

    def _captive_face(self, gauge: str, machine: str) -> tuple[Cause, ...]:
        """The same touches either way: a block that is off, or the scale where that block always lies."""
        local = next(self._local(machine), None)
        if local is None:
            return ()
        block = Cause("gauge", gauge, "block", str(local.details["block"]), self._size("block"))
        return (
            replace(local, rivals=(("gauge", gauge, "block"),)),
            replace(block, rivals=(("machine", machine, "local_scale"),)),
        )

    # --- what is kept -------------------------------------------------------------------------------------------------

    def _first(self, candidates: Iterable[Cause]) -> Cause | None:
        """The first candidate that the crossing determines, hidden; None if there is none."""
        return next((cause for cause in candidates if self._keep(cause)), None)

    def _keep(self, cause: Cause) -> bool:
        judge: Callable[[Cause], Cause | None]
        if cause.kind in RATE_KINDS:
            judge = self._judged_by_rate
        elif cause.kind in ("reversal", "radius") or cause.where == "fronts":
            judge = self._judged_by_trigger
        else:
            judge = self._judged_by_faces
        kept = judge(cause)
        if kept is None:
            return False
        self.causes.append(kept)
        return True

    def _judged_by_rate(self, cause: Cause) -> Cause | None:
        rivals = self._rivals(cause, {"machine": "scale", "gauge": "certificate_scale", "hall": "temperature"})
        columns = self._own_columns(cause)
        left = self._least(self.rate, cause, columns.sum(axis=1), rivals, RATE_TERMS)
        if left < ENOUGH_CHI2 or not self._kind_is_seen(self.rate, cause, columns.sum(axis=1), RATE_TERMS):
            return None
        self.rate.expect(columns, 1.0)
        return replace(cause, rivals=rivals, leftover_chi2=round(left, 1))

    def _judged_by_trigger(self, cause: Cause) -> Cause | None:
        rivals = self._rivals(cause, {"machine": "reversal", "probe": "radius", "gauge": "wear"})
        columns = self._own_columns(cause)
        left = self._least(self.trigger, cause, columns[:, 0], rivals, TRIGGER_TERMS)
        if left < ENOUGH_CHI2:
            return None
        self.trigger.expect(columns, 1.0)
        return replace(cause, rivals=rivals, leftover_chi2=round(left, 1))

    def _judged_by_faces(self, cause: Cause) -> Cause | None:
        """Single faces: the gauge must have been on several machines; the scale must show on two gauges."""
        if cause.kind == "local_scale":
            seen = self._gauges_on(cause)
            rivals = tuple(("gauge", name, "block") for name in sorted(seen))
            return replace(cause, rivals=rivals) if len(seen) >= 2 else None
        after = self.fleet.owned("gauge", cause.owner) & (self.fleet.day_of >= (cause.start or 0))
        late = self.fleet.day_of > 0.6 * DAYS if cause.kind == "wear" else True
        if len(np.unique(self.fleet.machine_of[after & late])) < LEAST_MACHINES:
            return None
        return replace(cause, rivals=self._rivals(cause, {"machine": "local_scale"}))

    def _gauges_on(self, cause: Cause) -> set[str]:
        """Gauges that show a bump, each by itself to as many standard deviations as asked for."""
        chi2: dict[str, float] = {}
        for k in np.flatnonzero(self.fleet.owned("machine", cause.owner)):
            recording = self.fleet.recordings[k]
            gauge, machine = self.fleet.gauges[recording.gauge], self.fleet.machines[recording.machine]
            bump = bump_on_faces_um(cause, recording, gauge)
            noise = np.hypot(machine.repeatability_um / np.sqrt(recording.cycles), 0.05)
            chi2[gauge.name] = chi2.get(gauge.name, 0.0) + float(np.sum((bump / noise) ** 2))
        return {name for name, value in chi2.items() if value > ENOUGH_CHI2}

    def _own_columns(self, cause: Cause) -> Array:
        """What the cause does to the rate or trigger distance of every recording; of a hall a column for each day."""
        if cause.kind == "temperature":
            kelvin = cause.details["kelvin_of_day"]
            return np.asarray(self.patterns.days(cause.owner, kelvin) * np.array(list(kelvin.values())))
        unit = self.patterns.of(cause.owner_kind, cause.owner, cause.kind, cause.where, cause.start or 0)
        return np.asarray(cause.size * unit[:, None])

    def _rivals(self, cause: Cause, kinds: dict[str, str]) -> tuple[tuple[str, str, str], ...]:
        """Owners of other kinds in the recordings in which the cause acts, most frequent first."""
        fleet = self.fleet
        acts = fleet.owned(cause.owner_kind, cause.owner) & (fleet.day_of >= (cause.start or 0))
        rivals = []
        for owner_kind, kind in kinds.items():
            if owner_kind != cause.owner_kind and (owner_kind, cause.owner_kind) != ("machine", "type"):
                found, count = np.unique(fleet.names_of[owner_kind][acts], return_counts=True)
                rivals += [(int(-n), (owner_kind, str(name), kind)) for name, n in zip(found, count, strict=True)]
        return tuple(rival for _, rival in sorted(rivals))

    def _least(
        self,
        observer: Observer,
        cause: Cause,
        pattern: Array,
        rivals: tuple[tuple[str, str, str], ...],
        terms: dict[str, Terms],
    ) -> float:
        """What the best of the most frequent rivals leaves of a pattern."""
        left = [observer.leftover(pattern, self._terms(*rival[:2], cause, terms)) for rival in rivals[:RIVALS_TRIED]]
        return min(left, default=0.0)

    def _terms(self, owner_kind: str, owner: str, cause: Cause, terms: dict[str, Terms]) -> Array:
        """All that another owner may have, always or since the cause began; a hall has any value on each day."""
        if owner_kind == "hall":
            acts = self.fleet.owned(cause.owner_kind, cause.owner) & (self.fleet.hall_of == owner)
            return self.patterns.days(owner, np.unique(self.fleet.day_of[acts]))
        since = (0, cause.start) if cause.start else (0,)
        columns = [self.patterns.of(owner_kind, owner, *term, day) for term in terms[owner_kind] for day in since]
        return np.stack(columns, axis=1)

    def _kind_is_seen(self, observer: Observer, cause: Cause, pattern: Array, terms: dict[str, Terms]) -> bool:
        """Whether its own owner's other kinds leave enough of it, so that the word for it can be right."""
        others = tuple(t for t in terms.get(cause.owner_kind, ()) if t != (cause.kind, cause.where))
        if not others:
            return True
        own = self._terms(cause.owner_kind, cause.owner, cause, {cause.owner_kind: others})
        return observer.leftover(pattern, own) >= ENOUGH_CHI2


def plant(fleet: Fleet, seed: int, strength: float) -> list[Cause]:
    """Causes of a fleet at a strength; who has which does not depend on the strength."""
    return [scaled(cause, strength) for cause in Planter(fleet, seed).plant()]


def scaled(cause: Cause, strength: float) -> Cause:
    """The same cause at another strength."""
    details = dict(cause.details)
    for key in ("of_machine", "kelvin_of_day"):
        if key in details:
            details[key] = {owner: value * strength for owner, value in details[key].items()}
    left = None if cause.leftover_chi2 is None else round(cause.leftover_chi2 * strength**2, 1)
    return replace(cause, size=cause.size * strength, details=details, leftover_chi2=left)
