#!/usr/bin/env python3
"""Runs the blocks of pages: every block of shell, YAML, C++ and Python, unless it is marked `<!-- not run: WHY -->`.

    sh        in the page's folder, like a reader's: the repository's examples, the files of tests/pages_files.sh, those that the page
              names ("Save this as `NAME`:" before a block), and what earlier blocks wrote; indented ones and those without a language, too, where
              they begin with a command
    yaml      a scenario, a profile or a study is simulated, a list of recordings validated; a part of a scenario within a small one
    cpp       a program with main() is compiled, linked and run; other blocks of a page are compiled together, each alone or as
              `<!-- within: TEXT BLOCK TEXT -->` says, or in Canyon's source as `<!-- in FILE after: TEXT -->` says
    python    the blocks of a page are run in one interpreter, after its other blocks; results below `>>>` are compared
    xml       a world is read as a city; other elements of Canyon's plugins are compared with those of docs/reference/sdf.md, and not run
    json      is parsed

Commands run with small input: see small(). All blocks, the marked ones too, are first parsed, and commands compared with the program's own lists:
subcommands and options of `canyon` and `./run`, files of the repository.

    pages.py CANYON [PAGE...]         CANYON: BUILD/bin/canyon; libraries and the module are those of BUILD
"""
import ast
import collections
import concurrent.futures
import copy
import doctest
import functools
import inspect
import itertools
import json
import os
import pathlib
import re
import resource
import shlex
import shutil
import signal
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
BLOCK = re.compile(r"^```(?P<language>\w*)\n(?P<text>.*?)^```$", re.S | re.M)
INDENTED = re.compile(r"(?<=\n\n)(?:    [^\n]+\n)+")
COMMAND = re.compile(r" *(\$|apt|canyon|cd|cmake|colcon|export|git|gz|gzserver|make|mavproxy\.py|mkdir|mpirun|pip|ros\w+|sudo|(/usr/bin/)?python3|\./\w+|"
                     r"(examples|tests)/[\w./-]+) ")
COMMENT = re.compile(r"<!-- (?P<kind>not run|within|in (?P<file>\S+) after): (?P<text>.*?) -->")
# Programs that may be missing; a block with a missing one is counted as absent.
OPTIONAL = {"curl", "ffmpeg", "gdalinfo", "gdallocationinfo", "gpsd", "socat", "str2str"}
NO_MODULE = re.compile(r"No module named '(netCDF4|pandas|sklearn|xarray)'")
SERVERS = ("gpsd", "str2str")
# Blocks must not install anything or open a browser.
REFUSED = {"apt": 1, "apt-get": 1, "dpkg": 1, "pip": 1, "podman": 1, "sudo": 1, "xdg-open": 0}
CANYON = ""


@functools.lru_cache(maxsize=None)
def printed(*arguments):
    return subprocess.run([CANYON, *arguments], capture_output=True, text=True, timeout=60, check=False).stdout


@functools.lru_cache(maxsize=None)
def scenario_keys():
    return set(json.loads(printed("scenario", "schema"))["properties"])


@functools.lru_cache(maxsize=None)
def table(page, heading):
    """The keys of a table in docs/reference/."""
    text = (ROOT / "docs/reference" / page).read_text()
    return set(re.findall(r"^\| `([^`]+)` \|", text[text.index(f"\n## {heading}\n"):].split("\n## ")[1], re.M))


def check_xml(text):
    text = re.sub(r"<\?xml[^>]*\?>", "", text)
    if text.count("<plugin") == 1 and "</plugin>" not in text and "/>" not in text:
        text += "</plugin>"  # only its first line
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
            while words and ("=" in words[0] or words[0] in ("sudo", "time", "nohup", "exec", "mpirun", "srun", "-n", "4", "8", "N", "--mpi=pmix", "--bind-to", "none")):
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
CHECKS = {"yaml": yaml.safe_load, "xml": check_xml, "sh": check_commands, "cpp": str,
          "json": lambda text: [json.loads(line) for line in text.splitlines()],
          "python": lambda text: text.startswith(">>>") or ast.parse(text)}


