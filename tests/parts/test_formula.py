"""Formulas as text: what is refused and how fast, the expressions of the rest, and that no code is run."""

import ast
import json
import math
import pickle
import random
import subprocess
import sys

import pytest
import sympy

from tests.refusals import quickest_refusal
from vibrokit.errors import FormulaError, VibrokitError
from vibrokit.parts import formula
from vibrokit.parts.formula import FUNCTIONS, check_parameter_names, read
from vibrokit.parts.formula_expression import expression as build

pytestmark = pytest.mark.filterwarnings("error")  # a SyntaxWarning would be one

VARIABLES = ("depth", "rate")
PARAMETERS = ("k", "c")
SYMBOLS = {
    "depth": sympy.Symbol("depth", positive=True),
    **{name: sympy.Symbol(name, real=True) for name in ("rate", "k", "c")},
}
depth, rate, k, c = SYMBOLS.values()


def parse(text):
    return read(text, (*VARIABLES, *PARAMETERS))


def expression(text):
    return build(text, SYMBOLS)


def refusal_of(text):
    return quickest_refusal(FormulaError, lambda: parse(text))


def run(code, given=""):
    """Run Python code in a process of its own and return what it prints."""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, input=given, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


STRANGE = {  # a character that no formula has, and texts in which it is the first such one
    "[": ("depth[0]", "[depth]", "[i for i in depth]"), "{": ("{depth}",), ":": ("lambda: 1", "(depth := 1)"),
    "=": ("depth = 1", "depth == 1", "sin(depth=1)"), "<": ("depth < 1", "1 < depth > 2"), "!": ("depth != 1",),
    "'": ("'depth'", "f'{depth}'", "k'x'", "__import__('os').system('true')"), '"': ('"depth"',), "%": ("depth % 2",),
    "@": ("depth @ rate",), "&": ("depth & rate",), "~": ("~depth",), ";": ("depth; rate",), "#": ("depth # + 1",),
    "\\": ("depth \\",), "`": ("`depth`",), "\u03b4": ("\u03b4*2",), "\u0434": ("k * \u0434epth",),
    "\uff44": ("\uff44epth",), "\n": ("depth\n+ 1",), "\t": ("depth\t",), "\x00": ("depth\x00",),
    "\ud800": ("depth + \ud800",),
}  # fmt: skip
REFUSED = [  # text, column, and the offending value or the limit in the message
    *((text, text.index(sign) + 1, f"{sign!a}") for sign, texts in STRANGE.items() for text in texts),
    *((text, 1, f"'{text}'") for text in (  # no part of the arithmetic that formulas have
        "depth.real", "1 .real", "1..real", "1j", "True", "None", "not depth", "depth and rate", "depth if rate else k",
        "await depth", "min(**depth)", "...", "nan", "inf", "1e999", "9" * 16, "0x10", "1_000", "1if depth else 2",
        "2(depth)", "sin", "_k", "__name__", "depth.__class__.__bases__", "depth, rate", "(depth, rate)", "depth // 2",
        "acos(2)", "0**-1", "(-8)**(1/3)",
    )),
    *((text, None, f"'{text}'") for text in (".depth", "yield", "1e", "1.2.3", "007", "2depth", "depth +")),
    ("depth^2", 6, "write ** for a power"),
    ("().__class__", 1, "'()'"),
    ("(i for i in depth)", 2, "'i'"),
    ("lambda x: x", 9, "':'"),
    ("depth + 2.5J", 9, "'2.5J'"),
    ("min(*depth)", 5, "'*depth'"),
    ("depth*Infinity", 7, "'Infinity'"),
    ("depth + 1e-999", 9, "'1e-999'"),
    ("depth**" + "9" * 1000, 8, "99999"),
    ("depth rate", 7, "'depth rate'"),
    ("(depth)(rate)", 1, "'depth'"),
    ("depth(2)", 1, "'depth'"),
    ("sin*2", 1, "'sin'"),
    ("x", 1, "allowed: c, depth, k, pi, rate"),
    ("dept", 1, "the nearest is 'depth'"),
    ("k*raet", 3, "the nearest is 'rate'"),
    ("eval(depth)", 1, "allowed: abs, acos, asin,"),
    ("tanhh(depth)", 1, "the nearest is 'tanh'"),
    ("pow(depth, 2)", 1, "'pow'"),
    ("sin()", 1, "the number of arguments of sin is 0"),
    ("sin(depth, rate)", 1, "the number of arguments of sin is 2"),
    ("max(depth,)", 1, "the number of arguments of max is 1"),
    ("max(" + ",".join(["depth"] * 25) + ")", 1, "25 arguments in all; at most 24"),
    ("sin((depth, rate))", 5, "'(depth, rate)'"),
    ("(depth", 1, "'(depth'"),
    ("k*sin(depth", 6, "'k*sin(depth'"),
    ("depth)", 6, "'depth)'"),
    ("depth *** 2", 9, "'depth *** 2'"),
    ("depth**65", 8, "an exponent is 65"),
    ("depth**-65", 8, "an exponent is -65"),
    ("depth**64.5", 8, "an exponent is 64.5"),
    ("depth**(60 + 5)", 9, "an exponent is 65"),
    ("9**99999999999", 4, "an exponent is 1e+11"),
    ("depth**rate**2", 8, "contains a power"),
    ("depth**(1 + rate**2)", 9, "contains a power"),
    ("9**9**9**9**9", 10, "contains a power"),
    ("((depth + 1)**8)**9", 19, "multiply to 72; at most 64"),
    ("(1 + (k + depth**8)**3)**3", 26, "multiply to 72; at most 64"),
    ("1/0", 3, "divides by zero"),
    ("depth/(1 - 1.0)", 8, "divides by zero"),
    ("depth + sqrt(-1)", 9, "'sqrt(-1)'"),
    ("log(0)*depth", 1, "'log(0)'"),
    ("exp(exp(exp(9)))", 5, "'exp(exp(9))'"),
    ("1e300*1e300*depth", 1, "'1e300*1e300'"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "column", "value"), REFUSED, ids=[ascii(text)[:40] for text, *_ in REFUSED])
