"""Formulas as text: what is refused and how fast, what the rest comes to, and that nothing is ever run."""

import ast
import dataclasses
import json
import math
import pickle
import random
import re
import subprocess
import sys
import time

import pytest
import sympy

from vibrokit.errors import VibrokitError
from vibrokit.parts.formula import Formula, FormulaError, check_parameter_name, parse_formula
from vibrokit.parts.formula_text import FUNCTIONS

pytestmark = pytest.mark.filterwarnings("error")  # a SyntaxWarning would be one

VARIABLES = ("depth", "rate")
PARAMETERS = ("k", "c")
SYMBOLS = {
    "depth": sympy.Symbol("depth", positive=True),
    **{name: sympy.Symbol(name, real=True) for name in ("rate", "k", "c")},
}
depth, rate, k, c = SYMBOLS.values()


def parse(text):
    return parse_formula(text, VARIABLES, PARAMETERS)


def expression(text):
    return parse(text).expression(SYMBOLS)


def refusal_of(text):
    """Return the message that refuses `text`, and the time that it took."""
    start = time.perf_counter()
    with pytest.raises(FormulaError) as caught:
        parse(text)
    return str(caught.value), time.perf_counter() - start


def run(code, given=""):
    """Run Python code in a process of its own and return what it prints."""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, input=given, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


