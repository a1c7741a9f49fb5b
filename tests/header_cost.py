#!/usr/bin/env python3
"""Compile time of each public header (those that canyon.hpp and io.hpp include) as a multiple of <Eigen/Dense>'s.

usage: tests/header_cost.py [--all] [CXX]
Exit status 1 if a header exceeds its limit in each of three measurements. --all prints every header. User time of the
compiler's front end, GCC or Clang, with the flags of a program that includes the installed library.
"""
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys

UMBRELLAS = ("canyon/canyon.hpp", "canyon/io.hpp")
UMBRELLA_LIMIT, LIMIT = 4.0, 3.0  # docs/architecture.md has the targets: 3 and 2
ATTEMPTS = 3


def public_headers(root: pathlib.Path) -> list[str]:
    """The umbrella headers and all headers of Canyon that these include."""
    found: dict[str, None] = {}
    pending = list(UMBRELLAS)
    while pending:
        header = pending.pop()
        if header in found or not (root / header).exists():
            continue
        found[header] = None
        pending += re.findall(r'^#include "(canyon/[^"]+\.hpp)"', (root / header).read_text(), re.M)
    return sorted(found)


def seconds(compiler: str, include: str) -> float:
    """User time of a translation unit with this one include [s]. Raises RuntimeError if it does not compile."""
    eigen = os.environ.get("CANYON_EIGEN", "/usr/include/eigen3")
    command = [compiler, "-std=c++20", "-fsyntax-only", "-I.", "-isystem", eigen, "-x", "c++", "-"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        process.stdin.write(f"#include {include}\n")
        process.stdin.close()
        errors = process.stderr.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise RuntimeError(f"{include} does not compile alone:\n{errors}")
    return usage.ru_utime


def main() -> int:
    arguments = [a for a in sys.argv[1:] if a != "--all"]
    compiler = arguments[0] if arguments else os.environ.get("CXX", "c++")
    root = pathlib.Path(__file__).resolve().parent.parent
    os.chdir(root)
    pending = public_headers(root)
    limit = {header: UMBRELLA_LIMIT if header in UMBRELLAS else LIMIT for header in pending}
    ratio = {header: float("inf") for header in pending}
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for _ in range(ATTEMPTS):
            # Between the headers, so that other load slows both alike.
            dense = pool.map(lambda _: seconds(compiler, "<Eigen/Dense>"), range(3))
            times = list(pool.map(lambda header: seconds(compiler, f'"{header}"'), pending))
            unit = sorted(dense)[1]
            for header, time in zip(pending, times):
                ratio[header] = min(ratio[header], time / unit)
            pending = [header for header in pending if ratio[header] > limit[header]]
            if not pending:
                break
    slowest = sorted(ratio, key=ratio.get, reverse=True)
    for header in slowest if "--all" in sys.argv else slowest[:5]:
        print(f"{ratio[header]:5.2f} {header}")
    for header in pending:
        print(f"header_cost: {header} takes {ratio[header]:.2f} times as long as <Eigen/Dense>, at most {limit[header]:g}; "
              "include less, or move inline functions that use Eigen to its source file", file=sys.stderr)
    return 1 if pending else 0


if __name__ == "__main__":
    sys.exit(main())
