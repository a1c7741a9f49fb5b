"""Compares python/canyon/_canyon.pyi with the extension module: the same names, the same parameters."""

import ast
import inspect
import re
import sys
import unittest
from pathlib import Path

from canyon import _canyon

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from describe_stub import OWN, STUB, described, signature_and_text, stub_with_texts  # noqa: E402

TEXT = ast.parse(STUB.read_text(encoding="utf-8"))


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
            if "__init__" not in inner:  # the module's classes without one cannot be constructed
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

    def test_the_built_stub_has_the_texts_of_the_module_as_well(self):
        built = Path(_canyon.__file__).with_name("_canyon.pyi").read_text(encoding="utf-8")
        self.assertEqual(built, stub_with_texts(_canyon))
        cls = next(n for n in ast.parse(built).body if isinstance(n, ast.ClassDef) and n.name == "Scenario")
        self.assertEqual(ast.get_docstring(cls), inspect.getdoc(_canyon.Scenario))

    def test_every_public_class_and_function_has_a_text(self):
        for node, thing in described(TEXT, _canyon):
            if isinstance(node, ast.ClassDef):
                self.assertTrue(inspect.getdoc(thing), node.name)


if __name__ == "__main__":
    unittest.main()