def small(canyon, arguments):
    """`canyon` of the pages, with small input: runs of 20 s, maps of cells of 24 m, the first value of each axis of a study."""
    def given(name, value):
        at = next((i for i, word in enumerate(arguments) if word.split("=")[0] == name), None)
        if at is not None:
            del arguments[at:at + (1 if "=" in arguments[at] else 2)]
        arguments.extend([name, value])

    command = arguments[0] if arguments else ""
    scenario = any(word.endswith(".yaml") for word in arguments[1:2])
    if command in ("simulate", "iq") or (command == "view" and scenario):
        given("--duration", "0.5" if command == "iq" else "20")
    if command == "heatmap" and arguments[1] != "query":
        given("--spacing", "96" if "rtk" in " ".join(arguments) else "24")
        given("--samples", "2")
    if "--ensemble" in arguments:
        given("--ensemble", "2")
    if command == "study" and scenario and "--dry-run" not in arguments:
        study = yaml.safe_load(pathlib.Path(arguments[1]).read_text())
        short = pathlib.Path(arguments[1]).resolve().parent
        if isinstance(study["scenario"], str):
            study["scenario"] = str(short / study["scenario"])
        with tempfile.NamedTemporaryFile("w", suffix=".yaml", dir=".", delete=False) as file:
            yaml.safe_dump(first_values(study), file)
        arguments[1] = file.name
    serves = command == "live" or (command == "view" and not {"--export", "--out", "-o", "--record"} & set(arguments))
    return until_served([canyon, *arguments]) if serves else subprocess.run([canyon, *arguments], check=False).returncode


def first_values(study):
    """A study of one run: the first value of each axis."""
    study = copy.deepcopy(study)
    for axis in study["axes"]:
        for key, few in {"seeds": 1, "unknowns": 2}.items():
            if key in axis:
                axis[key] = few
        for key in ("times", "drives", "range"):
            if isinstance(axis.get(key), dict):
                axis[key].pop("step_s", None)
                axis[key].pop("step", None)
                axis[key]["count"] = 1
        for key in ("values", "labels"):
            if key in axis:
                axis[key] = axis[key][:1]
    if "runs" in study:
        study["runs"] = 2
    return study


