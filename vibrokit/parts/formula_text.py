"""Reading the text of a formula: limits, names and tokens, before there is any syntax tree.

What `check_text` lets pass is short and is arithmetic in allowed names and functions; nothing else reaches
`ast.parse`.
"""

from __future__ import annotations

import difflib
import keyword
import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NoReturn

from vibrokit.errors import VibrokitError

LONGEST_TEXT = 2000
LONGEST_NAME = 60
DEEPEST = 50
MOST_NODES = 500
MOST_PARAMETERS = 100
MOST_DIGITS = 15
MOST_COMPARED = 24  # SymPy compares all arguments of min and max in pairs

# What each function does to constants; SymPy's functions of the same names make the expression.
FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "sqrt": math.sqrt, "exp": math.exp, "log": math.log,
    "sin": math.sin, "cos": math.cos, "tan": math.tan, "asin": math.asin, "acos": math.acos,
    "atan": math.atan, "sinh": math.sinh, "cosh": math.cosh, "tanh": math.tanh,
    "abs": abs, "sign": lambda x: float((x > 0) - (x < 0)), "min": min, "max": max,
}  # fmt: skip
SEVERAL_ARGUMENTS = ("min", "max")

_TOKEN = re.compile(  # with possessive quantifiers: no time is lost on trying again
    r" *+(?:(?P<number>(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][+-]?\d++)?(?![\w.]))"
    r"|(?P<name>[A-Za-z_]\w*+)(?P<call> *+\()?|(?P<symbol>\*\*|[-+*/(),])|(?P<end>\Z))",
    re.ASCII,
)
_NUMBER_LIKE = re.compile(r" *([\d.][\w.]*)", re.ASCII)
_OPERAND = "a number, a name, a function, a sign or ("
_HINTS = {
    "^": "write ** for a power",
    ".": "a dot belongs inside a number, and formulas have no attributes",
    "'": "formulas hold no text", '"': "formulas hold no text",
    "[": "formulas have no lists and no subscripts", "{": "formulas have no braces; group with ( and )",
    "=": "formulas have no assignments, comparisons or named arguments",
    ":": "formulas have no assignments and no lambda",
    "<": "formulas have no comparisons; min, max, abs and sign may do",
}  # fmt: skip
_HINTS |= {"]": _HINTS["["], "}": _HINTS["{"], ">": _HINTS["<"], "!": _HINTS["<"]}
_ALIASES = {"ln": "log", "arcsin": "asin", "arccos": "acos", "arctan": "atan", "fabs": "abs", "sgn": "sign"}


class FormulaError(VibrokitError, ValueError):
    """A formula, or the name of a parameter in it, that is not allowed."""


def check_parameter_name(name: str, variables: Sequence[str] = ()) -> None:
    """Raise FormulaError unless a formula in `variables` may have a parameter called `name`."""
    if not isinstance(name, str):
        raise FormulaError(f"A parameter of a formula is named by {_shown(name)}; its name must be text.")
    if len(name) > LONGEST_NAME:
        problem = f"has {len(name)} characters; at most {LONGEST_NAME} are allowed"
    elif not (name.isascii() and name.isidentifier()):
        problem = "is no name; a name is a letter a-z or A-Z, followed by letters, digits and underscores"
    elif name.startswith("_"):
        problem = "starts with an underscore; start it with a letter"
    elif name in variables:
        problem = f"is already a variable of the formula ({_listed(variables)}); choose another name"
    elif name in FUNCTIONS:
        problem = "is the name of a function; choose another name"
    elif name == "pi" or name.lower() in ("nan", "inf"):
        problem = "is kept for the number of that name; choose another name"
    elif keyword.iskeyword(name):
        problem = "is a word of the Python language; choose another name"
    else:
        return
    raise FormulaError(f"The parameter name {_shortened(name, 1)} {problem}.")


def check_parameter_names(names: Sequence[str], variables: Sequence[str]) -> None:
    """Raise FormulaError unless a formula in `variables` may have all these parameters."""
    if len(names) > MOST_PARAMETERS:
        raise FormulaError(f"The formula has {len(names)} parameters; at most {MOST_PARAMETERS} are allowed.")
    for name in names:
        check_parameter_name(name, variables)


