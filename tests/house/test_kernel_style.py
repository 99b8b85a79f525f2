"""The rules of kernels/, checked by machine; CONTRIBUTING.md says what they are for."""

import ast
from pathlib import Path

import pytest

KERNELS = Path(__file__).resolve().parents[2] / "kernels"
TREES = {path: ast.parse(path.read_text()) for path in sorted(KERNELS.glob("*.py"))}
DEVICE_DECORATORS = ("wp.func", "wp.kernel", "wp.func_native")
HOST_WORK = {"launch", "zeros", "empty", "ones", "full", "array", "from_numpy", "copy", "clone", "synchronize", "to_torch"}
FORMULA_FILES = ("flow", "vortices", "noise", "forces", "integration")


def decorator(node: ast.AST) -> str:
    """`wp.func`, `wp.kernel` or `wp.func_native` when the function is device code, else nothing."""
    names = [ast.unparse(d.func if isinstance(d, ast.Call) else d) for d in getattr(node, "decorator_list", [])]
    return next((name for name in names if name in DEVICE_DECORATORS), "")


DEVICE = [(path, node) for path, tree in TREES.items() for node in ast.walk(tree) if decorator(node)]
CASES = [pytest.param(path, node, id=f"{path.stem}.{node.name}") for path, node in DEVICE]
each_module = pytest.mark.parametrize("path", TREES, ids=lambda path: path.stem)
each_function = pytest.mark.parametrize(("path", "node"), CASES)


def is_native(node: ast.AST) -> bool:
    return decorator(node) == "wp.func_native"


def owner(node: ast.AST) -> str | None:
    """The name at the root of `name`, `name.member`, `name.member[i]`."""
    while isinstance(node, ast.Attribute | ast.Subscript):
        node = node.value
    return node.id if isinstance(node, ast.Name) else None


def stored_names(function: ast.FunctionDef):
    """Roots of everything stored to by subscript or by wp.atomic_*; all arrays of a native function whose body only documents it."""
    for node in ast.walk(function):
        targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AugAssign) else []
        yield from (owner(t) for t in targets if any(isinstance(part, ast.Subscript) for part in ast.walk(t)))
        if isinstance(node, ast.Call) and ast.unparse(node.func).startswith("wp.atomic_"):
            yield owner(node.args[0])
    if is_native(function) and all(isinstance(n, ast.Expr) and isinstance(n.value, ast.Constant) for n in function.body):
        yield from (a.arg for a in function.args.args if "array" in ast.unparse(a.annotation))


def written_names(function: ast.FunctionDef, written_places: dict[str, set[int]]) -> set[str]:
    """Arguments the function stores to, itself or through a function it calls."""
    names = set(stored_names(function))
    for call in (n for n in ast.walk(function) if isinstance(n, ast.Call)):
        places = written_places.get(ast.unparse(call.func).split(".")[-1], ())
        names |= {owner(argument) for place, argument in enumerate(call.args) if place in places}
    return names & {a.arg for a in function.args.args}


def all_written_places() -> dict[str, set[int]]:
    """For each device function, the places of the arguments it writes: followed through calls until nothing changes."""
    places, before = {node.name: set() for _, node in DEVICE}, None
    while before != places:
        before = {name: set(known) for name, known in places.items()}
        for _, node in DEVICE:
            names = [a.arg for a in node.args.args]
            places[node.name] |= {names.index(name) for name in written_names(node, places)}
    return places


WRITTEN_PLACES = all_written_places()


@each_module
def test_kernel_module_imports_only_kernels_and_warp(path):
    imports = [n for n in ast.walk(TREES[path]) if isinstance(n, ast.Import | ast.ImportFrom)]
    names = {a.name for n in imports if isinstance(n, ast.Import) for a in n.names}
    names |= {n.module for n in imports if isinstance(n, ast.ImportFrom)}
    assert all(name == "warp" or name.split(".")[:2] == ["warpsim", "kernels"] for name in names), names


