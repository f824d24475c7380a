"""Rules of the score: pure functions of one truth and one ``diagnosis.json``. The README states them in words."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from benchmarks.blind.identify import NEAR_CHI2
from benchmarks.blind.scatter import CORRELATED
from benchmarks.blind.spelling import alternatives_of, axis_of, covariate, is_number, key_of, kinds_of, value_of

SAME_CHI2 = 1.0
"""A name that leaves less than this of the concealed effect cannot be told from the true one by anybody."""
STRANGE_SHARE = 0.5
"""A cause of which the vocabulary's own form leaves this share has another form, however little there is to see."""
UNUSUAL_SHARE = 0.2
"""An axis along which the approaches go by less than this share of the true axis' must be off five times more."""
DECIDABLE_CHI2 = 9.0
"""An outsider of which the best known name leaves less than this is not scored."""
SURE = 0.9
"""A wrong name that is told with more than this is counted apart."""
NO_ANSWER: dict[str, Any] = {
    "right": False,
    "honest": False,
    "false_alarm": False,
    "wrong_and_sure": 0,
    "good_rows_condemned": 0,
    "answer": "no answer",
    "found": False,
    "intervals": [],
    "scored": True,
}
Z95 = 1.959964
FAR_FETCHED = {"angular_error", "misalignment", "tip_change", "servo_lag", "error_motion"}
"""Never demanded as company of the true kind: a constant arm, a line mrad off, a stylus exchanged by nobody knows whom,
a lag with no part in proportion to the speed, a cubic without line and parabola."""
FLEXIBLE = {
    "periodic_scale_error",
    "local_scale_defect",
    "temperature_cycle",
    "vibration",
    "thermal_drift",
    "approach_memory",
    "gauge_bending",
    "kinematic_pretravel",
    "seat_defect",
    "scale_joint",
    "reversal_wear",
    "stick_slip",
    "scale_warm_up",
    "gauge_soaking",
    "thermal_shift",
    "thermal_expansion_of",
    "thermal_bending",
}
"""Kinds with a free shape (a place, a width, a lag, a phase) that can mimic a plain one; never demanded either."""
IN_ORDER = {"order", "time", "cycle", "pause"}
"""Covariates in which a scatter that is correlated from touch to touch lives."""
UNSIGNED = {("angular_error", "urad_per_m"), ("block_defect", "um")}
"""Parameters whose sign DESIGN does not fix."""
SYNONYM = {"roll": "angular_error", "lever_arm": "effective_radius"}
"""Kinds that are judged as another: same displacement along the approach in every recording made here."""
GEOMETRY = {"scale_error", "scale_curvature", "squareness", "straightness", "angular_error", "error_motion"}
"""Kinds that are part of all geometric errors at once, which leave no more than one of them; as companions, not as the
name."""
PHASE_DEG = 10.0
"""A tripod's arm is found where its azimuth is right to this."""
VALUED = {"arm_azimuth_deg", "lag_s"}
"""Parameters that belong to the name: a tripod is to be found with its phase, a law of temperature with its lag."""


def _kind_chi2(cause: Mapping[str, Any], kind: str) -> float:
    kind = SYNONYM.get(kind, kind)
    kinds = {kind, *GEOMETRY} if kind == "geometric_errors" else {kind}
    left = cause["leftover_chi2"]
    return min((chi2 for key, chi2 in left.items() if key.partition(":")[0] in kinds), default=math.inf)


def _chi2_of(cause: Mapping[str, Any], kinds: tuple[str, ...]) -> float:
    """What a kind leaves of a cause, or several laws in one model."""
    kinds = _plain(kinds)
    alone = min(_kind_chi2(cause, kind) for kind in kinds)
    known: float = cause.get("combined_chi2", {}).get(" + ".join(kinds), math.inf)
    return min(alone, known)