def until_served(command):
    """Runs servers: in the background until the block ends, else for 4 s, ended as by Ctrl-C."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # as started by a shell with &
        return subprocess.run(command, check=False).returncode
    with subprocess.Popen(command) as process:
        try:
            return process.wait(timeout=4)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGINT)
        try:
            process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            process.kill()
            return 1
    return 0


def told(call):
    """An expression's value as shown by Python's prompt, or the last line of its exception."""
    try:
        return repr(call())
    except Exception as error:
        return f"{type(error).__module__}.{type(error).__qualname__}: {error}"


class Page:
    """A reader's folder of one page."""

    def __init__(self, folder, files, text):
        self.folder = pathlib.Path(folder)
        shutil.copytree(files, self.folder, symlinks=True, dirs_exist_ok=True)
        for name in re.findall(r"(?:-o|--out) ([\w./-]+)", text):
            if (self.folder / name).is_file():  # made by the page itself
                (self.folder / name).unlink()
        shims = self.folder / ".bin"
        shims.mkdir()
        for name in ("canyon", *SERVERS):
            where = CANYON if name == "canyon" else shutil.which(name)
            (shims / name).write_text(f'#!/bin/sh\nexec {sys.executable} {os.path.abspath(__file__)} --small {name} {where} "$@"\n')
            (shims / name).chmod(0o755)
        for name, status in REFUSED.items():
            (shims / name).write_text(f"#!/bin/sh\necho 'the test of pages runs no {name}: mark the block' >&2\nexit {status}\n")
            (shims / name).chmod(0o755)
        (shims / "python3").symlink_to(sys.executable)
        viewer = self.folder / ".viewer.html"  # the built page is tested in viewer/test
        viewer.write_text("<html><body><!--canyon:data--></body></html>")
        self.environment = {**os.environ, "CANYON_VIEWER": str(viewer), "PATH": f"{shims}:{os.environ['PATH']}", "HOME": str(self.folder), "PYTHONDONTWRITEBYTECODE": "1",
                            "PYTHONPATH": str(BUILD / "python")}
        self.number = 0

    def write(self, text, suffix):
        self.number += 1
        path = self.folder / f"block{self.number}{suffix}"
        path.write_text(text)
        return path.name

    def run(self, command, seconds=120):
        """Faults of a command: its status and the end of its output. Ends all processes started by it."""
        with tempfile.TemporaryFile("w+") as said, subprocess.Popen(
                [*NETWORK, *command], cwd=self.folder, stdout=said, stderr=said, stdin=subprocess.DEVNULL, env=self.environment,
                start_new_session=True) as process:
            try:
                status = process.wait(timeout=seconds)
            except subprocess.TimeoutExpired:
                status = "none: it has run too long"
            try:
                os.killpg(process.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
            process.wait()
            said.seek(0)
            return [] if status == 0 else [f"exit status {status}: {said.read()[-900:].strip()}"]

    def sh(self, text):
        # A user types the next command after the previous one has started.
        script = re.sub(r"&( *#.*)?$", r"& sleep 2", text, flags=re.M).replace("/tmp/", f"{self.folder}/")
        return self.run(["bash", "-ec", script])

    def yaml(self, text):
        value = yaml.safe_load(text.replace("[...]", "null").replace("/tmp/", f"{self.folder}/"))
        if isinstance(value, list) or "from_s" in value:
            value = {"faults": value if isinstance(value, list) else [value]}
        if "axes" in value:
            return self.run(["canyon", "study", self.write(yaml.safe_dump(value), ".yaml"), "--dry-run"]) or self.run(
                ["canyon", "study", self.write(yaml.safe_dump(first_values(value)), ".yaml"), "--out", f"study{self.number}"])
        if "recordings" in value:
            return self.run(["canyon", "validate", self.write(text, ".yaml")])
        if "description" in value:
            value = {"receivers": [{"name": "car", "profile": "./" + self.write(text, ".yaml")}]}
        elif not set(value) <= scenario_keys():
            value = {"receivers": [{"name": "car", **value}]}
        scenario = small_scenario(value)
        name = self.write(yaml.safe_dump(scenario), ".yaml")
        return self.run(["canyon", "simulate", name, "--out", f"out/{name}"]) + (self.run(["canyon", "live", name]) if "live" in value else [])

    def xml(self, text):
        return self.run(["canyon", "city", "info", self.write(text, ".sdf")])

    def python(self, blocks, _):
        (self.folder / "told.py").write_text(inspect.getsource(told))
        program = "from told import told;"
        for line, text in blocks:  # at the page's line numbers
            if text.startswith(">>>"):
                text = "".join(f"said = told(lambda: {example.source.strip()})\nassert said == {example.want.strip()!r}, said\n"
                               for example in doctest.DocTestParser().get_examples(text))
            program += "\n" * (line - 1 - program.count("\n")) + text
        return self.run([sys.executable, self.write(program, ".py")])

    def cpp(self, blocks, page):
        """Programs, edits of sources and other blocks."""
        found, rest, sources = [], [], {}
        for line, text, comment in blocks:
            text = f'#line {line} "{page}"\n{text}'
            if re.search(r"^int main\(", text, re.M):
                name = self.write(text, ".cpp")
                found += self.run([*compiler(), name, "-o", f"./{name}.program", *libraries()]) or self.run([f"./{name}.program", SCENARIO])
            elif comment and comment["file"]:
                path = comment["file"]
                source = sources.get(path) or (ROOT / path).read_text()
                before, after, behind = source.partition(comment["text"])
                if not after:
                    found.append(f"{path} has no '{comment['text']}'")
                sources[path] = f'{before}{after}\n{text}\n#line {before.count(chr(10)) + 1} "{path}"\n{behind}'
            else:
                rest.append(comment["text"].replace("\\n", "\n").replace("BLOCK", "\n" + text) if comment else text)
        for path, text in sources.items():
            (self.folder / "source" / path).parent.mkdir(parents=True, exist_ok=True)
            (self.folder / "source" / path).write_text(text)
        if rest:
            name = self.write('#include "canyon/canyon.hpp"\n#include "canyon/io.hpp"\n' + "\n".join(rest), ".cpp")
            found += self.run([*compiler(), "-fsyntax-only", name])
        for path in sources:
            if path.endswith(".cpp"):
                found += self.run([*compiler("-Isource"), "-fsyntax-only", f"source/{path}"])
        return found


def small_scenario(value):
    """A part of a scenario within a complete one; a complete one unchanged."""
    if {"city", "trajectory", "receivers"} <= set(value):
        return value
    scenario = {"city": {"synthetic": {"seed": 7, "blocks_east": 4, "blocks_north": 4}}, "sky": {"nominal": True}, "start": "2026-06-01T08:00:00Z",
                "trajectory": {"waypoints": [{"east_m": -76, "north_m": 0}, {"east_m": 76, "north_m": 0}], "speed_mps": 8,
                               "height_above_terrain_m": 1.5},
                "receivers": [{"name": "car"}], "duration_s": 20, "rate_hz": 1}
    for key, part in value.items():
        if key == "trajectory" and not part.get("waypoints") and not {"file", "position"} & set(part):
            part = {**scenario[key], **{k: v for k, v in part.items() if v is not None}}
        scenario[key] = part
    if "sensors" in scenario:
        scenario["trajectory"].setdefault("acceleration_mps2", 2)
    names = {receiver.get("name") for receiver in scenario["receivers"]}
    wanted = {r["corrections"]["from"] for r in scenario["receivers"] if "from" in r.get("corrections", {})}
    scenario["receivers"] = scenario["receivers"] + [
        {"name": name, "fixed": {"east_m": 0, "north_m": 76, "up_m": 1.5}} for name in wanted - names]
    return scenario


@functools.lru_cache(maxsize=None)
def pkg_config(what):
    done = subprocess.run(["pkg-config", what, "canyon_io"], env={**os.environ, "PKG_CONFIG_PATH": str(BUILD)}, capture_output=True, text=True,
                          check=True)
    return shlex.split(done.stdout)


def compiler(*first):
    return [os.environ.get("CXX", "g++"), "-std=c++20", *first, f"-I{ROOT}", *pkg_config("--cflags")]


def libraries():
    return [f"-L{BUILD}", "-lcanyon_io", "-lcanyon", *pkg_config("--libs")]


def language_of(text):
    """The default language of a block."""
    return "python" if text.startswith(">>> ") else "sh" if COMMAND.match(text) else ""


def blocks_of(text):
    """(line, language, text, marks by kind) of each block."""
    plain = BLOCK.sub(lambda m: "\n" * m[0].count("\n"), text)
    found = [(m.start("text"), m.start(), m["language"].replace("bash", "sh") or language_of(m["text"]), m["text"]) for m in BLOCK.finditer(text)]
    offset = list(itertools.accumulate((len(line) + 1 for line in text.split("\n")), initial=0))
    for match in INDENTED.finditer(plain):
        if COMMAND.match(match[0]):
            start = offset[plain.count("\n", 0, match.start())]
            found.append((start, start, "sh", textwrap.dedent(match[0])))
    for start, fence, language, content in sorted(found):
        before = re.search(r"(?:[^\n]*\n\s*)?(?:<!--[^\n]*-->\s*)*\Z", text[:fence])[0]
        marks = {("in" if m["file"] else m["kind"]): m for m in COMMENT.finditer(before)}
        yield text.count("\n", 0, start) + 1, language, content, before, marks


def check_page(page, files):
    """(faults, counts) of a page; counts are of (language, what was done)."""
    text = page.read_text()
    shown = page.resolve().relative_to(ROOT) if page.resolve().is_relative_to(ROOT) else page
    counts, faults, later = collections.Counter(), [], collections.defaultdict(list)
    with tempfile.TemporaryDirectory() as folder:
        reader = Page(folder, files, text)
        for line, language, content, before, marks in blocks_of(text):
            if language not in CHECKS:
                continue
            if named := re.search(r"[Ss]ave this as `([\w.]+)`", before):
                (reader.folder / named[1]).write_text(content)
            done = "run"
            try:
                found = CHECKS[language](content)
                found = found if language in ("sh", "xml") else []
                if "not run" in marks:
                    done = "marked"
                elif language == "json" or (language == "xml" and "<world " not in content):
                    done = "checked"
                elif language == "sh" and {words[0] for words in commands_of(content)} & OPTIONAL - present():
                    done = "absent"
                elif language == "python":
                    later["python"].append((line, content))
                elif language == "cpp":
                    later["cpp"].append((line, content, marks.get("within") or marks.get("in")))
                elif not found:
                    found = getattr(reader, language)(content)
                if NO_MODULE.search("".join(found)):
                    found, done = [], "absent"
            except Exception as error:  # text that cannot be parsed
                found = [str(error).splitlines()[0]]
            counts[language, "failed" if found else done] += 1
            faults += [f"{shown}:{line}: {fault}" for fault in found]
        for language, blocks in later.items():
            if language == "python" and not (BUILD / "python").exists():
                counts["python", "absent"] += len(blocks)
                counts["python", "run"] -= len(blocks)
                continue
            found = getattr(reader, language)(blocks, shown)
            if found:
                absent = NO_MODULE.search(found[0])
                counts[language, "absent" if absent else "failed"] += len(blocks)
                counts[language, "run"] -= len(blocks)
                found = [] if absent else found
            faults += [f"{shown}: {language}: {fault}" for fault in found]
    plain = BLOCK.sub(lambda m: "\n" * m[0].count("\n"), text)
    for match in re.finditer(r"`(canyon [^`]+)`", plain):
        line = plain.count("\n", 0, match.start()) + 1
        faults += [f"{shown}:{line}: {fault}" for fault in check_commands(match[1]) if "no command" not in fault]
    return faults, counts


@functools.lru_cache(maxsize=None)
def present():
    return {name for name in OPTIONAL if shutil.which(name)}


@functools.lru_cache(maxsize=None)
def network():
    """A separate network for each command, if the system allows it: pages use the same ports."""
    for option in ("-n", "-rn"):  # as root, and as another user
        command = ["unshare", option, "sh", "-c", 'ip link set lo up && exec "$@"', "sh"]
        if shutil.which("unshare") and subprocess.run([*command, "true"], capture_output=True, check=False).returncode == 0:
            return command
    return []


def main():
    global CANYON, BUILD, NETWORK
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    if sys.argv[1] == "--small":
        sys.exit(small(sys.argv[3], sys.argv[4:]) if sys.argv[2] == "canyon" else until_served(sys.argv[3:]))
    CANYON = os.path.abspath(sys.argv[1])
    BUILD = pathlib.Path(CANYON).parent.parent
    NETWORK = network()
    pages = [pathlib.Path(p) for p in sys.argv[2:]] or [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    with tempfile.TemporaryDirectory() as files, concurrent.futures.ThreadPoolExecutor(2 if NETWORK else 1) as pool:
        subprocess.run([ROOT / "tests/pages_files.sh", CANYON, files], check=True)
        results = list(pool.map(lambda page: check_page(page, files), pages))
    counts = sum((counts for _, counts in results), collections.Counter())
    faults = [fault for found, _ in results for fault in found]
    print("\n".join(faults), end="\n" if faults else "")
    for done in ("run", "checked", "marked", "absent", "failed"):
        each = [f"{count} {language}" for (language, what), count in sorted(counts.items()) if what == done and count]
        print(f"{sum(count for (_, what), count in counts.items() if what == done):4} {done:8} {', '.join(each)}")
    if missing := OPTIONAL - present():
        print(f"absent: blocks with {', '.join(sorted(missing))}")
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"{used.ru_utime + used.ru_stime:.0f} s of processor time")
    return 1 if faults else 0


BUILD, NETWORK, SCENARIO = ROOT / "build-release", [], "examples/synthetic_drive.yaml"

if __name__ == "__main__":
    sys.exit(main())