@each_module
def test_kernel_module_neither_launches_nor_allocates(path):
    calls = {ast.unparse(n.func) for n in ast.walk(TREES[path]) if isinstance(n, ast.Call)}
    assert not {c for c in calls if c.startswith("wp.") and c.split(".")[1] in HOST_WORK}
    assert ast.get_docstring(TREES[path]), "say which phenomenon lives here, and its symbols"


@each_function
def test_kernel_function_is_small_and_says_what_it_computes(path, node):
    assert ast.get_docstring(node), "say what it computes: formula, units, shapes"
    assert "\n\n" not in ast.get_docstring(node), "one docstring line: longer reasons are comments where the line is"
    assert all(a.annotation for a in node.args.args), "annotate every argument"
    assert len(node.args.args) <= 12 and node.end_lineno - node.lineno < 60, "split it, or let a wp.struct travel"


@pytest.mark.parametrize(("path", "node"), [case for case in CASES if not is_native(case.values[1])])
def test_kernel_function_marks_what_it_writes(path, node):
    """Native loops are free of it: the kernel that calls one carries the marks, and the loop's C++ text repeats every name."""
    marked = {a.arg for a in node.args.args if a.arg.endswith(("_out", "_inout"))}
    written = written_names(node, WRITTEN_PLACES)
    assert written == marked, f"written {sorted(written)} but marked {sorted(marked)}"


@each_function
def test_kernel_function_adds_to_no_shared_number(path, node):
    """wp.atomic_add is a plain sum on the CPU, which two threads run at once: count_one is for that; mark_arrivals runs in one."""
    adds = [n.lineno for n in ast.walk(node) if isinstance(n, ast.Call) and ast.unparse(n.func).startswith("wp.atomic_")]
    assert not adds or node.name in ("count_one", "mark_arrivals"), f"lines {adds}"


@each_module
def test_kernel_module_has_nothing_static(path):
    """Warp 1.19 hashes a wp.static in an unrolled loop only once it is built: a module's name in the cache would depend on the past."""
    assert not [n.lineno for n in ast.walk(TREES[path]) if isinstance(n, ast.Call) and ast.unparse(n.func) == "wp.static"]


@each_function
def test_kernel_function_has_no_hidden_atomics(path, node):
    added = [n.lineno for n in ast.walk(node) if isinstance(n, ast.AugAssign) and isinstance(n.target, ast.Subscript)]
    assert not added, f"lines {added}: write a[i] = a[i] + x; Warp makes a[i] += x an atomic"


@pytest.mark.parametrize(("path", "node"), [case for case in CASES if decorator(case.values[1]) == "wp.kernel"])
def test_kernel_takes_a_range_or_a_part(path, node):
    arguments = [a.arg for a in node.args.args]
    threads = [n for n in ast.walk(node) if isinstance(n, ast.Call) and ast.unparse(n.func) == "wp.tid"]
    sums = [ast.unparse(n.left) for n in ast.walk(node) if isinstance(n, ast.BinOp) and n.right in threads]
    assert all(left == arguments[0] for left in sums) and len(sums) == len(threads), "the element is first + wp.tid()"
    assert not threads or arguments[0] == "first" or arguments[:2] == ["part", "part_count"]


@pytest.mark.parametrize(("path", "node"), [c for c in CASES if c.values[0].stem in FORMULA_FILES and decorator(c.values[1]) == "wp.func"])
def test_formula_names_its_source(path, node):
    text = ast.get_docstring(node) or ""
    assert "=" not in text or "Source:" in text, "a docstring that states a formula says where it is from"


def test_the_rules_see_what_they_forbid():
    """A rule that cannot fail protects nothing."""
    code = "def f(i: int, x: A, p: A, q: A, r: A):\n    x.age[i] += 1.0\n    wp.atomic_add(p, i, 1)\n    g(q, r)\n"
    assert written_names(ast.parse(code).body[0], {"g": {1}}) == {"x", "p", "r"}
    native = ast.parse("@wp.func_native(snippet(TEXT))\ndef f(n: int, a: wp.array[int]): ...").body[0]
    assert is_native(native) and set(stored_names(native)) == {"a"}