REFUSED = [  # text, column, and what the message says
    ("depth^2", 6, "write ** for a power"),
    ("depth.real", 6, "no attributes"),
    (".depth", 1, "no attributes"),
    ("1 .real", 3, "no attributes"),
    ("1..real", 1, "is no number"),
    ("().__class__", 2, "')' stands where"),
    ("depth[0]", 6, "no subscripts"),
    ("[depth]", 1, "no lists"),
    ("{depth}", 1, "no braces"),
    ("[i for i in depth]", 1, "no lists"),
    ("(i for i in depth)", 2, "the name 'i' is unknown"),
    ("lambda: 1", 1, "'lambda' is a word of the Python language"),
    ("lambda x: x", 1, "'lambda' is a word of the Python language"),
    ("(depth := 1)", 8, "no assignments"),
    ("depth = 1", 7, "no assignments, comparisons"),
    ("depth == 1", 7, "comparisons"),
    ("depth < 1", 7, "no comparisons"),
    ("1 < depth > 2", 3, "no comparisons"),
    ("depth != 1", 7, "no comparisons"),
    ("'depth'", 1, "no text"),
    ('"depth"', 1, "no text"),
    ("f'{depth}'", 1, "the name 'f' is unknown"),
    ("k'x'", 2, "no text"),
    ("1j", 1, "no complex numbers"),
    ("depth + 2.5J", 9, "no complex numbers"),
    ("True", 1, "'True' is a word of the Python language"),
    ("None", 1, "'None' is a word of the Python language"),
    ("not depth", 1, "'not' is a word"),
    ("depth and rate", 7, "'and' is a word"),
    ("depth if rate else k", 7, "'if' is a word"),
    ("await depth", 1, "'await' is a word"),
    ("yield", 1, "'yield' is a word"),
    ("sin(x=1)", 5, "the name 'x' is unknown"),
    ("sin(depth=1)", 10, "named arguments"),
    ("min(*depth)", 5, "'*' stands where"),
    ("min(**depth)", 5, "'**' stands where"),
    ("...", 1, "no attributes"),
    ("nan", 1, "numbers must be finite"),
    ("inf", 1, "numbers must be finite"),
    ("depth*Infinity", 7, "numbers must be finite"),
    ("1e999", 1, "'1e999' is too large"),
    ("depth + 1e-999", 9, "'1e-999' is too small"),
    ("9" * 16, 1, "16 digits; at most 15"),
    ("depth**" + "9" * 1000, 8, "1000 digits; at most 15"),
    ("0x10", 1, "'0x10' is no number"),
    ("1_000", 1, "'1_000' is no number"),
    ("1e", 1, "'1e' is no number"),
    ("1.2.3", 1, "'1.2.3' is no number"),
    ("1if depth else 2", 1, "'1if' is no number"),
    ("007", 1, "write 7"),
    ("2depth", 1, "write * for a product"),
    ("2(depth)", 2, "write an operation between them"),
    ("depth rate", 7, "write an operation between them"),
    ("(depth)(rate)", 8, "write an operation between them"),
    ("depth(2)", 1, "depth is no function"),
    ("pi(2)", 1, "pi is no function"),
    ("sin", 1, "write sin(...)"),
    ("sin*2", 1, "write sin(...)"),
    ("x", 1, "names allowed are pi, depth, rate, k, c"),
    ("dept", 1, "the nearest is depth"),
    ("k*raet", 3, "the nearest is rate"),
    ("_k", 1, "underscore"),
    ("__name__", 1, "underscore"),
    ("__import__('os').system('true')", 1, "underscore"),
    ("eval(depth)", 1, "functions allowed are sqrt, exp, log"),
    ("ln(depth)", 1, "the nearest is log"),
    ("sine(depth)", 1, "the nearest is sin"),
    ("tanhh(depth)", 1, "the nearest is tanh"),
    ("pow(depth, 2)", 1, "write ** for a power"),
    ("sin()", 5, "')' stands where"),
    ("sin(depth, rate)", 1, "sin has 2 arguments; allowed is only 1"),
    ("min(depth)", 1, "min has 1 argument; allowed is 2 or more"),
    ("max(depth,)", 11, "')' stands where"),
    ("max(" + ",".join(["depth"] * 25) + ")", 1, "25 arguments in all; at most 24"),
    ("depth, rate", 6, "',' stands outside a function"),
    ("(depth, rate)", 7, "',' stands outside a function"),
    ("sin((depth, rate))", 11, "',' stands outside a function"),
    ("depth +", 8, "ends where"),
    ("(depth", 1, "never closed"),
    ("k*sin(depth", 3, "never closed"),
    ("depth)", 6, "never opened"),
    ("depth // 2", 8, "write / for a quotient"),
    ("depth *** 2", 9, "'*' stands where"),
    ("depth % 2", 7, "'%' has no meaning"),
    ("depth @ rate", 7, "'@' has no meaning"),
    ("depth & rate", 7, "'&' has no meaning"),
    ("~depth", 1, "'~' has no meaning"),
    ("depth; rate", 6, "';' has no meaning"),
    ("depth # + 1", 7, "'#' has no meaning"),
    ("depth \\", 7, "has no meaning"),
    ("`depth`", 1, "has no meaning"),
    ("\u03b4*2", 1, "'\u03b4' (U+03B4)"),
    ("k * \u0434epth", 5, "(U+0434)"),
    ("depth\n+ 1", 6, "(U+000A)"),
    ("depth\t", 6, "(U+0009)"),
    ("depth\x00", 6, "(U+0000)"),
    ("depth + \ud800", 9, "(U+D800)"),
    ("depth**65", 8, "an exponent is 65; allowed are -64 to 64"),
    ("depth**-65", 8, "an exponent is -65"),
    ("depth**64.5", 8, "an exponent is 64.5"),
    ("depth**(60 + 5)", 9, "an exponent is 65"),
    ("9**99999999999", 4, "an exponent is 1e+11"),
    ("depth**rate**2", 8, "contains another power"),
    ("depth**(1 + rate**2)", 9, "contains another power"),
    ("9**9**9**9**9", 10, "contains another power"),
    ("((depth + 1)**8)**9", 19, "multiply to 72; at most 64"),
    ("(1 + (k + depth**8)**3)**3", 26, "multiply to 72; at most 64"),
    ("1/0", 3, "divides by zero"),
    ("0**-1", 1, "no finite real value"),
    ("depth/0", 7, "divides by zero"),
    ("depth/(1 - 1.0)", 8, "divides by zero"),
    ("depth + sqrt(-1)", 9, "'sqrt(-1)' has no finite real value"),
    ("(-8)**(1/3)", 1, "no finite real value"),
    ("log(0)*depth", 1, "no finite real value"),
    ("acos(2)", 1, "no finite real value"),
    ("exp(exp(exp(9)))", 5, "'exp(exp(9))' has no finite real value"),
    ("1e300*1e300*depth", 1, "no finite real value"),
]


