#!/usr/bin/env python3
"""`canyon check` of damaged files of each binary format read by Canyon.

    tests/soak/damages.py CANYON [--count 500] [--only glb,pbf] [--keep FOLDER] [FILE...]

Sources are small files made by the program, by Python and, if installed, by gdal_translate and osmium; or the
given files, a tileset.json with its folder. Each is damaged COUNT times, also within gzip: a bit, a byte, the end
cut off, bytes inserted. Each must be read or rejected, with status 0 or 2, within 30 s and 2 GB; else the exit status is 1,
and --keep has the files.
"""
import argparse
import collections
import gzip
import json
import os
import pathlib
import random
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
import threading
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = ROOT / "tests/data"
SECONDS, KILOBYTES, BATCH = 30, 2_000_000, 25
SCENARIO = """city: {synthetic: {blocks_east: 1, blocks_north: 1, seed: 2}}
sky: {nominal: true}
start: 2026-03-01T10:00:00Z
trajectory: {waypoints: [{east_m: -60, north_m: 0, up_m: 2}, {east_m: 60, north_m: 0, up_m: 2}], speed_mps: 6}
rate_hz: 1
duration_s: 5
outputs: {pictures: false, rtcm: true}
"""
BOX = [(x, y, z) for x in (0, 9) for y in (0, 9) for z in (0, 30)]
SIDES = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (1, 5, 7), (1, 7, 3)]
GML = """<CityModel xmlns="http://www.opengis.net/citygml/2.0" xmlns:gml="http://www.opengis.net/gml" xmlns:bldg="http://www.opengis.net/citygml/building/2.0">
<gml:boundedBy><gml:Envelope srsName="EPSG:25832" srsDimension="3"/></gml:boundedBy><cityObjectMember><bldg:Building gml:id="a"><bldg:lod1MultiSurface><gml:MultiSurface>
%s</gml:MultiSurface></bldg:lod1MultiSurface></bldg:Building></cityObjectMember></CityModel>"""
FACE = "<gml:surfaceMember><gml:Polygon><gml:exterior><gml:LinearRing><gml:posList>%s</gml:posList></gml:LinearRing></gml:exterior></gml:Polygon></gml:surfaceMember>\n"


def made(canyon, folder):
    """Name of a format -> its file."""
    def run(*words):
        subprocess.run([str(w) for w in words], cwd=folder, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    (folder / "drive.yaml").write_text(SCENARIO)
    run(canyon, "city", "build", "drive.yaml", "-o", "city.canyon", "-o", "city.glb", "--quiet")
    run(canyon, "simulate", "drive.yaml", "--out", "drive", "--quiet")
    box = b"".join(struct.pack("<3f", *p) for p in BOX)
    (folder / "box.ply").write_bytes(
        b"ply\nformat binary_little_endian 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
        b"element face 10\nproperty list uchar int vertex_indices\nend_header\n" + box + b"".join(struct.pack("<B3i", 3, *s) for s in SIDES))
    (folder / "box.stl").write_bytes(bytes(80) + struct.pack("<I", 10) + b"".join(
        struct.pack("<12fH", 0, 0, 1, *(c for i in s for c in BOX[i]), 0) for s in SIDES))
    faces = "".join(FACE % " ".join(f"{500000 + BOX[i][0]} {5300000 + BOX[i][1]} {BOX[i][2]}" for i in (*s, s[0])) for s in SIDES)
    with zipfile.ZipFile(folder / "tile.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("tile.gml", GML % faces)
    files = {"canyon": "city.canyon", "glb": "city.glb", "rtcm": "drive/receiver.rtcm3", "ply": "box.ply", "stl": "box.stl",
             "citygml_zip": "tile.zip", "sp3_z": DATA / "cases/containers/day1.sp3.Z", "nav_zip": DATA / "cases/containers/good.n.zip",
             "osm_bz2": DATA / "formats/house.osm.bz2", "pbf": DATA / "formats/house.osm.pbf"}
    for name, source in (("obs_gz", "receiver.obs"), ("nav_gz", "sky.nav"), ("csv_gz", "epochs.csv")):
        files[name] = f"{source}.gz"
        (folder / files[name]).write_bytes(gzip.compress((folder / "drive" / source).read_bytes()))
    (folder / "tileset").mkdir()
    shutil.copy(folder / "city.glb", folder / "tileset/a.glb")
    model = (folder / "city.glb").read_bytes()
    (folder / "tileset/b.b3dm").write_bytes(struct.pack("<4s6I", b"b3dm", 1, 48 + len(model), 20, 0, 0, 0) + b'{"BATCH_LENGTH":0}  ' + model)
    bounds = '"boundingVolume":{"sphere":[0,0,0,300]},"geometricError":'
    (folder / "tileset/tileset.json").write_text(
        f'{{"asset":{{"version":"1.1"}},"geometricError":9,"root":{{{bounds}9,"children":[{{{bounds}0,"content":{{"uri":"a.glb"}}}},{{{bounds}0,"content":{{"uri":"b.b3dm"}}}}]}}}}')
    files["tiles"] = "tileset/tileset.json"
    if shutil.which("gdal_translate"):
        rows = [" ".join(str((i * j) % 37 + .5) for i in range(60)) for j in range(60)]
        (folder / "heights.asc").write_text("ncols 60\nnrows 60\nxllcorner 114.1\nyllcorner 22.2\ncellsize 0.0003\n" + "\n".join(rows) + "\n")
        for name, file, *more in (("geotiff", "g.tif"), ("deflate", "d.tif", "-a_srs", "EPSG:4326", "-co", "COMPRESS=DEFLATE", "-co", "TILED=YES"), ("lzw", "l.tif", "-a_srs", "EPSG:4326", "-co", "COMPRESS=LZW"),
                                  ("hfa", "h.img", "-a_srs", "EPSG:4326", "-of", "HFA"), ("bil", "b.bil", "-a_srs", "EPSG:4326", "-of", "EHdr", "-ot", "Int16"), ("hgt", "N22E114.hgt"), ("dted", "t.dt0")):
            if name in ("hgt", "dted"):
                posts = 1201 if name == "hgt" else 121
                more = ["-of", "SRTMHGT" if name == "hgt" else "DTED", "-ot", "Int16", "-outsize", posts, posts, "-a_srs", "EPSG:4326",
                        "-a_ullr", *((114 - .5 / (posts - 1), 23 + .5 / (posts - 1), 115 + .5 / (posts - 1), 22 - .5 / (posts - 1)))]
            run("gdal_translate", "-q", "-b", "1", *(more or ["-a_srs", "EPSG:4326"]), "heights.asc", file)
            files[name] = file
    if shutil.which("osmium"):
        run("osmium", "cat", DATA / "formats/house.osm.bz2", "-o", "plain.osm.pbf", "-f", "pbf,pbf_compression=none")
        files["pbf_plain"] = "plain.osm.pbf"
    return {name: folder / file for name, file in files.items()}


def damaged(data, draw):
    if data[:2] == b"\x1f\x8b" and draw.random() < 0.5:
        return gzip.compress(damaged(gzip.decompress(data), draw), 1)
    at = draw.randrange(len(data))
    kind = draw.randrange(4)
    if kind == 0:
        return data[:at] + bytes([data[at] ^ 1 << draw.randrange(8)]) + data[at + 1:]
    if kind == 1:
        return data[:at] + draw.choice((b"\0", b"\xff", draw.randbytes(1))) + data[at + 1:]
    if kind == 2:
        return data[:at]
    return data[:at] + draw.randbytes(draw.choice((1, 4, 16))) + data[at:]


def faults(canyon, files):
    """The files for which `canyon check` ends in a forbidden way: (file, reason)."""
    limit = SECONDS if len(files) == 1 else 4 * SECONDS
    said = tempfile.TemporaryFile()
    process = subprocess.Popen([canyon, "check", "--json", *map(str, files)], stdout=said, stderr=subprocess.DEVNULL,
                               preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30)))
    timer = threading.Timer(limit, process.kill)
    timer.start()
    _, status, used = os.wait4(process.pid, 0)
    late = not timer.is_alive()
    timer.cancel()
    process.returncode = status = os.waitstatus_to_exitcode(status)
    seconds = used.ru_utime + used.ru_stime
    if status in (0, 2) and used.ru_maxrss < KILOBYTES and (len(files) > 1 or seconds < SECONDS):
        said.seek(0)
        counts.update(report["usable"] for report in json.load(said))
        return []
    if len(files) > 1:
        return [fault for file in files for fault in faults(canyon, [file])]
    return [(files[0], f"status {status}, {used.ru_maxrss / 1e6:.1f} GB, {seconds:.0f} s{', ended at the limit' if late else ''}")]


