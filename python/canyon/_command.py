"""Parts of a wheel other than the module: the command `canyon`, and data of bundled libraries."""

import os
import sys
from pathlib import Path

BUNDLE = Path(__file__).parent / "bundle"


def use_bundle() -> None:
    """Sets the paths to data of bundled libraries, unless already set."""
    share = BUNDLE / "share"
    if not share.is_dir():
        return
    os.environ.setdefault("PROJ_DATA", str(share / "proj"))
    os.environ.setdefault("GDAL_DATA", str(share / "gdal"))
    if not Path("/etc/fonts/fonts.conf").exists():
        os.environ.setdefault("FONTCONFIG_FILE", str(share / "fonts.conf"))


def main() -> None:
    """Replaces the process by the program."""
    use_bundle()
    program = str(BUNDLE / "bin" / "canyon")
    os.execv(program, [program, *sys.argv[1:]])