@pytest.mark.parametrize(("text", "column", "says"), REFUSED, ids=[repr(text)[:40] for text, *_ in REFUSED])
def test_refused(text, column, says):
    message, seconds = refusal_of(text)
    assert message.startswith("The formula ")
    assert message.endswith(".")
    assert f" is refused at column {column}: " in message
    assert says in message
    assert len(message) < 500
    assert seconds < 0.1


HUGE = {
    "a megabyte of a name": "a" * 10**6,
    "a megabyte of digits": "9" * 10**6,
    "a megabyte of sums": "depth+" * 170_000 + "depth",
    "a megabyte of parentheses": "(" * 500_000 + "depth" + ")" * 500_000,
    "a megabyte of open parentheses": "(" * 10**6,
    "a megabyte of brackets": "[" * 10**6,
    "a megabyte of signs": "-" * 10**6 + "depth",
    "a megabyte of powers": "9**" * 330_000 + "9",
    "a megabyte of spaces": " " * 10**6,
    "a megabyte of Greek": "\u03b4" * 10**6,
    "a megabyte of attributes": "depth" + ".real" * 200_000,
    "one character too many": "depth" + " " * 1996,
    "one parenthesis too deep": "(" * 51 + "depth" + ")" * 51,
    "one call too deep": "sin(" * 51 + "depth" + ")" * 51,
    "deep parentheses": "(" * 990 + "depth" + ")" * 990,
    "deep braces": "{" * 1000 + "}" * 1000,
    "deep open parentheses": "(" * 2000,
    "many signs": "-" * 1990 + "depth",
    "one node too many": "-" * 500 + "k",
    "many nodes": "+".join(["k"] * 900),
    "many powers": "9**" * 600 + "9",
    "a long unknown name": "depth_" * 300,
    "a long unknown function": "sin" * 600 + "(depth)",
    "a long number": "1" * 1990,
    "a long infinite number": "1" * 1990 + ".0",
    "a long wrong number": "1" * 1990 + "depth",
    "many spaces": "depth" + " " * 1990 + "@",
    "nested errors": "sin(" * 49 + "depth rate" + ")" * 49,
    "nested errors in calls": "max(k," * 12 + "depth rate" + ")" * 12,
}


@pytest.mark.parametrize("text", HUGE.values(), ids=HUGE.keys())
def test_huge_text_is_refused_within_a_tenth_of_a_second(text):
    parse("k*depth")  # what is loaded on first use is not counted
    message, seconds = refusal_of(text)
    assert seconds < 0.1
    assert message.endswith(".")
    assert len(message) < 500


@pytest.mark.parametrize(
    "value",
    [None, 1.5, 3, 10**5000, True, b"depth", ["depth"], {"depth": 1}, object(), sympy.Symbol("depth")],
    ids=lambda value: type(value).__name__,
)
def test_what_is_no_text_is_refused(value):
    message, seconds = refusal_of(value)
    assert message.startswith("The formula is ")
    assert type(value).__name__ in message
    assert "it must be text" in message
    assert seconds < 0.1


@pytest.mark.parametrize("text", ["", " ", "     "])
def test_empty_text_is_refused(text):
    with pytest.raises(FormulaError, match=r"^The formula is empty; write one"):
        parse(text)


def test_error_is_one_of_the_toolkit_and_a_value_error():
    assert issubclass(FormulaError, VibrokitError)
    assert issubclass(FormulaError, ValueError)


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('touch {}')",
        '__import__("pathlib").Path("{}").touch()',
        "open('{}', 'w')",
        'exec(\'open("{}", "w")\')',
        "[open('{}', 'w') for i in (1,)]",
        "(lambda: open('{}', 'w'))()",
        "k + open('{}', 'w').write(k)",
        "().__class__.__base__.__subclasses__()",
        "f\"{{open('{}', 'w')}}\"",
        "(x := open('{}', 'w'))",
    ],
)
def test_nothing_is_run(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FormulaError):
        parse(text.format(tmp_path / "run"))
    with pytest.raises(FormulaError):
        parse("k").expression({"k": text.format(tmp_path / "run")})  # SymPy's sympify would run it
    assert not list(tmp_path.iterdir())