def refusal(text: str, column: int, problem: str) -> FormulaError:
    """Return the error that says what is wrong with `text` at `column`, counted from 1."""
    return FormulaError(f"The formula {_shortened(text, column)} is refused at column {column}: {problem}.")


def _shortened(text: str, column: int) -> str:
    start = max(0, min(column - 30, len(text) - 60))
    part = text[start : start + 60]
    return f"{'...' * (start > 0)}{part!r}{'...' * (start + 60 < len(text))}"


def _shown(value: object) -> str:
    short = value is None or isinstance(value, float) or (isinstance(value, int) and value.bit_length() < 64)
    kind = type(value).__name__
    return f"{value!r}, of type {kind}" if short else f"an object of type {kind}"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:20]) + (f" and {len(names) - 20} more" if len(names) > 20 else "")


def _nearest(name: str, known: Sequence[str]) -> str:
    near = difflib.get_close_matches(_ALIASES.get(name, name[:LONGEST_NAME]), known, 1, 0.5)
    return f"; the nearest is {near[0]}" if near else ""


def check_text(text: object, known: Sequence[str]) -> tuple[str, ...]:
    """Check that `text` is arithmetic in `known` names and the functions; return the names that it uses."""
    return _Scan(_checked_characters(text), tuple(known)).run()


def _checked_characters(text: object) -> str:
    if not isinstance(text, str):
        raise FormulaError(f'The formula is {_shown(text)}; it must be text, such as "k*depth**1.5".')
    if len(text) > LONGEST_TEXT:
        raise FormulaError(f"The formula has {len(text)} characters; at most {LONGEST_TEXT} are allowed.")
    if not text.strip(" "):
        raise FormulaError('The formula is empty; write one, such as "k*depth**1.5".')
    if strange := re.search("[^ -~]", text):
        character = strange.group()
        problem = f"{character!r} (U+{ord(character):04X}) is no printable ASCII character"
        raise refusal(text, strange.start() + 1, f"{problem}; only these are allowed")
    return text


