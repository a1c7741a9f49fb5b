#!/usr/bin/env python3
"""Counts words that the project replaces by standard terms, and compares the counts with tests/words_budget.txt.

usage: tests/words.py [--list ROW] [--write] [ROOT]

Rows of identifiers count uses of C++ identifiers outside comments and strings, in all C++ files. Rows of prose count
words in comments, in strings and in pages. A count may fall and not rise. --list ROW prints each hit of a row with
file and line; --write stores today's counts. Exit status 1 if a count exceeds the budget.
"""
import argparse
import pathlib
import re
import subprocess
import sys

# Row: (expression of a forbidden identifier, expression of allowed ones). Members named after promised keys, columns
# and options are allowed by name.
# `own` alone is plain English: the value of one item, as opposed to a common value.
IDENTIFIERS = {
    "place": (r"(^|_)place[ds]?(_|$)|(^k?|[a-z])Place(d|s|ment)?s?([A-Z_]|$)|(^|_)placements?(_|$)",
              r"(set_)?placement|Placement|in_place|solveInPlace"),
    "way": (r"(^|_)ways?(_|$)|(^k?|[a-z])Ways?([A-Z_]|$)", r"OsmWay|OneWay|.*WayNode.*|WayBuilder|add_way|way_id|.*osm_ways?(_.*)?"),
    "stated": (r"(^|_)(stated|states_(place|off))(_|$)|Stated", r""),
    "tell": (r"(^|_)(say|says|said|tell|tells|told)(_|$)|^(Say|Said|Told)$", r""),
    "ask": (r"(^|_)(ask|asks|asked|somebody|nobody|whose?)(_|$)|Answer(er|s)?([A-Z_]|$)", r""),
    "anew": (r"(^|_)(anew|begun)(_|$)", r""),
    "beside": (r"(^|_)beside(_|$)|Beside([A-Z_]|$)", r""),
    "stand": (r"(^|_)(stand|stands|standing)(_|$)|Stand(point|still|In|Ins|ing)$", r"stand_in.*"),
    "turn": (r"(^|_)(turn|turns|turned|turning)(_|$)|(^k?|[a-z])Turn(ed|s)?([A-Z_]|$)", r"turn_on(_.*)?|CallbackReturn"),
    "share": (r"(^|_)shares?(_|$)|[a-z]Share([A-Z_]|$)|^k?Share$", r""),
    "draw": (r"(^|_)(draws|drawn)(_|$)|^Draws?$|Drawn|[a-z]Draws?([A-Z_]|$)", r""),
    "figure": (r"(^|_)figures?(_|$)|Figures?([A-Z_]|$)", r".*noise_figure.*"),
    "most": (r"^k(Most|Least|Fewest|Largest|Longest)([A-Z_]|$)|^(most|fewest)(_|$)", r"kMostly.*"),
    "cure": (r"(^|_)cures?(_|$)|Cure([A-Z_]|$)", r""),
    "of": (r"^of_", r"of_type"),
    "own": (r"(^|_)own(_|$)|(^|[a-z])Own([A-Z]|$)", r"is_own.*|own_?"),
    "adjective": (r"^(About|Around|Found|Kept|Known|Met|Near|Now|Once|Seen|Shown|Taken|Told|Thing)$", r""),
    "verb": (r"^(give|lose|miss|feel|settle|hand_on|hand_over|look|went_on|mind_\w+|feel_\w+|miss_\w+|settle_\w+)$", r""),
    "where": (r"(^|_)(elsewhere|behind|anywhere|nowhere)(_|$)", r""),
}

# Files that read OpenStreetMap, where a way is a polyline of nodes.
WAYS = re.compile(r"canyon/city/buildings/|osm_text|ways_bench|paths_bench|load_city_test|area_file_test")
TEST_NAME = re.compile(r"(\bTEST(?:_F|_P)?\(\s*\w+,)\s*\w+\s*\)")

# Words of comments, strings and pages.
PROSE = {
    "nobody": r"nobody|somebody",
    "anew": r"anew",
    "beside": r"beside",
    "stand": r"stands?|stood",
    "tell": r"tells?|told",
    "say": r"says?|said",
    "stated": r"states|stated",
    "ask": r"asks?|asked",
    "turn": r"turns?|turned",
    "share": r"shares?",
    "figure": r"figures?",
    "place": r"places?|placed",
    "way": r"ways?",
    "cure": r"cures?",
    "storey": r"storeys?",
    "who": r"who|whoever",
}

CODE = {".cpp", ".hpp", ".def", ".h"}
SCRIPTS = {".py", ".pyi", ".sh", ".ts", ".js", ".mjs", ".cmake", ".txt", ".yaml", ".yml", ".srv", ".msg", ".in"}
PROSE_ROOTS = ("canyon", "cli", "adapters", "python", "viewer", "examples", "profiles")

