"""Writes the stub of the built package: the types of canyon/_canyon.pyi, and the extension's docstrings.

usage: python3 describe_stub.py BUILD/python/canyon/_canyon.pyi, next to the extension
"""

import ast
import importlib
import re
import sys
from pathlib import Path

STUB = Path(__file__).resolve().parent / "canyon" / "_canyon.pyi"
OWN = {"__init__", "__len__", "__iter__", "__next__"}


def signature_and_text(doc):
    """Splits a docstring of pybind11 into "name(parameters) -> type" and its text."""
    head, _, text = (doc or "").partition("\n")
    return head, text.strip() or None


def described(tree, module):
    """Yields each class and function of the stub with its object in the module."""
    for node in tree.body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            yield node, getattr(module, node.name)
            for inner in getattr(node, "body", []):
                if isinstance(inner, ast.FunctionDef) and not any("setter" in ast.unparse(d) for d in inner.decorator_list):
                    yield inner, vars(getattr(module, node.name)).get(inner.name)


def text_of(thing):
    """The docstring of a class, a property or a function; None if it has none."""
    thing = getattr(thing, "__func__", thing)
    doc = thing.__doc__
    return (doc.strip() if doc else None) if isinstance(thing, (type, property)) else signature_and_text(doc)[1]


def stub_with_texts(module):
    """The stub with the module's docstrings."""
    tree = ast.parse(STUB.read_text(encoding="utf-8"))
    for node, thing in described(tree, module):
        text = text_of(thing) if node.name not in OWN else None
        if text:
            indent = "\n" + " " * (node.col_offset + 4)
            lines = re.sub(r"\n +(?=\n|$)", "\n", text.replace("\n", indent)) + (indent if "\n" in text else "")
            node.body.insert(0, ast.Expr(ast.Constant(lines)))
    return ast.unparse(ast.fix_missing_locations(tree)) + "\n"


if __name__ == "__main__":
    out = Path(sys.argv[1]).resolve()
    sys.path.insert(0, str(out.parents[1]))  # before this file's folder, which has the package's source
    try:
        stub = stub_with_texts(importlib.import_module("canyon._canyon"))
    except ImportError as error:
        print(f"The stub has no texts: the extension cannot be imported here ({error}).")
        stub = STUB.read_text(encoding="utf-8")
    out.write_text(stub, encoding="utf-8")
