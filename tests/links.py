"""Prints each link of Markdown files under the working directory to a missing file or heading."""
import os
import pathlib
import re

SKIPPED = {"node_modules", "out", ".git"}


def headings(text):
    names = set()
    for line in re.findall(r"^#+ +(.*)$", text, re.M):
        line = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", line).replace("`", "")
        names.add(re.sub(r"[^\w\- ]", "", line).lower().replace(" ", "-"))
    return names


for page in sorted(pathlib.Path(".").rglob("*.md")):
    if any(part in SKIPPED or part.startswith("build") for part in page.parts):
        continue
    for number, line in enumerate(re.sub(r"```.*?```", lambda m: "\n" * m[0].count("\n"), page.read_text(), flags=re.S).split("\n"), 1):
        for link in re.findall(r"\]\(([^)\s]+)\)", line):
            if re.match(r"[a-z]+:", link):
                continue
            path, _, heading = link.partition("#")
            target = pathlib.Path(os.path.normpath(page.parent / path)) if path else page
            if not target.exists():
                print(f"{page}:{number}: no file {link}")
            elif heading and target.suffix == ".md" and heading not in headings(target.read_text()):
                print(f"{page}:{number}: no heading {link}")
