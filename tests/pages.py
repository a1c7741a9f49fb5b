#!/usr/bin/env python3
"""Checks what pages show against the program: blocks of YAML, XML, JSON and Python, and commands of `canyon` and `./run`.

    yaml      keys and values by `canyon scenario schema`, of a part of a scenario too; a profile, a study, a list of recordings
    xml       well formed; elements of Canyon's plugins are those of docs/reference/sdf.md
    json, python   can be parsed
    commands  in sh blocks and indented ones: subcommand and options are those of --help; files of the repository are there

A block that cannot be checked has `<!-- not checked: WHY -->` before it. A block of commands behind `<!-- runs -->` is run, in a folder with
links to the repository's `examples` and `tests` and the page's files ("Save this as `NAME`:" before a block).

    pages.py CANYON [PAGE...]
"""
import ast
import functools
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import textwrap
import xml.etree.ElementTree as ET

try:
    import yaml
except ImportError:
    print("python3-yaml is not installed")
    sys.exit(77)

ROOT = pathlib.Path(__file__).resolve().parent.parent
BLOCK = re.compile(r"(?P<before>[^\n]*\n\n?)^```(?P<language>\w+)\n(?P<text>.*?)^```$", re.S | re.M)
INDENTED = re.compile(r"^\n((?:    [^\n]+\n)+)", re.M)
CANYON = ""


@functools.lru_cache(maxsize=None)
def printed(*arguments):
    return subprocess.run([CANYON, *arguments], capture_output=True, text=True, timeout=60, check=False).stdout


@functools.lru_cache(maxsize=None)
def schema():
    return json.loads(printed("scenario", "schema"))


@functools.lru_cache(maxsize=None)
def table(page, heading):
    """The keys of a table in docs/reference/."""
    text = (ROOT / "docs/reference" / page).read_text()
    return set(re.findall(r"^\| `([^`]+)` \|", text[text.index(f"\n## {heading}\n"):].split("\n## ")[1], re.M))


def faults_of(value, node, where):
    """Why a value does not fit a node of the schema; what is required may be missing, since a page shows parts."""
    if "anyOf" in node or "oneOf" in node:
        choices = [faults_of(value, choice, where) for choice in node.get("anyOf", node.get("oneOf"))]
        return [] if any(not c for c in choices) else choices[0] or [where]
    if "enum" in node and value not in node["enum"]:
        return [f"{where}: '{value}' is none of {node['enum']}"]
    if isinstance(value, dict):
        found = []
        for key, inner in value.items():
            if key in node.get("properties", {}):
                found += faults_of(inner, node["properties"][key], f"{where}.{key}")
            elif not isinstance(node.get("additionalProperties"), dict):
                found.append(f"{where}: no key '{key}'")
        return found
    if isinstance(value, list):
        found = [] if "items" in node else [f"{where}: no list"]
        for inner in value:
            found += faults_of(inner, node.get("items", {}), where + "[]")
        return found
    types = node.get("type", [])
    types = [types] if isinstance(types, str) else types
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        inside = (node.get("minimum", value) <= value <= node.get("maximum", value)
                  and not value <= node.get("exclusiveMinimum", value - 1) and not value >= node.get("exclusiveMaximum", value + 1))
        return [] if inside else [f"{where}: {value} is out of range"]
    if isinstance(value, bool) and types and "boolean" not in types:
        return [f"{where}: no switch"]
    return []


def paths_of(value, where=""):
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from paths_of(inner, f"{where}.{key}" if where else str(key))
    elif isinstance(value, list) and any(isinstance(inner, dict) for inner in value):
        for inner in value:
            yield from paths_of(inner, where + "[]")
    else:
        yield where


def unknown_keys(value, keys):
    """Paths that are no key, nor below one that takes a whole section."""
    return [path for path in paths_of(value)
            if path not in keys and not any(path.startswith((key + ".", key + "[]")) for key in keys)]


def check_yaml(text):
    value = yaml.safe_load(text)
    if isinstance(value, list) or "from_s" in value:  # faults, or one
        value = {"faults": value if isinstance(value, list) else [value]}
    if "axes" in value:
        scenario = value.get("scenario", {})
        return unknown_keys(value, table("keys.md", "Keys of a study")) + (
            faults_of(scenario, schema(), "scenario") if isinstance(scenario, dict) else [])
    if "recordings" in value:
        return unknown_keys(value, table("keys.md", "Keys of a list of recordings"))
    found = faults_of(value, schema(), "scenario")
    if found:  # a profile, or a receiver's keys
        value.pop("description", None)
        if not faults_of(value, schema()["properties"]["receivers"]["items"], "receiver"):
            return []
    return found


def check_xml(text):
    text = re.sub(r"<\?xml[^>]*\?>", "", text)
    if text.count("<plugin") == 1 and "</plugin>" not in text and "/>" not in text:
        text += "</plugin>"  # its first line alone
    root = ET.fromstring(f'<page xmlns:gz="http://gazebosim.org/schema">{text}</page>')
    receiver, drive = table("sdf.md", "Elements of a receiver"), table("sdf.md", "Elements of a drive plugin")

    def leaves(element, where=""):
        for child in element:
            path = f"{where}.{child.tag}" if where else child.tag
            if len(child):
                yield from leaves(child, path)
            else:
                yield path

    found = []
    for element in root.iter():
        name = element.get("filename", "") + element.get("name", "")
        if element.tag == "plugin" and re.search("CanyonDrive|DriveSystem", name):
            keys = drive
        elif element.tag == "canyon" or (element.tag == "plugin" and re.search("[Mm]ultipath|[Cc]anyon", name)):
            keys = receiver
        else:
            continue
        sections = {key.rsplit(".", 1)[0] for key in keys if "." in key}
        found += [f"<{path}> is no element" for path in leaves(element) if path not in keys and path not in sections]
    return found


