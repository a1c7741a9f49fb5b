"""Compares python/canyon/_canyon.pyi with the extension module: the same names, the same parameters, the same texts.

With --write it puts the module's docstrings into the stub.
"""

import ast
import inspect
import re
import sys
import unittest
from pathlib import Path

from canyon import _canyon

STUB = Path(__file__).resolve().parents[1] / "canyon" / "_canyon.pyi"
OWN = {"__init__", "__len__", "__iter__", "__next__"}
TEXT = ast.parse(STUB.read_text(encoding="utf-8"))


def signature_and_text(doc):
    """A docstring of pybind11's apart: "name(parameters) -> type", and its text."""
    head, _, text = (doc or "").partition("\n")
    return head, text.strip() or None


def parameters(head):
    """[(name, whether it has a default)] of pybind11's signature; None stands for * and /."""
    inner = head[head.index("(") + 1 : head.rindex(") ->")]
    parts, depth = [""], 0
    for c in inner:
        depth += {"[": 1, "(": 1, "{": 1}.get(c, -1 if c in "])}" else 0)
        if c == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += c
    names = [(re.match(r"\W*\w*", p.strip())[0], " = " in p) for p in parts if p.strip()]
    return [n for n in names if n[0] not in ("self", "*", "/")]


def declared(function):
    """The same of a function of the stub."""
    a = function.args
    positional = a.posonlyargs + a.args
    optional = len(positional) - len(a.defaults)
    names = [(p.arg, i >= optional) for i, p in enumerate(positional)]
    names += [(p.arg, d is not None) for p, d in zip(a.kwonlyargs, a.kw_defaults)]
    names += [(f"**{a.kwarg.arg}", False)] if a.kwarg else []
    return [n for n in names if n[0] != "self"]


def members(cls):
    """Functions and properties of a class of the module."""
    return {n: v for n, v in vars(cls).items() if n in OWN or (not n.startswith("__") and n != "_pybind11_conduit_v1_")}


def texts():
    """Each class and function of the stub with its object in the module."""
    for node in TEXT.body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            yield node, getattr(_canyon, node.name)
            for inner in getattr(node, "body", []):
                if isinstance(inner, ast.FunctionDef) and not any("setter" in ast.unparse(d) for d in inner.decorator_list):
                    yield inner, vars(getattr(_canyon, node.name)).get(inner.name)


def text_of(thing):
    if isinstance(thing, staticmethod):
        thing = thing.__func__
    doc = thing.__doc__
    if isinstance(thing, (type, property)):
        return doc.strip() if doc else None
    return signature_and_text(doc)[1]


def described():
    """The stub with the module's texts."""
    for node, thing in texts():
        if ast.get_docstring(node) is not None:
            del node.body[0]
        text = text_of(thing) if node.name not in OWN else None
        if text:
            indent = "\n" + " " * (node.col_offset + 4)
            lines = re.sub(r"\n +(?=\n|$)", "\n", text.replace("\n", indent)) + (indent if "\n" in text else "")
            node.body.insert(0, ast.Expr(ast.Constant(lines)))
        if isinstance(node, ast.ClassDef) or not text:
            node.body = node.body or [ast.Expr(ast.Constant(...))]
    return ast.unparse(ast.fix_missing_locations(TEXT)) + "\n"


class Stub(unittest.TestCase):
    def test_has_the_names_and_parameters_of_the_module(self):
        nodes = {n.name: n for n in TEXT.body if isinstance(n, (ast.ClassDef, ast.FunctionDef))}
        self.assertEqual(sorted(nodes), sorted(n for n in vars(_canyon) if not n.startswith("__")))
        for name, node in nodes.items():
            thing = getattr(_canyon, name)
            if isinstance(node, ast.FunctionDef):
                self.same(name, thing, node)
                continue
            inner = {}
            for each in node.body:
                if isinstance(each, ast.FunctionDef):
                    inner.setdefault(each.name, each)
            known = members(thing)
            if "__init__" not in inner:  # the module's classes without one cannot be made
                known.pop("__init__", None)
            self.assertEqual(sorted(inner), sorted(known), name)
            for member, value in known.items():
                is_property = [ast.unparse(d) for d in inner[member].decorator_list] == ["property"]
                self.assertEqual(is_property, isinstance(value, property), f"{name}.{member}")
                if not is_property:
                    self.same(f"{name}.{member}", value, inner[member])

    def same(self, name, function, node):
        function = function.__func__ if isinstance(function, staticmethod) else function
        head, _ = signature_and_text(function.__doc__)
        found = parameters(head)
        wanted = declared(node)
        if found and found[-1][0] == "**kwargs":
            self.assertTrue(wanted and wanted[-1][0].startswith("**"), name)
            found, wanted = found[:-1], wanted[:-1]
        self.assertEqual(wanted, [f for f in found if not f[0].startswith("arg")], name)

    def test_has_the_texts_of_the_module(self):
        text = STUB.read_text(encoding="utf-8")
        self.assertEqual(ast.dump(ast.parse(described())), ast.dump(ast.parse(text)), "run python/tests/stub_test.py --write")

    def test_every_public_class_and_function_has_a_text(self):
        for node, thing in texts():
            if isinstance(node, ast.ClassDef):
                self.assertTrue(inspect.getdoc(thing), node.name)


if __name__ == "__main__":
    if "--write" in sys.argv:
        STUB.write_text(described(), encoding="utf-8")
    else:
        unittest.main()