def test_parser_sees_only_arithmetic(monkeypatch):
    """Whatever is thrown at it, `ast.parse` gets nothing that it objects to, and nothing but FormulaError comes out."""
    seen = []
    parsed = ast.parse

    def spy(source, *arguments, **options):
        seen.append(source)
        return parsed(source, *arguments, **options)

    monkeypatch.setattr(ast, "parse", spy)
    words = [*VARIABLES, *PARAMETERS, *FUNCTIONS, "pi", "2", "0.5", "1e3", ".", "lambda", "if", "_", "1j", "'", "0x1"]
    words += [*"+-*/(),^[]{}=:<% \\#;@!", "**", "(", ")", "(", ")", "*", "+", "\n", "\u03b4"]
    choice = random.Random(20).choice
    messages = []
    passed = 0
    for length in list(range(1, 13)) * 1000:
        text = "".join(choice(words) for _ in range(length))
        try:
            passed += bool(parse(text))
        except FormulaError as error:
            messages.append(str(error))
    assert not [message for message in messages if "cannot be parsed" in message]
    assert passed > 100
    assert len(seen) >= passed
    assert all(re.fullmatch(r"[\w +\-*/(),.]+", source) for source in seen)


def test_tree_with_anything_else_in_it_is_refused(monkeypatch):
    """The second guard: should the tokens ever let something through, the tree does not."""
    for text in ("depth.real", "depth[0]", "lambda: 1", "'a'", "1j", "True < 2", "[1]", "f'{k}'", "k if k else k"):
        monkeypatch.setattr("vibrokit.parts.formula.check_text", lambda text, known: ())
        with pytest.raises(FormulaError, match="has no meaning in a formula"):
            parse(text)


ACCEPTED = {
    "k*depth**1.5*(1 + c*rate)": lambda d, r, k, c: k * d**1.5 * (1 + c * r),
    "k*depth**(3/2)": lambda d, r, k, c: k * d**1.5,
    "-depth**2": lambda d, r, k, c: -(d**2),
    "2**-depth": lambda d, r, k, c: 2**-d,
    "--rate - +k": lambda d, r, k, c: r - k,
    "depth/rate/k": lambda d, r, k, c: d / r / k,
    "depth - rate - k": lambda d, r, k, c: d - r - k,
    " ( depth+rate ) * k ": lambda d, r, k, c: (d + r) * k,
    "1/3*depth + 0.1*rate": lambda d, r, k, c: d / 3 + 0.1 * r,
    "1.*depth + .5e-2*rate - 2E+1": lambda d, r, k, c: d + 0.005 * r - 20,
    "0.7": lambda d, r, k, c: 0.7,
    "pi*depth": lambda d, r, k, c: math.pi * d,
    "(1 + depth)**2.5": lambda d, r, k, c: (1 + d) ** 2.5,
    "(1 + depth)**0.3": lambda d, r, k, c: (1 + d) ** 0.3,
    "(1 + depth)**k": lambda d, r, k, c: (1 + d) ** k,
    "depth**(2*0.75)": lambda d, r, k, c: d**1.5,
    "(depth + 0.1)**64": lambda d, r, k, c: (d + 0.1) ** 64,
    "sqrt(depth)": lambda d, r, k, c: math.sqrt(d),
    "sqrt(0.7*sqrt(2*depth))": lambda d, r, k, c: math.sqrt(0.7 * math.sqrt(2 * d)),
    "exp(-rate) + log(depth)": lambda d, r, k, c: math.exp(-r) + math.log(d),
    "sin(rate)*cos(k)/tan(c)": lambda d, r, k, c: math.sin(r) * math.cos(k) / math.tan(c),
    "asin(rate/9) + acos(rate/9)*atan(k)": lambda d, r, k, c: math.asin(r / 9) + math.acos(r / 9) * math.atan(k),
    "sinh(rate)*cosh(k) - tanh(c)": lambda d, r, k, c: math.sinh(r) * math.cosh(k) - math.tanh(c),
    "abs(rate)*sign(rate)*sign(-k)": lambda d, r, k, c: r * math.copysign(1, -k),
    "min(depth, rate) + max(k, c, 0, rate)": lambda d, r, k, c: min(d, r) + max(k, c, 0, r),
    "max(0, k*depth + c*rate)": lambda d, r, k, c: max(0, k * d + c * r),
    "k*depth**1.5*(1 + 1.5*c*tanh(rate/0.01))": lambda d, r, k, c: k * d**1.5 * (1 + 1.5 * c * math.tanh(r / 0.01)),
    "+".join(["depth"] * 250): lambda d, r, k, c: 250 * d,
    "-" * 499 + "depth": lambda d, r, k, c: -d,
    "(" * 50 + "depth" + ")" * 50: lambda d, r, k, c: d,
    "depth" + " " * 1995: lambda d, r, k, c: d,
    "sqrt(2)**4*depth - 1/7": lambda d, r, k, c: 4 * d - 1 / 7,
}


