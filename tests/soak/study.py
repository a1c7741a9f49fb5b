#!/usr/bin/env python3
"""A study of 10,000 runs that is killed three times, compared with the same study without interruption.

    tests/soak/study.py CANYON [--runs 10000] [--kills 3] [--threads 0]

Each run is a short drive through a synthetic downtown with its own seed and start. `kill -9` ends the program after some
runs, chosen at random; the same command continues. Checked: no finished run is computed again, the results of both
folders are identical, memory of the program, leftover files. Exit status 0: all checks pass.
Run manually: some minutes.
"""
import argparse
import hashlib
import pathlib
import random
import re
import signal
import subprocess
import sys
import tempfile
import time

STUDY = """scenario:
  city: {{synthetic: {{seed: 7}}}}
  sky: {{nominal: true, systems: [GPS]}}
  start: 2026-06-01T00:00:00Z
  duration_s: 3
  trajectory:
    waypoints: [{{east_m: 0, north_m: 0}}, {{east_m: 60, north_m: 0}}]
    speed_mps: 8
    height_above_terrain_m: 2
  receivers:
    - {{name: module, profile: ideal}}
axes:
  - seeds: {seeds}
  - times: {{from: 2026-06-01T00:00:00Z, span_s: 86400, count: {times}}}
"""


def peak_mb(pid):
    try:
        status = pathlib.Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    except OSError:
        return 0.0
    found = re.search(r"VmHWM:\s+(\d+)", status)
    return int(found[1]) / 1024 if found else 0.0


def command_of(arguments, study, out):
    return [arguments.canyon, "study", str(study), "--out", str(out), "--threads", str(arguments.threads)]


def finished(out):
    """Finished runs in a study's folder: one line each, in a file for each process that computed some."""
    return sum(file.read_bytes().count(b"\n") for file in (out / "runs").glob("*.jsonl"))


def whole(arguments, study, out):
    begun = time.monotonic()
    process = subprocess.Popen(command_of(arguments, study, out), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    text, _ = process.communicate(timeout=3600)
    if process.returncode != 0:
        sys.exit(f"{' '.join(process.args)}: exit status {process.returncode}\n{text}")
    return time.monotonic() - begun


def killed(arguments, study, out, after_s):
    """Starts the study and kills it; the peak of its memory."""
    process = subprocess.Popen(command_of(arguments, study, out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    end, peak = time.monotonic() + after_s, 0.0
    while time.monotonic() < end and process.poll() is None:
        peak = max(peak, peak_mb(process.pid))
        time.sleep(0.05)
    if process.poll() is not None:
        sys.exit("the study ended before it was killed: give more runs")
    process.send_signal(signal.SIGKILL)
    process.wait(timeout=30)
    return peak


def results_of(out):
    """Name and hash of each result."""
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in sorted(out.iterdir()) if file.is_file()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("canyon", help="the program")
    parser.add_argument("--runs", type=int, default=10_000, help="runs of the study (10000)")
    parser.add_argument("--kills", type=int, default=3, help="how often it is killed (3)")
    parser.add_argument("--threads", type=int, default=0, help="of the program (0: one for each core)")
    parser.add_argument("--seed", type=int, default=1, help="of the instants of killing (1)")
    arguments = parser.parse_args()
    draw = random.Random(arguments.seed)
    times = 20
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        study = folder / "study.yaml"
        study.write_text(STUDY.format(seeds=max(1, arguments.runs // times), times=times), encoding="utf-8")
        whole_s = whole(arguments, study, folder / "whole")
        print(f"in one go: {whole_s:.1f} s")
        peak = 0.0
        for kill in range(arguments.kills):
            after_s = whole_s / (arguments.kills + 1) * draw.uniform(0.5, 1.0)
            peak = max(peak, killed(arguments, study, folder / "killed", after_s))
            print(f"killed {kill + 1}: after {after_s:.1f} s, {finished(folder / 'killed')} runs finished")
        rest_s = whole(arguments, study, folder / "killed")
        print(f"the rest: {rest_s:.1f} s; memory at most {peak:.0f} MB")
        one, other = results_of(folder / "whole"), results_of(folder / "killed")
        different = sorted(name for name in one.keys() | other.keys() if one.get(name) != other.get(name))
        if different:
            sys.exit(f"{len(different)} of {len(one)} files differ: {', '.join(different[:10])}")
        count = finished(folder / "whole")
        if finished(folder / "killed") != count:
            sys.exit(f"{finished(folder / 'killed')} runs were computed instead of {count}")
        print(f"{count} runs, each computed once; {len(one)} files, equal to the byte")


if __name__ == "__main__":
    main()
