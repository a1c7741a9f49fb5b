#!/usr/bin/env python3
"""Number of live receivers that this machine can run: a swarm in the streets of a synthetic downtown, and its cost.

    python3 examples/swarm.py --count 100 --seconds 60

Each vehicle circles its block at 3 m/s, 5 to 25 m above the street, sends four poses per epoch as JSON over UDP,
and gets NMEA over UDP. All are receivers of one `canyon live`, with epochs spread evenly over the interval (`live.stagger`).
Printed at the end: received epochs, epochs skipped because the machine was more than a second late, and
epochs empty because no pose arrived in time; the time from pose to bytes; processor time and memory.
Needs only Python's standard library.
"""
import argparse
import json
import math
import os
import pathlib
import re
import select
import signal
import socket
import subprocess
import sys
import tempfile
import time

BLOCK_M = 76  # from street to street of the synthetic town
SPEED_MPS = 3.0


def arguments_of(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=100, help="receivers (100)")
    parser.add_argument("--seconds", type=float, default=30, help="duration (30)")
    parser.add_argument("--rate", type=float, default=10, help="epochs per second of each receiver (10)")
    parser.add_argument("--profile", default="ublox-m10", help="their profile (ublox-m10)")
    parser.add_argument("--canyon", default="canyon", help="the program (canyon)")
    arguments = parser.parse_args(argv)
    if not (0 < arguments.count <= 10_000 and arguments.seconds > 0 and 0 < arguments.rate <= 100):
        parser.error("give 1 to 10000 receivers, a positive time, and up to 100 epochs per second")
    return arguments


def free_ports(count):
    """One for each vehicle: each source of poses at a port reads all messages there."""
    probes = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(count)]
    for probe in probes:
        probe.bind(("127.0.0.1", 0))
    ports = [probe.getsockname()[1] for probe in probes]
    for probe in probes:
        probe.close()
    return ports


def scenario(arguments, ports, back):
    """The scenario of the swarm, as YAML."""
    blocks = max(4, math.ceil(math.sqrt(arguments.count)))
    names = [f"uav{i}" for i in range(arguments.count)]
    lines = [f"city: {{synthetic: {{seed: 7, blocks_east: {blocks}, blocks_north: {blocks}}}}}",
             "sky: {nominal: true}", "start: 2026-06-01T12:00:00Z", f"rate_hz: {arguments.rate:g}", "receivers:"]
    lines += [f"  - {{name: {name}, profile: {arguments.profile}}}" for name in names]
    lines += ["live:", "  stagger: true", "  poses:"]
    lines += [f"    - {{from: 'udp-listen://127.0.0.1:{port}', receivers: [{name}]}}"
              for name, port in zip(names, ports)]
    lines += ["  streams:"]
    lines += [f"    - {{receiver: {name}, format: nmea, to: 'udp://127.0.0.1:{back}'}}" for name in names]
    return "\n".join(lines) + "\n", blocks


def place(index, blocks, time_s):
    """East, north, up [m] of a vehicle that circles its block, in the middle of the streets."""
    east = (index % blocks - blocks / 2) * BLOCK_M
    north = (index // blocks - blocks / 2) * BLOCK_M
    way = (SPEED_MPS * time_s + 37.0 * index) % (4 * BLOCK_M)
    side, along = int(way // BLOCK_M), way % BLOCK_M
    corner = ((0, 0), (BLOCK_M, 0), (BLOCK_M, BLOCK_M), (0, BLOCK_M))[side]
    step = ((1, 0), (0, 1), (-1, 0), (0, -1))[side]
    return east + corner[0] + along * step[0], north + corner[1] + along * step[1], 5 + 20 * (index % 5) / 4


def memory_mb(pid):
    text = pathlib.Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    found = re.search(r"VmHWM:\s+(\d+) kB", text)
    return int(found.group(1)) / 1024 if found else math.nan


def processor_s(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def fly(arguments, process, ports, blocks, listener):
    """Sends poses until the time is over. Processor time, its fraction of real time, and memory."""
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    poses = 4  # per vehicle in an epoch interval, like a simulator faster than the receiver
    rate = poses * arguments.rate * arguments.count
    begin, sent = time.monotonic(), 0
    used_s = at_s = 0.0
    while process.poll() is None:
        now = time.monotonic() - begin
        if now > arguments.seconds:
            break
        while sent < now * rate:
            time_s, index = sent / rate, sent % arguments.count
            pose = {"time_s": time_s, "position_m": place(index, blocks, time_s)}
            sender.sendto(json.dumps(pose).encode(), ("127.0.0.1", ports[index]))
            sent += 1
        while select.select([listener], [], [], 0)[0]:
            listener.recv(65536)
        if used_s == 0 and now > min(5.0, arguments.seconds / 2):  # without the start
            used_s, at_s = processor_s(process.pid), now
        time.sleep(0.001)
    if process.poll() is not None:
        return None
    share = (processor_s(process.pid) - used_s) / (arguments.seconds - at_s)
    return share, memory_mb(process.pid)


def main(argv=None):
    arguments = arguments_of(argv)
    listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    listener.bind(("127.0.0.1", 0))
    ports = free_ports(arguments.count)
    text, blocks = scenario(arguments, ports, listener.getsockname()[1])
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "swarm.yaml"
        path.write_text(text, encoding="ascii")
        with subprocess.Popen([arguments.canyon, "live", str(path)], stderr=subprocess.PIPE, text=True) as process:
            try:
                said = ""  # until it listens
                while not said.startswith("poses") and process.poll() is None:
                    said = process.stderr.readline() or said
                used = fly(arguments, process, ports, blocks, listener)
            finally:
                process.send_signal(signal.SIGINT)
                rest = process.communicate(timeout=60)[1]
    ended = re.search(r"^ended.*$", rest, re.MULTILINE)
    if used is None or not ended:
        sys.exit("canyon live ended early:\n" + said + rest)
    epochs = re.search(r"(\d+) epochs", ended.group(0))
    missed = re.search(r"(\d+) missed", ended.group(0))
    lost = re.search(r"(\d+) without truth", ended.group(0))
    latency = re.search(r"pose to bytes.*$", ended.group(0))
    cores = len(os.sched_getaffinity(0))
    print(f"{arguments.count} receivers ({arguments.profile}) at {arguments.rate:g} Hz for {arguments.seconds:g} s: "
          f"{epochs.group(1)} epochs, {missed.group(1) if missed else 'none'} missed, {lost.group(1) if lost else 'none'} without a pose in time")
    if latency:
        print(latency.group(0))
    print(f"{100 * used[0]:.0f} % of a core of {cores}, {used[1]:.0f} MB")


if __name__ == "__main__":
    main()