@pytest.mark.parametrize("text", ACCEPTED, ids=[text[:40] for text in ACCEPTED])
def test_expression_is_the_arithmetic_of_python(text):
    made = expression(text)
    draw = random.Random(5).uniform
    for _ in range(20):
        values = {"depth": draw(0.01, 2), **{name: draw(-3, 3) for name in ("rate", "k", "c")}}
        expected = ACCEPTED[text](*values.values())
        exact = made.subs({SYMBOLS[name]: sympy.Float(value, 40) for name, value in values.items()}).evalf(30)
        assert math.isclose(float(exact), expected, rel_tol=1e-12, abs_tol=1e-13)


def random_formula(size, choice):
    """Return a formula of `size` operations, in parentheses everywhere; Python can evaluate it too."""
    if size == 0:
        return choice(["depth", "rate", "k", "c", "pi", "2", "3", "0.5", "0.1", "7.25"])
    kind = choice(["sum", "sum", "sum", "power", "sign", "function"])
    if kind == "sum":
        left = choice(range(size))
        first, second = random_formula(left, choice), random_formula(size - 1 - left, choice)
        return f"({first}){choice('+-*/')}({second})"
    inner = random_formula(size - 1, choice)
    if kind == "power":
        return f"(1.5+sin({inner}))**{choice(['2', '3', '-1', '0.5', '1.5', '(1/3)', '-2.5', 'rate'])}"
    return f"-({inner})" if kind == "sign" else f"{choice(['sin', 'cos', 'atan', 'tanh', 'abs', 'sign'])}({inner})"


def test_random_formulas_agree_with_python():
    chance = random.Random(8)
    compared = 0
    for _ in range(150):
        text = random_formula(chance.randint(1, 6), chance.choice)
        values = {"depth": chance.uniform(0.1, 2), **{name: chance.uniform(-2, 2) for name in ("rate", "k", "c")}}
        try:
            made = expression(text)
            expected = eval(text, {"__builtins__": {}, "pi": math.pi, **FUNCTIONS}, values)  # our own text
        except (FormulaError, ArithmeticError):
            continue
        if abs(expected) < 1e6:
            exact = made.subs({SYMBOLS[name]: sympy.Float(value, 40) for name, value in values.items()}).evalf(30)
            assert math.isclose(float(exact), expected, rel_tol=1e-8, abs_tol=1e-8), text
            compared += 1
    assert compared > 80


@pytest.mark.parametrize("literal", [0.1, 0.7, 1 / 3, 1e-300, 1.7e308, 5e-324, 123456.789, 2.0, 0.1 + 0.2])
def test_float_literals_are_the_same_double(literal):
    made = expression(repr(literal))
    assert isinstance(made, sympy.Float)
    assert float(made) == literal
    assert float(str(made)) == literal