def test_refused(text, column, value):
    message, seconds = refusal_of(text)
    assert message.startswith("The formula ")
    assert message.endswith(".")
    assert f" column {column or ''}" in message
    assert value in message
    assert len(message) < 500
    assert seconds < 0.1


HUGE = {
    **{
        f"a megabyte of {short!a}": short * (10**6 // len(short))
        for short in ("a", "9", "(", "[", " ", "\u03b4", "9**")
    },
    "a megabyte of sums": "depth+" * 170_000 + "depth",
    "a megabyte of parentheses": "(" * 500_000 + "depth" + ")" * 500_000,
    "a megabyte of signs": "-" * 10**6 + "depth",
    "a megabyte of attributes": "depth" + ".real" * 200_000,
    "one character too many": "depth" + " " * 1996,
    "one parenthesis too deep": "(" * 51 + "depth" + ")" * 51,
    "one call too deep": "sin(" * 51 + "depth" + ")" * 51,
    "deep parentheses": "(" * 990 + "depth" + ")" * 990,
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
    assert seconds < 0.1


@pytest.mark.parametrize("text", ["", " ", "     "])
def test_empty_text_is_refused(text):
    with pytest.raises(FormulaError, match=r"^The formula is empty") as caught:
        parse(text)
    assert isinstance(caught.value, VibrokitError)
    assert isinstance(caught.value, ValueError)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


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
        build("k", {"k": text.format(tmp_path / "run")})  # SymPy's sympify would run it
    assert not list(tmp_path.iterdir())


def test_random_text_gives_a_tree_or_a_formula_error():
    words = [*VARIABLES, *PARAMETERS, *FUNCTIONS, "pi", "2", "0.5", "1e3", ".", "lambda", "if", "_", "1j", "'", "0x1"]
    words += [*"+-*/(),^[]{}=:<% \\#;@!", "**", "(", ")", "(", ")", "*", "+", "\n", "\u03b4", " not ", " for ", " in "]
    choice = random.Random(20).choice
    outcomes = {True: 0, False: 0}
    for length in list(range(1, 13)) * 1000:
        text = "".join(choice(words) for _ in range(length))
        try:
            parse(text)
        except FormulaError:
            outcomes[False] += 1
        else:
            outcomes[True] += 1
            ast.parse(text.strip(), mode="eval")
    assert min(outcomes.values()) > 100


NOT_ARITHMETIC = (
    "depth.real", "depth[0]", "lambda: 1", "'a'", "b'a'", "1j", "True < 2", "[1]", "f'{k}'", "k if k else k",
    "(k := 1)", "sin(x=k)", "sin(**k)", "sin(*k)", "k.sin(k)", "[k for k in k]", "~k", "k @ k", "k and k", "...",
)  # fmt: skip


@pytest.mark.parametrize("text", NOT_ARITHMETIC)
def test_whitelist_of_nodes_does_not_depend_on_the_check_of_characters(monkeypatch, text):
    monkeypatch.setattr(formula, "_checked_text", lambda text: text)
    with pytest.raises(FormulaError, match=r"^The formula .* column \d+"):
        parse(text)


@pytest.mark.parametrize(
    "error", [RecursionError("deep"), MemoryError(), ValueError("null bytes"), SyntaxError("wrong")]
)
def test_whatever_the_parser_raises_is_a_formula_error(monkeypatch, error):
    def fail(*arguments, **options):
        raise error

    monkeypatch.setattr(ast, "parse", fail)
    with pytest.raises(FormulaError, match=r"^The formula 'k\*depth' .*\.$"):
        parse("k*depth")


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
        "from vibrokit.errors import FormulaError\n"
        "from vibrokit.parts.formula_expression import expression\n"
        "symbols = {name: sympy.Symbol(name, real=True) for name in ('depth', 'rate', 'k', 'c')}\n"
        "times = []\n"
        "for text in json.load(sys.stdin):\n"
        "    start = time.process_time()\n"
        "    try:\n"
        "        made = expression(text, symbols)\n"
        "        assert sum(1 for _ in sympy.preorder_traversal(made)) < 2000\n"
        "    except FormulaError:\n"
        "        pass\n"
        "    times.append(time.process_time() - start)\n"
        "print(json.dumps(times))\n"
    )
    assert max(json.loads(run(code, json.dumps(SLOW)))) < 5


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("depth/(rate - rate)", "infinity"),
        ("log(rate - rate)", "infinity"),
        ("sqrt(rate - rate - 1)", "I"),
        ("asin(rate - rate + 2)", "asin(2)"),
        ("sqrt(-depth)", "evaluates to I"),
        ("(-depth)**(1/3)", "(-1)**(1/3)"),
        ("9**(rate - rate + 99)", "evaluates to 99; allowed are -64 to 64"),
        ("depth**64*depth**64", "evaluates to 128; allowed are -64 to 64"),
        ("1e300*depth*1e300", "e+600"),
        ("(rate - rate + " + "*".join(["999999999999999"] * 20) + ")**64", "Integer"),
    ],
)
def test_what_only_simplification_shows_is_refused(text, value):
    with pytest.raises(FormulaError, match=r"^The formula .* column \d+") as caught:
        expression(text)
    assert value in str(caught.value)