def commands_of(text):
    text = text.replace("\\\n", " ")
    for line in text.splitlines():
        line = re.sub(r"\s#.*$", "", line.strip())
        for part in re.split(r"&&|\|\||[|;&]|\$\(", line):
            try:
                words = shlex.split(part, comments=True)
            except ValueError:
                continue
            while words and ("=" in words[0] or words[0] in ("sudo", "time", "nohup", "exec", "mpirun", "srun", "-n", "8", "N", "--mpi=pmix")):
                words.pop(0)
            if words:
                yield words


def check_commands(text):
    found = []
    for words in commands_of(text):
        name = words[0]
        if name.endswith("bin/canyon") or name == "canyon":
            found += check_canyon(words[1:])
        elif name == "./run" and len(words) > 1 and not re.search(rf"^ *(?:[\w|]+\|)?{re.escape(words[1])}(?:\|[\w|]+)?\)", RUN, re.M):
            found.append(f"./run has no {words[1]}")
        for word in words:
            path = word.split("#")[0]
            if re.fullmatch(r"(\./)?(examples|tests|adapters|packaging|profiles)/[\w./-]+", path) and not (ROOT / path).exists():
                found.append(f"no file {path}")
    return found


def check_canyon(words):
    path = []
    help_text = printed("--help")
    while words and not words[0].startswith("-") and re.search(rf"^  {re.escape(words[0])}\b", help_text, re.M):
        path.append(words.pop(0))
        help_text = printed(*path, "--help")
    if not path and words and not words[0].startswith("-"):
        return [f"canyon has no command {words[0]}"]
    known = set(re.findall(r"(?<![\w-])--?[\w][\w-]*", help_text)) | {"--help", "--version"}
    return [f"canyon {' '.join(path)} has no {word.split('=')[0]}" for word in words
            if re.match(r"--?[a-z]", word) and word.split("=")[0] not in known]


RUN = (ROOT / "run").read_text()
CHECKS = {"yaml": check_yaml, "xml": check_xml, "sh": check_commands, "bash": check_commands,
          "json": lambda text: [json.loads(line) for line in text.splitlines()] and [], "python": lambda text: ast.parse(text) and []}


def check_run(text, files):
    with tempfile.TemporaryDirectory() as folder:
        for name in ("examples", "tests"):
            (pathlib.Path(folder) / name).symlink_to(ROOT / name)
        for name, content in files.items():
            (pathlib.Path(folder) / name).write_text(content)
        path = f"{pathlib.Path(CANYON).parent}:{os.environ['PATH']}"
        done = subprocess.run(["bash", "-ec", text], cwd=folder, capture_output=True, text=True, timeout=250, check=False,
                              env={**os.environ, "PATH": path})
        return [] if done.returncode == 0 else [f"exit status {done.returncode}: {done.stderr[-500:]}"]


def check_page(page):
    text = page.read_text()
    count, marked, faults, files = 0, 0, [], {}
    for match in BLOCK.finditer(text):
        if match["language"] not in CHECKS:
            continue
        if "<!-- not checked:" in match["before"]:
            marked += 1
            continue
        count += 1
        if named := re.search(r"Save this as `([\w.]+)`:", match["before"]):
            files[named[1]] = match["text"]
        line = text.count("\n", 0, match.start("text")) + 1
        try:
            found = CHECKS[match["language"]](match["text"])
            if "<!-- runs -->" in match["before"]:
                found = found + check_run(match["text"], files)
        except Exception as error:  # what cannot be parsed
            found = [str(error).splitlines()[0]]
        faults += [f"{page}:{line}: {fault}" for fault in found]
    plain = re.sub(r"```.*?```", lambda m: "\n" * m[0].count("\n"), text, flags=re.S)
    for match in INDENTED.finditer(plain):
        line = plain.count("\n", 0, match.start(1)) + 1
        found = check_commands(match[1])
        if plain[: match.start()].rstrip().endswith("<!-- runs -->"):
            count += 1
            found += check_run(textwrap.dedent(match[1]), files)
        faults += [f"{page}:{line}: {fault}" for fault in found]
    for match in re.finditer(r"`(canyon [^`]+)`", plain):
        line = plain.count("\n", 0, match.start()) + 1
        faults += [f"{page}:{line}: {fault}" for fault in check_commands(match[1]) if "no command" not in fault]
    return count, marked, faults


def main():
    global CANYON
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    CANYON = os.path.abspath(sys.argv[1])
    pages = [pathlib.Path(p) for p in sys.argv[2:]] or [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    results = [check_page(page) for page in pages]
    for _, _, faults in results:
        print("\n".join(faults), end="\n" if faults else "")
    print(f"{sum(r[0] for r in results)} blocks checked, {sum(r[1] for r in results)} marked, {sum(len(r[2]) for r in results)} faults")
    return 1 if any(r[2] for r in results) else 0


if __name__ == "__main__":
    sys.exit(main())