def test_numbers_stay_exact_where_they_can():
    assert expression("k*depth**1.5") == k * depth ** sympy.Rational(3, 2)
    assert expression("depth**0.25") == depth ** sympy.Rational(1, 4)
    assert expression("depth**-2.0") == depth**-2
    assert expression("depth**(1/3)") == sympy.cbrt(depth)
    assert expression("depth**0.1").exp == sympy.Float(0.1)
    assert expression("2/3*depth") == sympy.Rational(2, 3) * depth
    assert expression("999999999999999") == sympy.Integer(999999999999999)
    assert expression("sqrt(2)*depth") == sympy.sqrt(2) * depth
    assert expression("cos(pi/3)*depth") == depth / 2
    assert expression("0*depth") == 0


def test_powers_are_not_expanded():
    assert expression("((depth + rate)**8)**8") == sympy.Pow(depth + rate, 64)
    assert expression("*".join(f"(rate + {i}*k)" for i in range(1, 60))).is_Mul


SLOW = [  # allowed or not, it must come to an end; SymPy by itself takes for ever over several of these
    "sqrt(1e10*3**(-0.25))",
    "1e5 + 2*pi/3*cosh((-1.5/(99**(1/3)*rate))**0.5)",
    "sqrt(2) + (" * 40 + "1" + ")*sqrt(3)" * 40,
    "exp(exp(exp(rate - rate + 99)))",
    "max(exp(exp(exp(rate - rate + 99))), 1)",
    "sin(exp(exp(exp(rate - rate + 99.0))))",
    "9**(rate - rate + 999999999999)",
    "((9**(rate - rate + 64))**(rate - rate + 64))**(rate - rate + 64)",
    "((1 + k)**(rate - rate + 64))**(rate - rate + 64)",
    "(rate - rate + 999999999999999)**64",
    "*".join(["1e300*rate"] * 120),
    "999999999999937**(1/2)*999999999999989**(1/3)*depth**0.7",
    "max(" + ",".join(f"sin({i}*rate)" for i in range(24)) + ")",
    "".join(f"max({i} + rate, min({i}*k, " for i in range(1, 7)) + "depth" + "))" * 6,
    "*".join(f"(depth + {i})" for i in range(100)),
    "(2*rate + 2*k)**64",
    "sqrt(1 + " * 49 + "depth" + ")" * 49,
    "1/(1 + " * 49 + "depth" + ")" * 49,
    "sin(" * 50 + "rate" + ")" * 50,
]


def test_no_allowed_formula_blows_up():
    """In a process of its own, which can be ended if it hangs."""
    code = (
        "import json, sys, time, sympy\n"
        "from vibrokit.parts.formula import FormulaError, parse_formula\n"
        "symbols = {name: sympy.Symbol(name, real=True) for name in ('depth', 'rate', 'k', 'c')}\n"
        "times = []\n"
        "for text in json.load(sys.stdin):\n"
        "    start = time.perf_counter()\n"
        "    try:\n"
        "        made = parse_formula(text, ('depth', 'rate'), ('k', 'c')).expression(symbols)\n"
        "        assert sum(1 for _ in sympy.preorder_traversal(made)) < 2000\n"
        "    except FormulaError:\n"
        "        pass\n"
        "    times.append(time.perf_counter() - start)\n"
        "print(json.dumps(times))\n"
    )
    assert max(json.loads(run(code, json.dumps(SLOW)))) < 5


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("depth/(rate - rate)", "comes to infinity"),
        ("log(rate - rate)", "no finite real number"),
        ("sqrt(rate - rate - 1)", "no finite real number"),
        ("asin(rate - rate + 2)", "asin"),
        ("sqrt(-depth)", "not finite and real"),
        ("(-depth)**(1/3)", "no finite real number"),
        ("9**(rate - rate + 99)", "an exponent comes to 99"),
        ("depth**64*depth**64", "combine to an exponent of 128"),
        ("1e300*depth*1e300", "holds the number 1.0"),
        ("(rate - rate + " + "*".join(["999999999999999"] * 20) + ")**64", "thousands of digits"),
    ],
)
def test_what_only_sympy_brings_to_light(text, says):
    with pytest.raises(FormulaError, match=r"^The formula .* is refused at column ") as caught:
        expression(text)
    assert says in str(caught.value)