class _Scan:
    """One pass over the tokens of a text; if `run` returns, it is arithmetic in known names and functions."""

    def __init__(self, text: str, known: tuple[str, ...]) -> None:
        self.text = text
        self.known = known
        self.column = 1
        self.nodes = 0
        self.compared = 0
        self.wants_operand = True
        self.open: list[list[Any]] = []  # column, function or None, and number of commas
        self.names: dict[str, None] = {}

    def run(self) -> tuple[str, ...]:
        """Check all tokens and return the names used."""
        position = 0
        while True:
            token = _TOKEN.match(self.text, position)
            if token is None:
                self._strange_character(position)
            position = token.end()
            kind = "name" if token["name"] else str(token.lastgroup)
            self.column = token.start(kind) + 1
            if kind == "end":
                self._end()
                return tuple(self.names)
            if kind == "symbol":
                self._symbol(token[kind])
            else:
                self._operand(kind, token[kind], token["call"] is not None)
            if self.nodes > MOST_NODES:
                self._refuse(f"by here it has more than {MOST_NODES} numbers, names, calls and operations")

    def _refuse(self, problem: str) -> NoReturn:
        raise refusal(self.text, self.column, problem)

    def _operand(self, kind: str, word: str, called: bool) -> None:
        if keyword.iskeyword(word):
            self._refuse(f"{word!r} is a word of the Python language, which has no meaning in a formula")
        if not self.wants_operand:
            self._refuse(f"{word!r} follows an operand; write an operation between them, * for a product")
        self.nodes += 2 if called else 1
        if kind == "number":
            self._number(word)
        elif called:
            self._function(word)
        else:
            self._name(word)
        self.wants_operand = called

    def _number(self, word: str) -> None:
        if word.isdigit():
            if len(word) > MOST_DIGITS:
                self._refuse(f"a whole number has {len(word)} digits; at most {MOST_DIGITS} are allowed")
            if len(word) > 1 and word[0] == "0":
                self._refuse(f"the whole number {word!r} starts with 0; write {int(word)}")
        elif not math.isfinite(float(word)):
            self._refuse(f"the number {_shortened(word, 1)} is too large; numbers must be below 1.8e308")
        elif float(word) == 0 and re.search("[1-9]", re.split("[eE]", word)[0]):
            self._refuse(f"the number {_shortened(word, 1)} is too small; allowed are 0 and 5e-324 upwards")

    def _name(self, word: str) -> None:
        if word in self.known:
            self.names[word] = None
        elif word in FUNCTIONS:
            self._refuse(f"{word} is a function; write {word}(...)")
        elif word != "pi":
            self._unknown(word, "name", ("pi", *self.known))

    def _function(self, word: str) -> None:
        if word == "pi" or word in self.known:
            self._refuse(f"{word} is no function; write * for a product, {word}*(...)")
        if word not in FUNCTIONS:
            self._unknown(word, "function", tuple(FUNCTIONS))
        self._open(word)

    def _unknown(self, word: str, kind: str, allowed: tuple[str, ...]) -> NoReturn:
        hint = ""
        if word.lower() in ("nan", "inf", "infinity"):
            hint = "; numbers must be finite"
        elif word.startswith("_"):
            hint = "; names that start with an underscore are never allowed"
        elif word == "pow":
            hint = "; write ** for a power"
        hint = hint or _nearest(word, allowed)
        problem = f"the {kind} {_shortened(word, 1)} is unknown; {kind}s allowed are {_listed(allowed)}{hint}"
        self._refuse(problem)

    def _open(self, function: str | None) -> None:
        self.open.append([self.column, function, 0])
        if len(self.open) > DEEPEST:
            self._refuse(f"{len(self.open)} parentheses are open here; at most {DEEPEST} are allowed")

    def _symbol(self, symbol: str) -> None:
        if self.wants_operand and symbol not in ("(", "+", "-"):
            if symbol == "/" and self.text[: self.column - 1].endswith("/"):
                self._refuse("'//' has no meaning in a formula; write / for a quotient")
            self._refuse(f"{symbol!r} stands where {_OPERAND} must stand")
        if symbol == "(":
            if not self.wants_operand:
                self._refuse("'(' follows an operand; write an operation between them, * for a product")
            self._open(None)
        elif symbol == ")":
            self._close()
        elif symbol == ",":
            if not self.open or self.open[-1][1] is None:
                self._refuse("',' stands outside a function; it separates only the arguments of min and max")
            self.open[-1][2] += 1
            self.wants_operand = True
        else:
            self.nodes += 1
            self.wants_operand = True

    def _close(self) -> None:
        if not self.open:
            self._refuse("')' closes a parenthesis that was never opened; remove it or add (")
        self.column, function, commas = self.open.pop()
        several = function in SEVERAL_ARGUMENTS
        self.compared += commas + 1 if several else 0
        if self.compared > MOST_COMPARED:
            found = f"min and max have {self.compared} arguments in all"
            self._refuse(f"{found}; at most {MOST_COMPARED} are allowed")
        if function and (commas > 0) != several:
            found = f"{commas + 1} argument{'s' * (commas > 0)}"
            allowed = "2 or more" if several else "only 1"
            self._refuse(f"the function {function} has {found}; allowed is {allowed}")

    def _end(self) -> None:
        if self.wants_operand:
            self._refuse(f"it ends where {_OPERAND} must stand")
        if self.open:
            self.column = self.open[-1][0]
            self._refuse("a parenthesis is opened here and never closed; add )")

    def _strange_character(self, position: int) -> NoReturn:
        if number := _NUMBER_LIKE.match(self.text, position):
            self.column = number.start(1) + 1
            word = number.group(1)
            if word[0] != "." or word[1:2].isdigit():
                hint = ""
                if word[-1] in "jJ":
                    hint = "; formulas have no complex numbers"
                elif word.lstrip("0123456789.") in (*self.known, *FUNCTIONS):
                    hint = "; write * for a product"
                self._refuse(f"{_shortened(word, 1)} is no number; numbers look like 12, 0.5 or 1e-3{hint}")
        position += len(self.text[position:]) - len(self.text[position:].lstrip(" "))
        self.column = position + 1
        character = self.text[position]
        hint = _HINTS.get(character, "allowed are names, numbers, + - * / ** ( ) and commas")
        self._refuse(f"{character!r} has no meaning in a formula; {hint}")
