#!/usr/bin/env python3
"""Runs the commands in comments of pages, and compares their output with the page.

    <!-- prints: COMMAND -->        before a fenced block: the block is what COMMAND prints (stdout)
    | `MESSAGE` <!-- COMMAND --> |  in a table: COMMAND prints MESSAGE (stdout or stderr)

A command runs in a shell, in an empty folder with links to the repository's `examples` and `tests`. Numbers may
differ by one unit of their last printed digit, and "..." stands for anything.

    printed.py [--only TEXT] [--write] PAGE...      --write: writes the present output to the blocks
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
BLOCK = re.compile(r"<!-- prints: (?P<command>.*?) -->\n\n?```\n(?P<text>.*?)```", re.S)
MESSAGE = re.compile(r"^\| `(?P<text>[^`]*)` <!-- (?P<command>.*?) --> \|", re.M)
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")


def output_of(command):
    with tempfile.TemporaryDirectory() as folder:
        for name in ("examples", "tests"):
            (pathlib.Path(folder) / name).symlink_to(ROOT / name)
        path = f"{pathlib.Path(sys.executable).parent}:{os.environ['PATH']}"  # python3 is this interpreter
        done = subprocess.run(["bash", "-c", command], cwd=folder, capture_output=True, text=True, timeout=280,
                              env={**os.environ, "PATH": path})
        if done.returncode == 77:
            print(done.stdout, done.stderr)
            sys.exit(77)  # skipped
        return done


def same_number(a, b):
    digits = max(len(text.partition(".")[2]) for text in (a, b))
    return abs(float(a) - float(b)) <= 1.001 * 10.0**-digits


def same_line(stated, printed):
    if "..." in stated:
        return re.fullmatch(".*?".join(map(re.escape, stated.split("..."))), printed) is not None
    if NUMBER.sub("#", stated) != NUMBER.sub("#", printed):
        return False
    return all(same_number(a, b) for a, b in zip(NUMBER.findall(stated), NUMBER.findall(printed)))


def differences(stated, printed):
    stated, printed = stated.splitlines(), printed.splitlines()
    lines = [f"  page:    {a}\n  printed: {b}" for a, b in zip(stated, printed) if not same_line(a, b)]
    if len(stated) != len(printed):
        lines.append(f"  page has {len(stated)} lines, {len(printed)} are printed")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="only commands with this text")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("pages", nargs="+", type=pathlib.Path)
    arguments = parser.parse_args()
    checked = 0
    faults = []
    for page in arguments.pages:
        text = page.read_text()

        def compare(match, page=page):
            nonlocal checked
            if arguments.only not in match["command"]:
                return match[0]
            checked += 1
            done = output_of(match["command"])
            printed = done.stdout
            found = differences(match["text"], printed) + ([] if done.returncode == 0 else [f"  fails: {done.returncode}"])
            if not found:
                return match[0]
            if not arguments.write:
                faults.append("\n".join([f"{page}: {match['command']}", *found, done.stderr[-2000:]]))
            return match[0].replace("```\n" + match["text"], "```\n" + printed)

        changed = BLOCK.sub(compare, text)
        if arguments.write and changed != text:
            page.write_text(changed)
        for match in MESSAGE.finditer(text):
            if arguments.only not in match["command"]:
                continue
            checked += 1
            done = output_of(match["command"])
            printed = done.stdout + done.stderr
            if match["text"] not in printed:
                faults.append(f"{page}: {match['command']}\n  page:    {match['text']}\n  printed: {printed[-2000:]}")
    if checked == 0:
        faults.append(f"no command with '{arguments.only}' in {', '.join(map(str, arguments.pages))}")
    print("\n".join(faults) if faults else f"{checked} commands print what the pages say")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