TOKEN = re.compile(r"""
    (?P<comment>//(?:[^\\\n]|\\.)*|/\*.*?\*/)
  | (?P<raw>R"(?P<tag>[^(\s]*)\(.*?\)(?P=tag)")
  | (?P<string>"(?:[^"\\\n]|\\.)*")
  | (?P<char>(?<![0-9A-Za-z_])'(?:[^'\\\n]|\\.)+')
  | (?P<include>^[ \t]*\#[ \t]*include[^\n]*)
  | (?P<number>(?<![A-Za-z_])\.?[0-9](?:[0-9A-Za-z_.']|(?<=[eEpP])[+-])*)
  | (?P<name>[A-Za-z_][A-Za-z_0-9]*)
""", re.X | re.S | re.M)


def tracked(root):
    out = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=root, capture_output=True, text=True)
    names = out.stdout.split("\n") if out.returncode == 0 else [str(p.relative_to(root)) for p in root.rglob("*")]
    return sorted(n for n in names if n and (root / n).is_file())


def tokens(text):
    """(kind, text, line) of each comment, string and name of a C++ file."""
    line, last = 1, 0
    for match in TOKEN.finditer(text):
        line += text.count("\n", last, match.start())
        last = match.start()
        yield match.lastgroup if match.lastgroup != "tag" else "raw", match.group(), line


def hits(root):
    """(row, file, line, word) of every hit; rows are identifier:NAME, comment:NAME, string:NAME and page:NAME."""
    forbidden = {row: re.compile(r) for row, (r, _) in IDENTIFIERS.items()}
    allowed = {row: re.compile(f"(?:{a})\\Z") if a else None for row, (_, a) in IDENTIFIERS.items()}
    prose = {row: re.compile(rf"\b(?:{r})\b", re.I) for row, r in PROSE.items()}
    known = {}

    def rows_of(name):
        if name not in known:
            known[name] = [r for r, e in forbidden.items() if e.search(name) and not (allowed[r] and allowed[r].match(name))]
        return known[name]

    def in_prose(kind, file, text, line):
        for row, expression in prose.items():
            for match in expression.finditer(text):
                yield f"{kind}:{row}", file, line + text.count("\n", 0, match.start()), match.group()

    for file in tracked(root):
        suffix = pathlib.Path(file).suffix
        if file.startswith("tests/words"):
            continue
        if suffix in CODE:
            content = TEST_NAME.sub(r"\1 X)", (root / file).read_text(errors="replace"))
            for kind, text, line in tokens(content):
                if kind == "name":
                    for row in rows_of(text):
                        if row == "way" and WAYS.search(file):
                            continue
                        yield f"identifier:{row}", file, line, text
                elif kind in ("comment", "string", "raw") and file.startswith(PROSE_ROOTS):
                    yield from in_prose("comment" if kind == "comment" else "string", file, text, line)
        elif suffix == ".md" and not file.startswith(("CHANGELOG", "docs/reference/")):
            yield from in_prose("page", file, (root / file).read_text(), 1)
        elif suffix in SCRIPTS and file.startswith(PROSE_ROOTS):
            yield from in_prose("script", file, (root / file).read_text(errors="replace"), 1)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", metavar="ROW")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("root", nargs="?", default=pathlib.Path(__file__).parent.parent, type=pathlib.Path)
    options = parser.parse_args()
    counts = {f"identifier:{r}": 0 for r in IDENTIFIERS}
    counts |= {f"{kind}:{r}": 0 for kind in ("comment", "string", "script", "page") for r in PROSE}
    found = {row: [] for row in counts}
    for row, file, line, word in hits(options.root):
        counts[row] += 1
        found[row].append(f"{file}:{line}: {word}")
        if options.list and row.startswith(options.list):
            print(f"{file}:{line}: {row}: {word}")
    if options.list:
        return 0
    budget_file = options.root / "tests/words_budget.txt"
    head = "# Uses of words that the project replaces by standard terms (tests/words.py --list ROW prints them). A count falls; it does not rise.\n"
    if options.write:
        budget_file.write_text(head + "".join(f"{row} {n}\n" for row, n in counts.items()))
        return 0
    if not budget_file.exists():
        return 0
    budget = dict(line.split() for line in budget_file.read_text().splitlines() if line and line[0] != "#")
    over = [(row, n, int(budget.get(row, 0))) for row, n in counts.items() if n > int(budget.get(row, 0))]
    for row, n, limit in over:
        print(f"{found[row][0]}: {row}: {n} uses, {limit} allowed; `tests/words.py --list {row}` prints them")
        if limit == 0:
            print("\n".join(f"{hit}: {row}" for hit in found[row][1:]))
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main())
