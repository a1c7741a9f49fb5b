"""What a wheel has beside the module: the command `canyon`, and the data of the libraries that it carries."""

import os
import sys
from pathlib import Path

BUNDLE = Path(__file__).parent / "bundle"


def use_bundle() -> None:
    """Says where the data of bundled libraries are, where nothing else says so."""
    share = BUNDLE / "share"
    if not share.is_dir():
        return
    os.environ.setdefault("PROJ_DATA", str(share / "proj"))
    os.environ.setdefault("GDAL_DATA", str(share / "gdal"))
    if not Path("/etc/fonts/fonts.conf").exists():
        os.environ.setdefault("FONTCONFIG_FILE", str(share / "fonts.conf"))


def main() -> None:
    """Becomes the program."""
    use_bundle()
    program = str(BUNDLE / "bin" / "canyon")
    os.execv(program, [program, *sys.argv[1:]])
