"""The folder runs on Python 3.9, the oldest that robots' owners have, and needs nothing but the standard library.

Nobody has five interpreters beside the project's own, so its text is read. Ruff knows the grammar of 3.9 (the target
version in pyproject.toml); this looks for what came later with the library.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[3] / "telepresence" / "naoqi"
FILES = sorted(FOLDER.glob("*.py"))
LATER_MODULES = {"asyncio.runners", "asyncio.taskgroups", "asyncio.timeouts", "tomllib"}
LATER_NAMES = {
    "asyncio": "Barrier BrokenBarrierError Runner TaskGroup Timeout timeout timeout_at eager_task_factory",
    "builtins": "BaseExceptionGroup EncodingWarning ExceptionGroup PythonFinalizationError aiter anext",
    "collections.abc": "Buffer",
    "contextlib": "aclosing chdir",
    "copy": "replace",
    "dataclasses": "KW_ONLY",
    "datetime": "UTC",
    "enum": "EnumCheck FlagBoundary ReprEnum StrEnum global_enum member nonmember property verify",
    "hashlib": "file_digest",
    "inspect": "BufferFlags get_annotations getasyncgenstate getmembers_static markcoroutinefunction",
    "itertools": "batched pairwise",
    "logging": "getHandlerByName getHandlerNames getLevelNamesMapping",
    "math": "cbrt exp2 fma sumprod",
    "operator": "call is_none is_not_none",
    "os": "EFD_CLOEXEC EFD_NONBLOCK eventfd eventfd_read eventfd_write process_cpu_count splice unshare",
    "queue": "ShutDown",
    "socket": "SO_INCOMING_CPU SO_RTABLE",
    "sys": "activate_stack_trampoline exception monitoring orig_argv set_int_max_str_digits stdlib_module_names",
    "threading": "__excepthook__ getprofile gettrace setprofile_all_threads settrace_all_threads",
    "types": "CapsuleType EllipsisType NoneType NotImplementedType UnionType get_original_bases",
    "typing": "Concatenate LiteralString Never NoDefault NotRequired ParamSpec ParamSpecArgs ReadOnly Required Self "
    "TypeAlias TypeAliasType TypeGuard TypeIs TypeVarTuple Unpack assert_never assert_type clear_overloads "
    "dataclass_transform get_overloads get_protocol_members is_protocol is_typeddict override reveal_type",
}
"""Module -> what it has only since Python 3.10 or later."""
LATER_METHODS = {"add_note", "bit_count", "hardlink_to"}
LATER_ARGUMENTS = {
    "zip": {"strict"},
    "dataclass": {"slots", "kw_only", "match_args", "weakref_slot"},
    "bisect": {"key"},
    "bisect_left": {"key"},
    "bisect_right": {"key"},
    "insort": {"key"},
    "Thread": {"context"},
}
TYPES = {
    "bool",
    "bytes",
    "bytearray",
    "dict",
    "float",
    "int",
    "list",
    "memoryview",
    "object",
    "set",
    "str",
    "tuple",
    "type",
}


def _later(tree: ast.Module) -> Iterator[str]:
    """What of a file Python 3.9 does not have."""
    modules = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            modules.update({alias.asname or alias.name: alias.name for alias in node.names})
            yield from (f"module {alias.name}" for alias in node.names if alias.name in LATER_MODULES)
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
            later = LATER_NAMES.get(node.module, "").split()
            yield from (f"{node.module}.{alias.name}" for alias in node.names if alias.name in later)
            if node.module in LATER_MODULES:
                yield f"module {node.module}"
    annotations = set(_annotations(tree))
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            module = modules.get(ast.unparse(node.value), "")
            if node.attr in LATER_METHODS or node.attr in LATER_NAMES.get(module, "").split():
                yield ast.unparse(node)
        elif isinstance(node, ast.Name) and node.id in LATER_NAMES["builtins"].split():
            yield node.id
        elif isinstance(node, ast.Call):
            name = ast.unparse(node.func).rpartition(".")[2]
            yield from (f"{name}({word.arg}=)" for word in node.keywords if word.arg in LATER_ARGUMENTS.get(name, ()))
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitOr) and node not in annotations:
            if any(_is_type(side) for side in (node.left, node.right)):
                yield f"{ast.unparse(node)} outside an annotation"


def _annotations(tree: ast.Module) -> Iterator[ast.AST]:
    """Every node inside an annotation: with `from __future__ import annotations` nothing evaluates those."""
    for node in ast.walk(tree):
        for found in (getattr(node, "annotation", None), getattr(node, "returns", None)):
            if isinstance(found, ast.AST):
                yield from ast.walk(found)


def _is_type(node: ast.expr) -> bool:
    return (isinstance(node, ast.Constant) and node.value is None) or (isinstance(node, ast.Name) and node.id in TYPES)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_a_file_has_nothing_that_came_after_python_3_9(file: Path):
    tree = ast.parse(file.read_text(), feature_version=(3, 9))
    assert list(_later(tree)) == []
    future = [node for node in tree.body if isinstance(node, ast.ImportFrom) and node.module == "__future__"]
    assert future or not list(_annotations(tree)), "from __future__ import annotations"


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_a_file_imports_the_standard_library_and_its_neighbours_alone(file: Path):
    tree = ast.parse(file.read_text())
    absolute = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    absolute |= {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and not node.level}
    others = {name.partition(".")[0] for name in absolute} - set(sys.stdlib_module_names)
    assert others <= {"numpy"}  # and that not at the top, see test_installable_alone.py
    neighbours = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.level]
    assert all(node.level == 1 for node in neighbours), "a copy of the folder is to work under any name"


def test_what_came_later_is_found():
    text = """
import typing, sys
from enum import StrEnum
from collections.abc import Callable
Number = int | float
def f(x: int | None) -> typing.Self: ...
zip(a, b, strict=True)
sys.exception()
n.bit_count()
flags = a | b
"""
    found = set(_later(ast.parse(text)))
    assert found == {
        "enum.StrEnum",
        "int | float outside an annotation",
        "typing.Self",
        "zip(strict=)",
        "sys.exception",
        "n.bit_count",
    }
    with pytest.raises(SyntaxError, match=r"3\.10"):
        ast.parse("match x:\n    case 1: pass", feature_version=(3, 9))