def damage(canyon, name, source, count, work):
    draw = random.Random(name)
    parts = [source] if source.name != "tileset.json" else sorted(p for p in source.parent.rglob("*") if p.is_file())
    found, batch = [], []
    for i in range(count):
        part = draw.choice(parts)
        folder = work / f"{name}-{i:04}"
        if len(parts) > 1:
            shutil.copytree(source.parent, folder)
        else:
            folder.mkdir(parents=True)
            if source.suffix == ".bil":
                shutil.copy(source.with_suffix(".hdr"), folder)
        (folder / part.relative_to(source.parent)).write_bytes(damaged(part.read_bytes(), draw))
        batch.append(folder / source.name)
        if len(batch) == BATCH or i + 1 == count:
            bad = faults(canyon, batch)
            found += bad
            for file in {b.parent for b in batch} - {file.parent for file, _ in bad}:
                shutil.rmtree(file)
            batch = []
    return found


parser = argparse.ArgumentParser()
parser.add_argument("canyon")
parser.add_argument("files", nargs="*", type=pathlib.Path)
parser.add_argument("--count", type=int, default=500)
parser.add_argument("--only", default="")
parser.add_argument("--keep", type=pathlib.Path)
options = parser.parse_intermixed_args()
program = str(pathlib.Path(options.canyon).resolve())
with tempfile.TemporaryDirectory(prefix="canyon-damages-") as temporary:
    sources = {file.name: file.resolve() for file in options.files} or made(program, pathlib.Path(temporary))
    ends = 0
    for name, source in sources.items():
        if options.only and name not in options.only.split(","):
            continue
        if subprocess.run([program, "check", str(source)], capture_output=True).returncode != 0:
            print(f"{name}: the sound file is refused")
            ends += 1
        counts = collections.Counter()
        found = damage(program, name, source, options.count, pathlib.Path(temporary) / "damaged")
        print(f"{name:12} {source.stat().st_size:8} bytes: {options.count} damages, {counts[True]} read, {counts[False]} refused, {len(found)} end otherwise", flush=True)
        for file, why in found:
            print(f"  {file.parent.name}: {why}", flush=True)
            if options.keep:
                shutil.copytree(file.parent, options.keep / file.parent.name, dirs_exist_ok=True)
        ends += len(found)
sys.exit(1 if ends else 0)
