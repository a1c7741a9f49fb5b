#!/usr/bin/env python3
"""Puts the command, and every library that is not every Linux's, into a wheel.

    bundle.py WHEEL BUILD OUT

WHEEL is of `pip wheel .`, BUILD the build folder with bin/canyon, OUT the folder for the bundled wheel. Libraries stand in
canyon.libs/ and find each other by relative paths; canyon.libs/licences/ has the copyright file of each library's package.
The wheel says manylinux of this machine's glibc. Needs patchelf and the Python package wheel.
"""
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

# What manylinux (PEP 600) leaves to the system.
SYSTEM = re.compile(r"^(ld-linux.*|lib(c|m|dl|pthread|rt|util|resolv|anl|nsl|crypt|stdc\+\+|gcc_s))\.so")
DATA = {"proj/proj.db": "/usr/share/proj/proj.db", "gdal": "/usr/share/gdal",
        **{f"fonts/{font}.ttf": f"/usr/share/fonts/truetype/dejavu/{font}.ttf" for font in ("DejaVuSans", "DejaVuSans-Bold", "DejaVuSansMono")}}
FONTS = """<?xml version="1.0"?><!DOCTYPE fontconfig SYSTEM "fonts.dtd">
<fontconfig><dir prefix="relative">fonts</dir><cachedir prefix="xdg">fontconfig</cachedir></fontconfig>
"""
# Does not import the package, which takes longer than the command.
SCRIPT = """#!python
import importlib.util as find
from pathlib import Path

place = Path(find.find_spec("canyon").origin).with_name("_command.py")
command = find.spec_from_file_location("canyon_command", place)
module = find.module_from_spec(command)
command.loader.exec_module(module)
module.main()
"""


def run(*command, **options):
    return subprocess.run([str(c) for c in command], check=True, text=True, capture_output=True, **options).stdout


def libraries(binary):
    """Name -> file of all that the loader finds for it but the system's."""
    found = {}
    for line in run("ldd", binary).splitlines():
        match = re.match(r"\s*(\S+) => (/\S+)", line)
        if "not found" in line:
            sys.exit(f"bundle.py: {binary} needs {line.strip()}")
        if match and not SYSTEM.match(match[1]):
            found[match[1]] = Path(match[2])
    return found


def licence_of(library, folder):
    """Copies the copyright file of the package that has it."""
    for path in (library, library.resolve(), Path("/usr" + str(library)), Path(str(library.resolve()).replace("/usr", "", 1))):
        owner = subprocess.run(["dpkg", "-S", str(path)], text=True, capture_output=True)
        if owner.returncode == 0:
            package = owner.stdout.split(":")[0]
            shutil.copyfile(f"/usr/share/doc/{package}/copyright", folder / f"{package}.txt")
            return
    sys.exit(f"bundle.py: no package has {library}: its licence is not known")


def main():
    wheel, build, out = (Path(a).resolve() for a in sys.argv[1:4])
    with tempfile.TemporaryDirectory() as work:
        run(sys.executable, "-m", "wheel", "unpack", wheel, "-d", work)
        (tree,) = Path(work).iterdir()
        bundle, libs = tree / "canyon" / "bundle", tree / "canyon.libs"
        (bundle / "bin").mkdir(parents=True)
        (libs / "licences").mkdir(parents=True)
        program = bundle / "bin" / "canyon"
        shutil.copy(build / "bin" / "canyon", program)
        binaries = {program: "$ORIGIN/../../../canyon.libs"}
        binaries.update({module: "$ORIGIN/../canyon.libs" for module in (tree / "canyon").glob("_canyon*.so")})
        needed = {}
        for binary in binaries:
            needed.update(libraries(binary))
        for name, file in sorted(needed.items()):
            licence_of(file, libs / "licences")
            shutil.copy(file, libs / name)
            (libs / name).chmod(0o755)
            binaries[libs / name] = "$ORIGIN"
        for binary, path in binaries.items():
            run("strip", "--strip-unneeded", binary)
            run("patchelf", "--force-rpath", "--set-rpath", path, binary)
        share = bundle / "share"
        for name, source in DATA.items():
            (share / name).parent.mkdir(parents=True, exist_ok=True)
            (shutil.copytree if os.path.isdir(source) else shutil.copyfile)(source, share / name)
        (share / "fonts.conf").write_text(FONTS)
        root = Path(__file__).resolve().parent.parent
        (share / "canyon").mkdir()
        shutil.copyfile(root / "viewer" / "dist" / "viewer.html", share / "canyon" / "viewer.html")
        shutil.copytree(root / "examples", share / "canyon" / "examples")
        info = next(tree.glob("*.dist-info"))
        scripts = tree / f"{info.stem}.data" / "scripts"
        scripts.mkdir(parents=True)
        (scripts / "canyon").write_text(SCRIPT)
        (scripts / "canyon").chmod(0o755)
        tags = info / "WHEEL"
        glibc = platform.libc_ver()[1].replace(".", "_")
        tags.write_text(re.sub(r"-linux_", f"-manylinux_{glibc}_", tags.read_text()))
        out.mkdir(parents=True, exist_ok=True)
        print(run(sys.executable, "-m", "wheel", "pack", tree, "-d", out).strip().splitlines()[-1])


main()
