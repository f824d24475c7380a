"""What a machine's certificate says of its errors, read back into numbers by face."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.dcc.read import ERROR, Document, Quantity
from stepgauge.dcc.units import LENGTH, NUMBER
from stepgauge.dcc.write import ERRORS, FACE
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array


@dataclass(frozen=True)
class ErrorList:
    """One kind of error (``xf``, ``xb``, ``xm``, ``xr``) of one placement; arrays have one entry per face."""

    name: str
    face: NDArray[np.int64]
    position_mm: Array
    value_um: Array
    expanded_um: Array
    k: Array
    group: str


@dataclass(frozen=True)
class Radius:
    """The effective radius of one placement, mm."""

    r_eff_mm: float
    expanded_mm: float
    k: float


def read_errors(document: Document) -> tuple[list[Radius], list[ErrorList]]:
    """Radii and lists of errors in the order of the certificate.

    :class:`InputError` where the certificate has none (it is of something else), or with a wrong unit.
    """
    radii = [_radius(one) for one in document.select_kind("stepgauge_effectiveRadius")]
    lists = []
    for name, (_, kind) in ERRORS.items():
        lists += [_list(document, name, one) for one in document.select_kind(kind)]
    if not radii and not lists:
        raise InputError(document.path, "not a certificate of a machine measured with a step gauge", expected=FACE)
    return radii, lists


def _radius(one: Quantity) -> Radius:
    value, expanded = one.scaled(LENGTH, 1e-3), one.expanded_scaled(LENGTH, 1e-3)
    assert one.k is not None
    return Radius(float(value[0]), float(expanded[0]), float(one.k[0]))


def _list(document: Document, name: str, one: Quantity) -> ErrorList:
    face, position = (_list_beside(document, one, kind) for kind in (FACE, "stepgauge_position"))
    if ERROR not in one.kinds:
        raise InputError(one.where, f"{one.name} is not marked as a result", expected=f"refType {ERROR}")
    value, expanded = one.scaled(LENGTH, 1e-6), one.expanded_scaled(LENGTH, 1e-6)
    assert one.k is not None
    faces = face.scaled(NUMBER, 1.0).astype(int)
    return ErrorList(name, faces, position.scaled(LENGTH, 1e-3), value, expanded, one.k, one.group)


def _list_beside(document: Document, one: Quantity, kind: str) -> Quantity:
    """The list of the same table that says where the values belong."""
    found = [other for other in document.select_kind(kind) if other.group == one.group]
    if len(found) != 1 or len(found[0].values) != len(one.values):
        size = len(found[0].values) if len(found) == 1 else 0
        expected = f"a list {kind} of {len(one.values)} values beside it"
        raise InputError(
            one.where, f"{one.name} cannot be assigned to faces", found=f"{size} values", expected=expected
        )
    return found[0]