def combinations_of(effects: Iterable[Mapping[str, Any]]) -> set[tuple[str, ...]]:
    """Combinations of laws that effects are said to be confounded with: their kinds, two of one kind as two."""
    every = (_plain(one) for effect in effects for one in alternatives_of(effect))
    return {one for one in every if len(one) > 1}


def _plain(kinds: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(sorted(SYNONYM.get(kind, kind) for kind in kinds))


def rivals(cause: Mapping[str, Any]) -> set[str]:
    """Kinds that nobody can tell from the true one in this recording, and that an honest answer mentions."""
    kinds = {key.partition(":")[0] for key, chi2 in cause["leftover_chi2"].items() if chi2 < SAME_CHI2}
    return kinds - {cause["kind"]} - FAR_FETCHED - FLEXIBLE


def explains(effect: Mapping[str, Any], cause: Mapping[str, Any], whole_set: Iterable[str] = ()) -> bool:
    """Whether this diagnosed effect is the right name (or the right set) for this concealed cause."""
    named, kinds = key_of(effect), kinds_of(effect)
    true_kind = cause["kind"]
    if true_kind not in kinds or not set(whole_set) <= kinds:
        return False
    others = alternatives_of(effect) | {(str(effect.get("kind")),)}
    if any(_chi2_of(cause, other) >= NEAR_CHI2 for other in others - {(true_kind,)}):
        return False
    if rivals(cause) and kinds == {true_kind}:
        return False
    return is_name_of(named, cause)


def true_key(cause: Mapping[str, Any]) -> str:
    """``kind`` or ``kind:where`` of a concealed cause."""
    return f"{cause['kind']}:{cause['where']}" if cause["where"] else str(cause["kind"])


def is_name_of(named: str, cause: Mapping[str, Any]) -> bool:
    """Whether this key is the cause, or fits it here with a displacement that is not out of all measure."""
    if named == true_key(cause) or (cause["kind"] == "straightness" and named == "straightness"):
        return True
    if cause["kind"] == "thermal_drift" and named == "thermal_drift:late":  # from the beginning on is a time too
        return True
    whole = "thermal_drift" if named == "thermal_drift:late" else named  # what begins at any time may do so at once
    left = (
        _kind_chi2(cause, whole) if named != whole or named in SYNONYM else cause["leftover_chi2"].get(named, math.inf)
    )
    return bool(left < NEAR_CHI2 and not _is_unusual(named, cause))


def _is_unusual(named: str, cause: Mapping[str, Any]) -> bool:
    """Whether the axis named is one along which the approaches hardly go, so that it would have to be far off."""
    shares = cause.get("axis_share") or {}
    axis, true_axis = axis_of(named), axis_of(true_key(cause))
    if axis not in shares:
        return False
    true_share = shares[true_axis] if true_axis in shares else max(shares.values())
    return bool(shares[axis] < UNUSUAL_SHARE * true_share)


def assign(
    effects: list[Mapping[str, Any]], causes: list[Mapping[str, Any]], whole_set: Iterable[str] = ()
) -> list[int] | None:
    """For every cause the index of its own effect; ``None`` where some cause has none."""
    owner: dict[int, int] = {}
    fits = [[k for k, effect in enumerate(effects) if explains(effect, cause, whole_set)] for cause in causes]
    if not all(_has_own(cause, fits, owner, set()) for cause in range(len(causes))):
        return None
    own = {cause: k for k, cause in owner.items()}
    return [own[cause] for cause in range(len(causes))]


def _has_own(cause: int, fits: list[list[int]], owner: dict[int, int], tried: set[int]) -> bool:
    """Whether a cause gets an effect of its own, if need be one whose owner takes another (Kuhn 1955)."""
    for k in fits[cause]:
        if k not in tried:
            tried.add(k)
            if k not in owner or _has_own(owner[k], fits, owner, tried):
                owner[k] = cause
                return True
    return False


def effects_of(diagnosis: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The effects that are listed."""
    return [effect for effect in diagnosis.get("effects") or [] if isinstance(effect, Mapping)]


def score_case(truth: Mapping[str, Any], diagnosis: Mapping[str, Any] | None) -> dict[str, Any]:
    """``right``, ``false_alarm``, ``answer`` in a word, the held-out ratio, and hits of the 95 % intervals."""
    base = {key: truth.get(key) for key in ("case", "family", "name", "size", "seed", "rows", "bound")}
    if not isinstance(diagnosis, Mapping) or not isinstance(diagnosis.get("verdict"), str):
        return {**base, **NO_ANSWER}
    effects = effects_of(diagnosis)
    chosen = assign(effects, truth["causes"], truth["whole_set"])
    right = _RULES[truth["family"]](truth, diagnosis, effects, chosen)
    right = right and not {effect.get("kind") for effect in effects} & set(truth.get("not_named", ()))
    matched = [] if chosen is None else list(zip([effects[k] for k in chosen], truth["causes"], strict=True))
    return {
        **base,
        "right": right,
        "honest": right or is_honest(truth, diagnosis, effects),
        "false_alarm": not truth["causes"] and not right and (bool(effects) or diagnosis["verdict"] != "insufficient"),
        "wrong_and_sure": sum(is_wrong_and_sure(truth, effect) for effect in effects),
        "good_rows_condemned": len(condemned(effects) - concealed_rows(truth)),
        "answer": _answer(diagnosis, effects),
        "found": right and all(_values_found(effect, cause) for effect, cause in matched),
        "intervals": [hit for effect, cause in matched for hit in interval_hits(effect, cause)] if right else [],
        "beside_a_set": any(len(kinds_of(effect)) > 1 for effect, _ in matched),
        "holdout_ratio": _holdout_ratio(truth, diagnosis) if right and matched else None,
        "scored": _is_scored(truth),
    }


def is_honest(truth: Mapping[str, Any], diagnosis: Mapping[str, Any], effects: list[Mapping[str, Any]]) -> bool:
    """Whether an answer that is not right admits it: each cause is named or located, and nothing else is named.

    Of a recording with nothing in it, that it cannot tell.
    """
    if not truth["causes"]:
        return diagnosis["verdict"] == "insufficient" and not effects
    found = located_in(diagnosis)
    known = all(
        any(explains(effect, cause) for effect in effects) or found & set(cause.get("lives_in", truth["covariates"]))
        for cause in truth["causes"]
    )
    return diagnosis["verdict"] == "unknown" and known and all(is_true_name(truth, effect) for effect in effects)


def is_true_name(truth: Mapping[str, Any], effect: Mapping[str, Any]) -> bool:
    """Whether this effect, with its set, is one of the causes or all of them; or forgiven beside them."""
    if effect.get("kind") in truth["forgiven"] or stands_for_all(truth, effect):
        return True
    return any(explains(effect, cause, truth["whole_set"]) for cause in truth["causes"])


def stands_for_all(truth: Mapping[str, Any], effect: Mapping[str, Any]) -> bool:
    """Whether this one name fits several causes as well as they do themselves, and its set has all of them."""
    fits = truth.get("together_chi2", {}).get(key_of(effect), math.inf) < SAME_CHI2
    return bool(fits and {cause["kind"] for cause in truth["causes"]} <= kinds_of(effect))


def is_wrong_and_sure(truth: Mapping[str, Any], effect: Mapping[str, Any]) -> bool:
    """Whether something is named with a probability above 0.9 that is none of the causes, nor looks like one."""
    probability = effect.get("probability")
    if not is_number(probability) or probability <= SURE:
        return False
    return not (names_a_cause(truth, key_of(effect)) or effect.get("kind") in truth["forgiven"])


def names_a_cause(truth: Mapping[str, Any], named: str) -> bool:
    """Whether this key is one of the causes, or fits most of one, or of all of them together.

    Of a weak cause everything leaves less than ``NEAR_CHI2``; what stands alone for it must leave less than half.
    """
    if truth.get("together_chi2", {}).get(named, math.inf) < NEAR_CHI2:
        return True
    return any(is_name_of(named, cause) and _leaves_little(named, cause, truth["rows"]) for cause in truth["causes"])


def _leaves_little(named: str, cause: Mapping[str, Any], rows: int) -> bool:
    left = cause["leftover_chi2"].get(named, 0.0)
    return bool(left <= STRANGE_SHARE * cause["size"] ** 2 * rows)


def condemned(effects: Iterable[Mapping[str, Any]]) -> set[int]:
    """The rows that are called outliers, numbered from 1 over all recordings."""
    lists = [value_of(effect, "rows") or [] for effect in effects if effect.get("kind") == "outliers"]
    return {int(row) for rows in lists for row in rows if is_number(row)}


def concealed_rows(truth: Mapping[str, Any]) -> set[int]:
    """The rows that are outliers in truth."""
    return {int(row) for cause in truth["causes"] for row in cause.get("rows", [])}


def _is_scored(truth: Mapping[str, Any]) -> bool:
    if truth["family"] not in ("outsider", "left_out"):
        return True
    return all(cause["best_known"] is None or cause["best_known"][1] >= DECIDABLE_CHI2 for cause in truth["causes"])


def located_in(diagnosis: Mapping[str, Any]) -> set[str]:
    """The covariates in which the diagnosis sees something."""
    return {covariate(item.get("covariate", "")) for item in diagnosis.get("located") or []}


def _located(truth: Mapping[str, Any], diagnosis: Mapping[str, Any]) -> bool:
    return bool(located_in(diagnosis) & set(truth["covariates"]))


def _only_in_order(truth: Mapping[str, Any], diagnosis: Mapping[str, Any]) -> bool:
    """Whether all that is left open is that the scatter follows the order of the touches, as it does."""
    found = located_in(diagnosis)
    return (
        truth.get("scatter") in CORRELATED and diagnosis["verdict"] == "unknown" and bool(found) and found <= IN_ORDER
    )


def _right_names(
    truth: Mapping[str, Any],
    diagnosis: Mapping[str, Any],
    effects: list[Mapping[str, Any]],
    chosen: list[int] | None,
) -> bool:
    """Every cause named, nothing else named, and the verdict says that this is all."""
    if any(_strange_form(cause, truth["rows"]) for cause in truth["causes"]) and diagnosis["verdict"] == "unknown":
        return chosen is not None or _located(truth, diagnosis)
    if diagnosis["verdict"] == "effects" and len(effects) == 1 and stands_for_all(truth, effects[0]):
        return True
    verdicts = {"effects", "adequate"} if truth["causes"][0]["kind"] == "outliers" else {"effects"}
    if chosen is None or not (diagnosis["verdict"] in verdicts or _only_in_order(truth, diagnosis)):
        return False
    extra = [effect for k, effect in enumerate(effects) if k not in chosen]
    return all(effect.get("kind") in truth["forgiven"] for effect in extra)


def _strange_form(cause: Mapping[str, Any], rows: int) -> bool:
    """Whether the vocabulary's form of the true kind is not what is there: clearly, or for the most part."""
    return bool(cause["own_form_chi2"] > min(NEAR_CHI2, STRANGE_SHARE * cause["size"] ** 2 * rows))


def _right_unknown(
    truth: Mapping[str, Any],
    diagnosis: Mapping[str, Any],
    effects: list[Mapping[str, Any]],
    chosen: list[int] | None,
) -> bool:
    return diagnosis["verdict"] == "unknown" and _located(truth, diagnosis)


def _right_beyond(
    truth: Mapping[str, Any],
    diagnosis: Mapping[str, Any],
    effects: list[Mapping[str, Any]],
    chosen: list[int] | None,
) -> bool:
    """A mechanism that no vocabulary has: unknown and located, or the one name that leaves little enough of it."""
    if diagnosis["verdict"] == "effects" and len(effects) == 1:
        return is_name_of(key_of(effects[0]), truth["causes"][0])
    return _right_unknown(truth, diagnosis, effects, chosen)


def _right_null(
    truth: Mapping[str, Any],
    diagnosis: Mapping[str, Any],
    effects: list[Mapping[str, Any]],
    chosen: list[int] | None,
) -> bool:
    return not effects and (diagnosis["verdict"] == "adequate" or _only_in_order(truth, diagnosis))


_RULES = {
    "single": _right_names,
    "pair": _right_names,
    "triple": _right_names,
    "confounded": _right_names,
    "outsider": _right_unknown,
    "left_out": _right_unknown,
    "null": _right_null,
    "scatter-null": _right_null,
    "scatter-single": _right_names,
    "scatter-pair": _right_names,
    "way-null": _right_null,
    "way-single": _right_names,
    "way-pair": _right_names,
    "way-outside": _right_beyond,
    "probe": _right_names,
    "chain": _right_names,
    "temperature": _right_names,
    "volume": _right_names,
    "several": _right_names,
    "probe-null": _right_null,
    "chain-null": _right_null,
    "temperature-null": _right_null,
}


def interval_hits(effect: Mapping[str, Any], cause: Mapping[str, Any]) -> list[bool]:
    """Whether value +- 1.96 u holds the truth, for each parameter; nothing where the value stands for a whole set."""
    if kinds_of(effect) != {cause["kind"]}:
        return []
    hits = []
    for name, true in cause["parameters"].items():
        stated = (effect.get("parameters") or {}).get(name)
        if not isinstance(stated, Mapping) or not (is_number(stated.get("value")) and is_number(stated.get("u"))):
            continue
        value = stated["value"]
        if (cause["kind"], name) in UNSIGNED:
            value, true = abs(value), abs(true)
        if name != "face":
            hits.append(abs(off_by(cause, name, value - true)) <= Z95 * stated["u"])
    return hits


def off_by(cause: Mapping[str, Any], name: str, difference: float) -> float:
    """A difference from the truth; of an angle that repeats, the smallest one."""
    turn = (cause.get("turns") or {}).get(name)
    return difference if turn is None else (difference + turn / 2.0) % turn - turn / 2.0


def _values_found(effect: Mapping[str, Any], cause: Mapping[str, Any]) -> bool:
    """Whether the parameters that belong to the name are right: a phase to 10 deg, a lag inside its interval."""
    for name in VALUED & cause["parameters"].keys():
        stated = (effect.get("parameters") or {}).get(name)
        if effect.get("kind") != cause["kind"] or not isinstance(stated, Mapping) or not is_number(stated.get("value")):
            return False
        off = abs(off_by(cause, name, stated["value"] - cause["parameters"][name]))
        u = stated.get("u")
        if off > (PHASE_DEG if name == "arm_azimuth_deg" else Z95 * u if is_number(u) else 0.0):
            return False
    return True


def _holdout_ratio(truth: Mapping[str, Any], diagnosis: Mapping[str, Any]) -> float | None:
    after = (diagnosis.get("fit") or {}).get("holdout_rms_after_um")
    return after / truth["noise_rms_um"] if is_number(after) else None


def _answer(diagnosis: Mapping[str, Any], effects: list[Mapping[str, Any]]) -> str:
    """The answer in a word, for the confusion matrix: what is named first, else the verdict."""
    if diagnosis["verdict"] in ("effects", "adequate") and effects:
        return "+".join(sorted({str(effect.get("kind")) for effect in effects[:3]}))
    return str(diagnosis["verdict"])


def wilson_interval(hits: int, total: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson 1927), both ends 0 to 1; (0, 1) without trials."""
    if not total:
        return 0.0, 1.0
    share, z2 = hits / total, Z95**2 / total
    middle = (share + z2 / 2.0) / (1.0 + z2)
    half = Z95 / (1.0 + z2) * math.sqrt(share * (1.0 - share) / total + z2 / (4.0 * total))
    return max(middle - half, 0.0), min(middle + half, 1.0)
