"""Evaluation of a xacro's expressions in bounded time and memory: a file of a stranger may not hang a run."""

import ast
from types import CodeType
from typing import Any

MOST_BITS = 4096
"""Of a whole number in an expression: far more than a double holds."""
MOST_ITEMS = 10_000
"""Of a range, a repeated text or list, a factorial."""
MOST_LOOPS = 2
"""Loops in one expression: with ``MOST_ITEMS`` each, seconds."""
SIZED = ("range", "factorial", "comb", "perm", "ljust", "rjust", "center", "zfill")
"""Functions whose cost grows with a number that they are given."""


def evaluated(expression: str, names: dict[str, Any], local: Any = None) -> Any:
    """The value of a Python expression with these names, which hold the guards from then on. Raises ValueError for one
    that is too large, and for names that begin with two underscores."""
    dict.update(names, GUARDS)  # xacro's names are a dict that looks them up by its own rules: a copy would not
    return eval(bounded(expression), names, local)


def bounded(expression: str) -> CodeType:
    """The code of an expression in which powers, products, shifts and sizes are looked at before they are made."""
    tree = ast.parse(expression.strip(), "<expression>", "eval")
    if sum(isinstance(node, ast.comprehension) for node in ast.walk(tree)) > MOST_LOOPS:
        raise ValueError(f"it has more than {MOST_LOOPS} loops")
    return compile(ast.fix_missing_locations(_Guarded().visit(tree)), "<expression>", "eval")


class _Guarded(ast.NodeTransformer):
    """Puts a guard in the place of each operation that may grow beyond bounds."""

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        guard = {ast.Pow: "bounded_power", ast.Mult: "bounded_product", ast.LShift: "bounded_shift"}.get(type(node.op))
        return _call(guard, node.left, node.right) if guard else node

    def visit_Call(self, node: ast.Call) -> ast.expr:
        self.generic_visit(node)
        name = node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")
        if name in SIZED:
            node.args = [item if isinstance(item, ast.Starred) else _call("bounded_size", item) for item in node.args]
        return node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return _named(node, node.id)

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        self.generic_visit(node)
        return _named(node, node.attr)


def _named(node: ast.expr, name: str) -> ast.expr:
    if name.startswith("__"):
        raise ValueError(f"the name '{name}' is not allowed")
    return node


def _call(guard: str, *arguments: ast.expr) -> ast.expr:
    return ast.Call(ast.Name(guard, ast.Load()), list(arguments), [])


def _power(base: Any, exponent: Any) -> Any:
    if isinstance(base, int) and isinstance(exponent, int):
        _within(base.bit_length() * exponent, MOST_BITS)
    return base**exponent


def _product(left: Any, right: Any) -> Any:
    for one, other in ((left, right), (right, left)):
        if isinstance(one, str | list | tuple) and isinstance(other, int):
            _within(len(one) * other, MOST_ITEMS)
    if isinstance(left, int) and isinstance(right, int):
        _within(left.bit_length() + right.bit_length(), MOST_BITS)
    return left * right


def _shift(number: Any, places: Any) -> Any:
    if isinstance(places, int):
        _within(places, MOST_BITS)
    return number << places


def _size(value: Any) -> Any:
    if isinstance(value, int):
        _within(abs(value), MOST_ITEMS)
    return value


def _within(size: int, most: int) -> None:
    if size > most:
        raise ValueError("it is too large to be evaluated")


GUARDS = {"bounded_power": _power, "bounded_product": _product, "bounded_shift": _shift, "bounded_size": _size}
