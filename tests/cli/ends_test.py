#!/usr/bin/env python3
"""Ends runs by SIGHUP and SIGKILL at random moments: inputs are kept, outputs are complete or absent, and after the
next run nothing is left except logs of killed live runs. usage: ends_test.py CANYON_PROGRAM"""
import concurrent.futures
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

CANYON = os.path.abspath(sys.argv[1])
MOMENTS = 20
SCENARIO = """\
city: {synthetic: {blocks_east: 3, blocks_north: 3, seed: 2}, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}
sky: {nominal: true}
start: 2026-03-01T10:00:00Z
trajectory: {file: way.csv}
rate_hz: 10
outputs: {pictures: false}
receivers: [{name: rover}]
"""
STUDY = """\
scenario: s.yaml
axes: [{seeds: 6}]
"""
TEMPORARY = re.compile(r"\.part-[0-9a-v]{12}$")
KILLED = re.compile(r"\.killed(-\d+)?$")


def way(seconds):
    rows = ["time,latitude_deg,longitude_deg,height_m"]
    for k in range(seconds + 1):
        rows.append(f"2026-03-01T10:{k // 60:02}:{k % 60:02}Z,{22.2998 + 5e-6 * k:.7f},114.17,3")
    return "\n".join(rows) + "\n"


def files(folder):
    """Bytes by name, without the files that a run keeps for its continuation."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.is_file() and not KILLED.search(name) and not name.startswith(("tiles/", "runs/")) and name != ".canyon-results":
            found[name] = path.read_bytes()
    return found


def check(name, bytes_, whole, cut):
    """A file of an ended run equals that of a complete run, or of its first epochs."""
    if name not in whole:
        raise AssertionError(f"{name} is no file of a whole run")
    if not cut and bytes_ != whole[name]:
        raise AssertionError(f"{name} is cut")
    if cut and name.endswith(".csv") and not (whole[name].startswith(bytes_) and bytes_.endswith(b"\n")):
        raise AssertionError(f"{name} is no beginning of the whole one")


def attempt(command, kind, seed):
    luck = random.Random(seed)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        inputs = {"s.yaml": SCENARIO, "way.csv": way(8), "study.yaml": STUDY}
        inputs["poses.jsonl"] = "".join(
            f'{{"time_s": {0.1 * k:.1f}, "position_m": [{0.3 * k - 40:.1f}, 0, 2]}}\n' for k in range(80))
        for each, text in inputs.items():
            (folder / each).write_text(text)
        words = {
            "simulate": ["simulate", "s.yaml", "--out", "OUT"],
            "heatmap": ["heatmap", "s.yaml", "--out", "OUT", "--spacing", "2", "--tile", "8", "--enu-box=-20,-20,20,20",
                        "--format", "netcdf"],
            "study": ["study", "study.yaml", "--out", "OUT", "--no-pictures"],
            "live": ["live", "s.yaml", "--stamps", "--poses", "file:poses.jsonl", "--stream", "epochs_csv=file:OUT/epochs.csv"],
        }[command]

        def start(out):
            (folder / out).mkdir(exist_ok=True)
            return subprocess.Popen([CANYON, *(word.replace("OUT", out) for word in words), "--quiet"], cwd=folder,
                                    stderr=subprocess.PIPE, stdout=subprocess.DEVNULL)

        begin = time.monotonic()
        first = start("whole")
        complaints = first.communicate()[1].decode()
        assert first.returncode == 0, complaints
        takes = time.monotonic() - begin
        whole = files(folder / "whole")
        ended = 0
        for _ in range(MOMENTS):
            run = start("out")
            time.sleep(luck.uniform(0, takes))
            run.send_signal(kind)
            run.communicate()
            ended += run.returncode != 0
            for path, bytes_ in files(folder / "out").items():
                if not TEMPORARY.search(path):
                    check(path, bytes_, whole, kind == signal.SIGHUP and command in ("simulate", "live"))
                else:
                    assert kind == signal.SIGKILL or run.returncode == -signal.SIGHUP, f"{path} is left"
            if run.returncode == 0:
                shutil.rmtree(folder / "out")
        last = start("out")
        complaints = last.communicate()[1].decode()
        assert last.returncode == 0, complaints
        assert files(folder / "out") == whole, f"other files: {sorted(files(folder / 'out'))}"
        killed = [path for path in folder.rglob("*") if KILLED.search(path.name)]
        assert not killed or command == "live" and kind == signal.SIGKILL, killed
        for path in killed:
            assert whole["epochs.csv"].startswith(path.read_bytes()), f"{path} is no beginning of the whole log"
        left = [str(path) for path in folder.rglob("*") if TEMPORARY.search(path.name) or path.name == "tiles"]
        assert not left, left
        for each, text in inputs.items():
            assert (folder / each).read_text() == text, f"{each} has changed"
        return f"{command} {kind.name}: {ended} of {MOMENTS} ended early, a whole run takes {takes:.2f} s"


def main():
    failed = False
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        jobs = [(pool.submit(attempt, command, kind, seed), command, kind)
                for seed, command in enumerate(("simulate", "heatmap", "study", "live"))
                for kind in (signal.SIGHUP, signal.SIGKILL)]
        for job, command, kind in jobs:
            try:
                print(job.result())
            except AssertionError as error:
                print(f"FAILED: {command} {kind.name}: {error}")
                failed = True
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
