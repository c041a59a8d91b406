"""Whether a program for the robot's own Python 2.7 keeps to syntax that it knows.

Python 2.7 is not at hand everywhere, so what it does not know is looked for in the syntax tree.
"""

from __future__ import annotations

import ast
from pathlib import Path

TOO_NEW = (
    ast.JoinedStr,
    ast.AnnAssign,
    ast.NamedExpr,
    ast.Nonlocal,
    ast.YieldFrom,
    ast.AsyncFunctionDef,
    ast.Await,
    ast.Match,
    ast.MatMult,
)


def assert_python_2(path: Path) -> None:
    """Fail at the first thing in the file that Python 2.7 does not know."""
    source = path.read_text()
    if not source.startswith(('"""', "from __future__")) or len(source.splitlines()) > 5:
        assert any("Python 2.7" in line for line in source.splitlines()[:2]), f"{path} does not say that it is for 2.7"
    assert source.isascii(), "Python 2.7 needs a declaration for anything else"
    tree = ast.parse(source)
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and node.args]
    spread = {id(call.args[-1]) for call in calls}
    for node in ast.walk(tree):
        assert not isinstance(node, TOO_NEW), f"line {node.lineno}: {type(node).__name__}"
        if isinstance(node, ast.FunctionDef | ast.Lambda):
            assert not node.args.kwonlyargs
            assert not node.args.posonlyargs
            assert not any(argument.annotation for argument in node.args.args)
            assert getattr(node, "returns", None) is None
        if isinstance(node, ast.Starred):
            assert id(node) in spread, f"line {node.lineno}: only as the last argument of a call"
        if isinstance(node, ast.Raise):
            assert node.cause is None
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id != "super" or node.args
        if isinstance(node, ast.ClassDef):
            assert node.bases, "a class without a base is an old-style class"
