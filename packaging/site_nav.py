"""Navigation of the site: the groups and pages of docs/README.md, in its order."""

import posixpath
import re
from pathlib import Path


def on_config(config):
    nav = [{"Canyon": "README.md"}, {"New here": ["docs/README.md"]}]
    listed = {"README.md"}
    for line in (Path(config["docs_dir"]) / "docs/README.md").read_text(encoding="utf-8").splitlines():
        if line.startswith("## "):
            nav.append({line[3:]: []})
        for link in re.findall(r"\]\(([\w./-]+\.md)\)", line):
            page = posixpath.normpath("docs/" + link)
            if page not in listed:
                listed.add(page)
                next(iter(nav[-1].values())).append(page)
    config["nav"] = nav
    return config


def on_page_markdown(markdown, page, config, files):
    """`gallery/NAME.html` in a page is a link where that run was made."""
    made = Path(config["docs_dir"]) / "docs"
    link = lambda found: f"[{found[0]}]({found[1]})" if (made / found[1]).exists() and page.file.src_uri.startswith("docs/") else found[0]  # noqa: E731
    return re.sub(r"`(gallery/\w+\.html)`", link, markdown)
