"""Runs the examples in the docstrings of the package."""

import doctest
import importlib
import pkgutil
import sys

import canyon

failed = tried = 0
for module in [canyon] + [
    importlib.import_module(f"canyon.{info.name}") for info in pkgutil.iter_modules(canyon.__path__)
]:
    result = doctest.testmod(module)
    failed += result.failed
    tried += result.attempted
print(f"{tried} examples, {failed} failed")
sys.exit(failed > 0 or tried < 30)
