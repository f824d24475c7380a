"""Formulas in a machine file, evaluated safely: parsed to a tree, every node looked up in a list, nothing executed.

Only numbers, names, + - * / ** %, comparisons, parentheses and the functions of ``FUNCTIONS`` are understood.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.files.notation import counted

Values = Mapping[str, Array]
Node = Callable[[Values], Array]
MAX_LENGTH = 1000
"""Longest formula, characters; what is longer belongs into a class of its own."""
MAX_DEPTH = 50

FUNCTIONS: dict[str, tuple[Callable[..., Array], int]] = {
    "sin": (np.sin, 1),
    "cos": (np.cos, 1),
    "tan": (np.tan, 1),
    "tanh": (np.tanh, 1),
    "atan2": (np.arctan2, 2),
    "exp": (np.exp, 1),
    "log": (np.log, 1),
    "sqrt": (np.sqrt, 1),
    "abs": (np.abs, 1),
    "sign": (np.sign, 1),
    "floor": (np.floor, 1),
    "min": (np.minimum, 2),
    "max": (np.maximum, 2),
    "step": (lambda x: np.heaviside(x, 1.0), 1),
}
CONSTANTS = {"pi": np.pi}
_BINARY: dict[type[ast.operator], Callable[[Array, Array], Array]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.Mod: operator.mod,
}
_COMPARE: dict[type[ast.cmpop], Callable[[Array, Array], Array]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}


@dataclass(frozen=True)
class Formula:
    """A parsed formula; call it with the values of its ``names``."""

    text: str
    names: frozenset[str]
    _tree: Node

    def __call__(self, values: Values) -> Array:
        """The value, by numpy's rules; comparisons give 1 and 0. Not finite where the formula is undefined."""
        with np.errstate(all="ignore"):
            return np.asarray(self._tree(values), dtype=float)


def parse_formula(text: str) -> Formula:
    """Parse a formula; ``ValueError`` says what in it is not understood."""
    if len(text) > MAX_LENGTH:
        raise ValueError(f"a formula of at most {MAX_LENGTH} characters, not {len(text)}")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, RecursionError, MemoryError):
        raise ValueError(f"a formula such as a + b * log(speed_mm_s), not {text!r}") from None
    names: set[str] = set()
    built = _build(tree.body, names, 0)
    return Formula(text, frozenset(names), built)


def _build(node: ast.expr, names: set[str], depth: int) -> Node:
    if depth > MAX_DEPTH:
        raise ValueError(f"a formula nested at most {MAX_DEPTH} deep")
    match node:
        case ast.Constant(value=value):
            return _number(value)
        case ast.Name(id=name):
            return _name(name, names)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
            return _apply(_BINARY[type(op)], [left, right], names, depth)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return _apply(operator.neg, [operand], names, depth)
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _build(operand, names, depth + 1)
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _COMPARE:
            compare = _COMPARE[type(op)]
            return _apply(lambda a, b: np.asarray(compare(a, b), dtype=float), [left, right], names, depth)
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
            return _call(name, arguments, names, depth)
    raise ValueError(f"numbers, names, + - * / ** %, < > and functions only, not {ast.unparse(node)!r}")


def _number(value: object) -> Node:
    if isinstance(value, bool) or not isinstance(value, int | float) or abs(value) > 1e300:
        raise ValueError(f"ordinary numbers only, not {value!r}"[:120])
    number = np.float64(value)  # not a Python int: 9 ** 9 ** 9 overflows instead of filling the memory
    return lambda values: number  # type: ignore[return-value]


def _name(name: str, names: set[str]) -> Node:
    if name in CONSTANTS:
        constant = np.float64(CONSTANTS[name])
        return lambda values: constant  # type: ignore[return-value]
    names.add(name)
    return lambda values: values[name]


def _apply(function: Callable[..., Array], operands: list[ast.expr], names: set[str], depth: int) -> Node:
    built = [_build(operand, names, depth + 1) for operand in operands]
    if len(built) == 1:
        only = built[0]
        return lambda values: function(only(values))
    left, right = built
    return lambda values: function(left(values), right(values))


def _call(name: str, arguments: list[ast.expr], names: set[str], depth: int) -> Node:
    if name not in FUNCTIONS:
        raise ValueError(f"functions among {', '.join(FUNCTIONS)}, not {name!r}")
    function, count = FUNCTIONS[name]
    if len(arguments) != count:
        raise ValueError(f"{counted(count, 'argument')} of {name}, not {len(arguments)}")
    return _apply(function, arguments, names, depth)