def test_values_of_names():
    x = sympy.Symbol("x", real=True)
    assert build("k*depth", {"k": 2, "depth": x - 1, "unused": 5}) == 2 * (x - 1)
    assert float(build("k*depth", {"k": 0.1, "depth": 1})) == 0.1
    with pytest.raises(FormulaError, match="'depth'"):
        build("k*depth", {"k": k})
    for value in ("depth", None, [1], sympy.true, math.nan, math.inf, sympy.oo, sympy.I, sympy.zoo):
        with pytest.raises(FormulaError, match="The value of k is") as caught:
            build("k*depth", {"k": value, "depth": depth})
        assert str(value) in str(caught.value)


@pytest.mark.parametrize("name", ["k", "c_1", "stiffness", "E", "alpha2", "n" * 60])
def test_good_parameter_names(name):
    check_parameter_names((name,), VARIABLES)
    read(f"{name}*depth", (*VARIABLES, name))


@pytest.mark.parametrize(
    "name",
    [
        "depth", "sin", "pi", "nan", "Inf", "_k", "__class__", "lambda", "True", "2k", "k-1", "k c", "", "\u03b4",
        "k" * 61, "k" * 10**6,
    ],
    ids=lambda name: ascii(name)[:20],
)  # fmt: skip
def test_bad_parameter_names(name):
    message, seconds = quickest_refusal(FormulaError, lambda: check_parameter_names(("k", name), VARIABLES))
    assert seconds < 0.1
    assert f"{name[:50]}" in message
    assert len(message) < 500


def test_too_many_parameters_are_refused():
    parameters = tuple(f"k{i}" for i in range(100_000))
    message, seconds = quickest_refusal(FormulaError, lambda: check_parameter_names(parameters, VARIABLES))
    assert "100000 parameters; at most 100 are allowed" in message
    assert seconds < 0.1


def test_import_and_checks_need_no_sympy():
    code = (
        "import sys\n"
        "from vibrokit.parts.formula import read\n"
        "read('k*depth**1.5', ('depth', 'k'))\n"
        "assert not {'sympy', 'numpy', 'numba'} & set(sys.modules)\n"
    )
    run(code)
