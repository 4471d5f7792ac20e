"""The size of the package in numbers: lines by room, constants that decide, wide signatures, long functions.

    python tests/benchmarks/size.py [--list constants | wide | long]

Code is every line outside of docstrings and imports that is not blank. A constant is a name that a module gives one or
several numbers. Tables of coefficients, statuses, and the layout of pictures, pages and printed text are counted apart.
Wide functions have seven parameters or more, long ones more than 60 lines.
"""

import argparse
import ast
import collections
from pathlib import Path

ROOT = Path(__file__).parents[2]
OTHERS = ("tests", "docs", "plugins", "tutorials")
LAYOUT = ("plots", "report", "display.py", "text_table.py", "progress.py")  # of pictures, pages and printed text
TABLES = ("kernels/tableau", "kernels/waves", "kernels/templates", "kernels/stopping")
ALLOWED = ast.Constant | ast.UnaryOp | ast.BinOp | ast.operator | ast.unaryop | ast.Tuple | ast.List | ast.expr_context
WIDE, LONG, FEWEST = 7, 60, 8  # parameters; lines; numbers that make a table of coefficients


def sources(room):
    return sorted(path for path in (ROOT / room).rglob("*.py") if ".venv" not in path.parts)


def numbers(value):
    """How many numbers an expression consists of; 0 if it has anything else in it but operators."""
    parts = list(ast.walk(value))
    if not all(isinstance(part, ALLOWED) for part in parts):
        return 0
    constants = [part.value for part in parts if isinstance(part, ast.Constant)]
    plain = all(isinstance(one, int | float) and not isinstance(one, bool) for one in constants)
    return len(constants) if plain else 0


def constants(tree):
    """Names of a module that stand for numbers, with how many."""
    for node in tree.body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                names = target.elts if isinstance(target, ast.Tuple) else [target]
                several = isinstance(node.value, ast.Tuple) and len(node.value.elts) == len(names) > 1
                values = node.value.elts if several else [node.value] * len(names)
                for name, value in zip(names, values, strict=True):
                    count = numbers(value)
                    if count and isinstance(name, ast.Name):
                        yield ast.unparse(name), count


def counted(path):
    """Constants, wide functions and long ones of a file, each as text."""
    tree, where = ast.parse(path.read_text()), path.relative_to(ROOT)
    found = {"constants": [f"{where}: {name}" for name, count in constants(tree) if count < FEWEST]}
    every = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    for node in every:
        given = (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
        count = sum(one.arg not in ("self", "cls") for one in given)
        lines = node.end_lineno - node.lineno + 1
        place = f"{where}:{node.lineno} {node.name}"
        found.setdefault("wide", []).extend([f"{place}, {count} parameters"] * (count >= WIDE))
        found.setdefault("long", []).extend([f"{place}, {lines} lines"] * (lines > LONG))
    return found


def lines_by_kind(path):
    """Lines of a file: all, docstrings, blank ones outside of these, imports, and the rest, which is code."""
    text = path.read_text()
    tree, kinds = ast.parse(text), collections.Counter()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            kinds["imports"] += node.end_lineno - node.lineno + 1
        documents = isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        if documents and ast.get_docstring(node, clean=False) is not None:
            first = node.body[0]
            kinds["docstrings"] += first.end_lineno - first.lineno + 1
            kinds["blank"] -= sum(not line.strip() for line in text.splitlines()[first.lineno - 1 : first.end_lineno])
    kinds["lines"] = len(text.splitlines())
    kinds["blank"] += sum(not line.strip() for line in text.splitlines())
    kinds["code"] = kinds["lines"] - kinds["blank"] - kinds["docstrings"] - kinds["imports"]
    return kinds


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", choices=("constants", "wide", "long"))
    wanted = parser.parse_args().list
    rooms, totals, lists = collections.defaultdict(collections.Counter), collections.Counter(), []
    for path in sources("vibrokit"):
        parts = path.relative_to(ROOT / "vibrokit").parts
        apart = parts[0] in LAYOUT or "/".join(parts).startswith(TABLES)
        found = counted(path)
        room = rooms[f"vibrokit/{parts[0]}/" if len(parts) > 1 else "vibrokit/*.py"]
        room += lines_by_kind(path)
        for kind, some in found.items():
            kind = "apart" if kind == "constants" and apart else kind
            room[kind] += len(some)
            lists += some if kind == wanted else []
    for name in OTHERS:
        for path in sources(name):
            rooms[f"{name}/"] += lines_by_kind(path)
    if wanted:
        print("\n".join(lists))
        return
    columns = ("lines", "code", "docstrings", "blank", "imports", "constants", "apart", "wide", "long")
    print(f"{'':28s}" + "".join(f"{column:>11s}" for column in columns))
    for name, counts in rooms.items():
        print(f"{name:28s}" + "".join(f"{counts[column]:11d}" for column in columns))
        totals += counts if name.startswith("vibrokit") else {}
    print(f"{'vibrokit/ in all':28s}" + "".join(f"{totals[column]:11d}" for column in columns))


if __name__ == "__main__":
    main()