def test_values_of_names():
    formula = parse("k*depth")
    x = sympy.Symbol("x", real=True)
    assert formula.names == ("k", "depth")
    assert formula.expression({"k": 2, "depth": x - 1, "unused": 5}) == 2 * (x - 1)
    assert float(formula.expression({"k": 0.1, "depth": 1})) == 0.1
    with pytest.raises(FormulaError, match="uses depth, which has no value"):
        formula.expression({"k": k})
    for value in ("depth", None, [1], sympy.true):
        with pytest.raises(FormulaError, match="The value of k is of type"):
            formula.expression({"k": value, "depth": depth})
    for value in (math.nan, math.inf, sympy.oo, sympy.I, sympy.zoo):
        with pytest.raises(FormulaError, match="give a finite real number"):
            formula.expression({"k": value, "depth": depth})


@pytest.mark.parametrize("name", ["k", "c_1", "stiffness", "E", "alpha2", "n" * 60])
def test_good_parameter_names(name):
    check_parameter_name(name, VARIABLES)
    assert parse_formula(f"{name}*depth", VARIABLES, (name,)).names == (name, "depth")


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("depth", "is already a variable"),
        ("sin", "is the name of a function"),
        ("pi", "is kept for the number"),
        ("nan", "is kept for the number"),
        ("Inf", "is kept for the number"),
        ("_k", "starts with an underscore"),
        ("__class__", "starts with an underscore"),
        ("lambda", "is a word of the Python language"),
        ("True", "is a word of the Python language"),
        ("2k", "is no name"),
        ("k-1", "is no name"),
        ("k c", "is no name"),
        ("", "is no name"),
        ("\u03b4", "is no name"),
        ("k" * 10**6, "has 1000000 characters; at most 60"),
        (3, "its name must be text"),
    ],
    ids=lambda value: str(value)[:20],
)
def test_bad_parameter_names(name, says):
    start = time.perf_counter()
    with pytest.raises(FormulaError) as caught:
        check_parameter_name(name, VARIABLES)
    assert time.perf_counter() - start < 0.1
    assert says in str(caught.value)
    assert len(str(caught.value)) < 300
    with pytest.raises(FormulaError):
        parse_formula("depth", VARIABLES, (name,))


def test_too_many_parameters_are_refused():
    parameters = tuple(f"k{i}" for i in range(100_000))
    start = time.perf_counter()
    with pytest.raises(FormulaError, match="has 100000 parameters; at most 100 are allowed"):
        parse_formula("depth", VARIABLES, parameters)
    assert time.perf_counter() - start < 0.1


def test_import_and_checks_need_no_sympy():
    code = (
        "import sys\n"
        "from vibrokit.parts.formula import FormulaError, parse_formula\n"
        "parse_formula('k*depth**1.5', ('depth', 'rate'), ('k',))\n"
        "assert not {'sympy', 'numpy', 'numba'} & set(sys.modules)\n"
    )
    run(code)


def test_formula_is_a_value():
    formula = parse("k*depth**1.5*(1 + c*rate)")
    copy = pickle.loads(pickle.dumps(formula))
    assert copy == formula
    assert hash(copy) == hash(formula)
    assert copy.names == ("k", "depth", "c", "rate")
    assert copy.expression(SYMBOLS) == formula.expression(SYMBOLS)
    with pytest.raises(dataclasses.FrozenInstanceError):
        formula.text = "0"
    with pytest.raises(FormulaError):
        Formula("open(depth)", VARIABLES)
    with pytest.raises(FormulaError, match="is unknown"):
        dataclasses.replace(formula, text="x")
    error = pickle.loads(pickle.dumps(FormulaError("The formula is wrong.")))
    assert str(error) == "The formula is wrong."
