#!/usr/bin/env python3
"""Puts the command, and every library that is not every Linux's, into a wheel.

    bundle.py WHEEL BUILD OUT

WHEEL is of `pip wheel .`, BUILD the build folder with bin/canyon, OUT the folder for the bundled wheel. Libraries stand in
canyon.libs/ and find each other by relative paths; canyon.libs/licences/ has the copyright file of each library's package.
Distributions build GDAL with some 70 libraries of formats that Canyon never opens (canyon/city/buildings/sources/raster.cpp
names those that it does), and libxml2 with ICU. In their place stand libraries of their names whose functions end the
program.
The wheel says manylinux of this machine's glibc. Needs patchelf, readelf, a C compiler and the Python package wheel.
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
# What these use here of the libraries that they need: PROJ and GeoTIFF; XML in Unicode. The rest is left out.
USED = {"libgdal": re.compile(r"lib(proj|geos_c|tiff|geotiff|z|deflate|lzma|zstd|json-c|expat|pcre2-8|sqlite3|crypto|curl.*)\.so"),
        "libxml2": re.compile(r"lib(z|lzma)\.so")}
STAND_IN = """#include <stdio.h>
#include <stdlib.h>
__attribute__((visibility("hidden"))) void canyon_absent(void) { fputs("canyon: FILE is not part of this wheel\\n", stderr); abort(); }
"""
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


def found_libraries(binary):
    """Name -> file of all that the loader finds for it but the system's."""
    found = {}
    for line in run("ldd", binary).splitlines():
        match = re.match(r"\s*(\S+) => (/\S+)", line)
        if "not found" in line:
            sys.exit(f"bundle.py: {binary} needs {line.strip()}")
        if match and not SYSTEM.match(match[1]):
            found[match[1]] = Path(match[2])
    return found


def system_libraries(binary):
    return [match[2] for match in re.finditer(r"(\S+) => (/\S+)", run("ldd", binary)) if SYSTEM.match(match[1])]


def needed_libraries(roots, files):
    """Names of what they use and of what is left out, of `files` by name."""
    used, left_out, waiting = set(), set(), list(roots)
    while waiting:
        binary = waiting.pop()
        only = next((names for prefix, names in USED.items() if Path(binary).name.startswith(prefix + ".so")), None)
        for name in run("patchelf", "--print-needed", binary).split():
            if name not in files or name in used:
                continue
            if only and not only.match(name):
                left_out.add(name)
                continue
            used.add(name)
            waiting.append(files[name])
    return used, left_out - used


def dynamic_symbols(binary):
    """(name, version, kind, bytes, whether it is defined there) of each."""
    for line in run("readelf", "--dyn-syms", "-W", binary).splitlines():
        fields = line.split()
        if len(fields) > 7 and fields[0].rstrip(":").isdigit() and fields[4] in ("GLOBAL", "WEAK", "UNIQUE"):
            name, _, version = fields[7].replace("@@", "@").partition("@")
            yield name, version, fields[3], int(fields[2], 0), fields[6] != "UND"


def make_stand_in(name, library, wanted, target):
    """A library of that name with those of the wanted (symbol, version) that the real one has."""
    text, versions = STAND_IN.replace("FILE", name), {}
    for i, (symbol, version, kind, size, defined) in enumerate(dynamic_symbols(library)):
        if not defined or (symbol, version) not in wanted:
            continue
        versions.setdefault(version, []).append(symbol)
        if kind in ("OBJECT", "TLS"):
            text += f'{"__thread " if kind == "TLS" else ""}char o{i}[{max(size, 1)}] __asm__("{symbol}") __attribute__((aligned(16)));\n'
        else:
            text += f'void f{i}(void) __asm__("{symbol}"); void f{i}(void) {{ canyon_absent(); }}\n'
    with tempfile.TemporaryDirectory() as work:
        source, script = Path(work) / "absent.c", Path(work) / "absent.map"
        source.write_text(text)
        script.write_text("".join(f'{version} {{ {"; ".join(names)}; }};\n' for version, names in versions.items() if version))
        run("cc", "-shared", "-fPIC", "-Os", "-w", f"-Wl,-soname,{name}", *([f"-Wl,--version-script={script}"] if script.stat().st_size else []),
            source, "-o", target)


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
        late = re.search(r'dlopen\("([^"]*)"', (build / "generated" / "gdal_library.cpp").read_text())[1]
        probe = Path(work) / "late"    # finds the file of a library that is loaded by name
        run("cc", "-x", "c", "-", "-o", probe, "-Wl,--no-as-needed", f"-l:{late}", input="int main(void) { return 0; }")
        files = {}
        for binary in (*binaries, probe):
            files.update(found_libraries(binary))
        used, left_out = needed_libraries((*binaries, probe), files)
        for name in sorted(used):
            licence_of(files[name], libs / "licences")
            shutil.copy(files[name], libs / name)
            (libs / name).chmod(0o755)
            binaries[libs / name] = "$ORIGIN"
        wanted, there = (
            {symbol[:2] for binary in (*binaries, *also) for symbol in dynamic_symbols(binary) if symbol[4] == defined}
            for defined, also in ((False, ()), (True, system_libraries(probe))))
        for name in sorted(left_out):
            make_stand_in(name, files[name], wanted - there, libs / name)
            binaries[libs / name] = "$ORIGIN"
        for binary, path in binaries.items():
            run("strip", "--strip-unneeded", binary)
            run("patchelf", "--force-rpath", "--set-rpath", path, binary)
        for binary in binaries:
            absent = re.findall(r"undefined symbol: (?!_?Py).*", run("ldd", "-r", binary))
            if absent:
                sys.exit(f"bundle.py: {binary.name}: {absent[0]}")
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
