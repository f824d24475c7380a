"""Arithmetic as controls write it: one precedence climber, and what a control calls its operators and variables."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

Value = float | str
DEEPEST = 20
"""Brackets within each other; controls take five."""
_POWER = {
    "or": 1,
    "and": 2,
    **dict.fromkeys(("==", "!=", "<", "<=", ">", ">="), 3),
    "<<": 4,
    **dict.fromkeys("+-", 5),
    **dict.fromkeys("*/", 6),
}
_BINARY: Mapping[str, Callable[..., Value]] = {
    "or": lambda a, b: float(bool(a) or bool(b)),
    "and": lambda a, b: float(bool(a) and bool(b)),
    "==": lambda a, b: float(a == b),
    "!=": lambda a, b: float(a != b),
    "<": lambda a, b: float(a < b),
    "<=": lambda a, b: float(a <= b),
    ">": lambda a, b: float(a > b),
    ">=": lambda a, b: float(a >= b),
    "<<": lambda a, b: f"{number_words(a)}{number_words(b)}",
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
}
_FUNCTIONS: Mapping[str, Callable[[float], float]] = {
    "ABS": abs,
    "SQRT": math.sqrt,
    "ROUND": lambda value: math.floor(value + 0.5),
}


def number_words(value: Value) -> str:
    """A number as controls join it to a text: up to 6 decimals, no zeros at the end."""
    return value if isinstance(value, str) else f"{value + 0.0:.6f}".rstrip("0").rstrip(".")


@dataclass(frozen=True)
class Grammar:
    """How a control writes expressions.

    ``variable``: pattern of what is looked up; ``operators``: its words for the operators of this module, longest
    first; ``brackets``: the pair that groups.
    """

    variable: str
    operators: Mapping[str, str] = field(default_factory=dict)
    brackets: str = "()"

    @cached_property
    def words(self) -> dict[str, str]:
        """All operators of the text, and what they mean here."""
        return {**{word: word for word in _POWER}, **self.operators}

    @cached_property
    def tokens(self) -> re.Pattern[str]:
        """What the text is cut into."""
        operators = "|".join(map(re.escape, sorted(self.words, key=len, reverse=True)))
        names = "|".join(_FUNCTIONS)
        return re.compile(
            rf'\s*(?:(?P<text>"[^"]*")|(?P<variable>{self.variable})|(?P<number>\d+\.?\d*|\.\d+)'
            rf"|(?P<function>(?:{names})(?=\s*{re.escape(self.brackets[0])}))|(?P<sign>{operators}|[#{re.escape(self.brackets)}]))",
            re.ASCII | re.IGNORECASE,
        )


class ExpressionError(ValueError):
    """What is not understood in an expression."""


class _Parser:
    def __init__(self, text: str, grammar: Grammar, lookup: Callable[[str], Value]) -> None:
        self.grammar, self.lookup = grammar, lookup
        self.tokens, at = [], 0
        while at < len(text.rstrip()):
            match = grammar.tokens.match(text, at)
            if match is None:
                raise ExpressionError(text[at:].strip())
            self.tokens.append((str(match.lastgroup), match[str(match.lastgroup)]))
            at = match.end()
        self.at = self.depth = 0

    def peek(self) -> tuple[str, str]:
        return self.tokens[self.at] if self.at < len(self.tokens) else ("end", "")

    def take(self, wanted: str = "") -> tuple[str, str]:
        """The next token, which must be ``wanted`` if that is given."""
        kind, word = self.peek()
        if kind == "end" or (wanted and word != wanted):
            raise ExpressionError(word or "the expression ends here")
        self.at += 1
        return kind, word

    def expression(self, least: int = 0) -> Value:
        """Operands and the operators between them that bind closer than ``least``, from the left."""
        value = self.operand()
        while True:
            kind, word = self.peek()
            sign = self.grammar.words.get(word.upper(), word) if kind == "sign" else ""
            if _POWER.get(sign, -1) <= least:
                return value
            self.take()
            right = self.expression(_POWER[sign])
            if sign != "<<" and isinstance(value, str) != isinstance(right, str):
                raise ExpressionError(f"{word} of a text and a number")
            value = _BINARY[sign](value, right)

    def operand(self) -> Value:
        """A number, a text, a variable, a function, or an expression in brackets, with its sign."""
        kind, word = self.take()
        if kind == "number":
            return float(word)
        if kind == "text":
            return word[1:-1]
        if kind == "variable":
            return self.lookup(word)
        if kind == "function":
            return _FUNCTIONS[word.upper()](self.number())
        if word in "+-":
            return self.number() * (-1.0 if word == "-" else 1.0)
        if word == "#":
            return self.lookup(f"#{self.number():.0f}")
        if word == "<<":  # the text of what follows
            return number_words(self.operand())
        if word == self.grammar.brackets[0] and self.depth < DEEPEST:
            self.depth += 1
            value = self.expression()
            self.take(self.grammar.brackets[1])
            self.depth -= 1
            return value
        raise ExpressionError(word)

    def number(self) -> float:
        value = self.operand()
        if isinstance(value, str):
            raise ExpressionError(repr(value))
        return value


def check_words(text: str, grammar: Grammar) -> None:
    """:class:`ExpressionError` for a word that the grammar does not have, or brackets that do not close."""
    words = [word for kind, word in _Parser(text, grammar, lambda name: name).tokens if kind != "text"]
    opening, closing = (words.count(one) for one in grammar.brackets)
    if opening != closing:
        raise ExpressionError("brackets that do not close")


def evaluate(text: str, grammar: Grammar, lookup: Callable[[str], Value]) -> Value:
    """The value of an expression; ``lookup`` gives the values of variables.

    :class:`ExpressionError` names what is not understood, or has no value.
    """
    parser = _Parser(text, grammar, lookup)
    try:
        value = parser.expression()
    except (ArithmeticError, TypeError, RecursionError) as error:
        raise ExpressionError(str(error)) from None
    if parser.at < len(parser.tokens):
        raise ExpressionError(parser.peek()[1])
    return value
