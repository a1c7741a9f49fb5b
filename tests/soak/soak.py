#!/usr/bin/env python3
"""A day of `canyon live` with clients that connect, disconnect, stall and send random bytes, with active faults.

    tests/soak/soak.py CANYON [--hours 24] [--rate 1]

A vehicle circles through a synthetic downtown for this number of hours of its clock, as fast as the program accepts its poses
(`clock: stamps`). Meanwhile one client after the other connects to the receiver's streams and to the control port: some
read, some stop reading, some send random bytes, some reset the connection; faults begin and end. Printed every hour of
the vehicle's clock, and checked at the end: epochs, memory, open files and threads of the program.
Exit status 0: every epoch was received, and between the second hour and the last memory grew by less than 5 %, open files and
threads by none. Run manually: 24 hours take some minutes.
"""
import argparse
import json
import math
import os
import pathlib
import random
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

STREAMS = ("nmea", "ubx", "rtcm", "view", "epochs_csv")
RADIUS_M = 150.0
SPEED_MPS = 4.0

SCENARIO = """city: {{synthetic: {{seed: 7}}}}
sky: {{nominal: true}}
start: 2026-06-01T00:00:00Z
rate_hz: {rate:g}
receivers:
  - {{name: rover, profile: ublox-m10}}
live:
  clock: stamps
  poses: [{{from: "stdin:", format: json}}]
  streams:
{streams}
  control: tcp://127.0.0.1:{control}
  changes: true
"""


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


def state_of(pid):
    """Resident memory [MB], open files, threads."""
    status = pathlib.Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
    fields = dict(line.split(":", 1) for line in status if ":" in line)
    return int(fields["VmRSS"].split()[0]) / 1024, len(os.listdir(f"/proc/{pid}/fd")), int(fields["Threads"])


class Clients:
    """Three threads of clients, each connected for about half a second."""

    def __init__(self, ports, control, seed):
        self.ports, self.control = ports, control
        self.counts = dict.fromkeys(("read", "stalled", "rubbish", "reset", "command", "bad command"), 0)
        self.over = threading.Event()
        self.threads = [threading.Thread(target=self.visit, args=(random.Random(seed + i),)) for i in range(3)]
        self.lock = threading.Lock()

    def visit(self, dice):
        while not self.over.is_set():
            kind = dice.choice(tuple(self.counts))
            port = self.control if "command" in kind else dice.choice(self.ports)
            try:
                with socket.create_connection(("127.0.0.1", port), timeout=2) as client:
                    client.settimeout(0.2)
                    getattr(self, kind.replace(" ", "_"))(client, dice)
                with self.lock:
                    self.counts[kind] += 1
            except OSError:
                pass  # a busy port, or a closed connection
            self.over.wait(0.02)

    def read(self, client, _):
        end = time.monotonic() + 0.5
        while time.monotonic() < end and client.recv(65536):
            pass

    def stalled(self, client, dice):
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        self.over.wait(dice.uniform(0.1, 0.5))

    def rubbish(self, client, dice):
        for _ in range(dice.randrange(1, 20)):
            client.sendall(dice.randbytes(dice.randrange(1, 4096)))

    def reset(self, client, _):
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))

    def command(self, client, dice):
        client.settimeout(5)
        fault = {"duration_s": dice.uniform(1, 300), "outage": {} if dice.random() < 0.3 else {"satellites": ["G05"]}}
        for line in ({"command": "status"}, {"command": "add_fault", "fault": fault}, {"command": "faults"}):
            client.sendall(json.dumps(line).encode() + b"\n")
            client.recv(65536)

    def bad_command(self, client, dice):
        for line in (b"{", b"[]\n", b'{"command": 7}\n', b'{"command": "set", "receiver": "rover", "options": {"x": 1}}\n',
                     dice.randbytes(3000) + b"\n", b'{"command": "add_fault", "fault": {"duration_s": -1, "outage": {}}}\n'):
            client.sendall(line)

    def __enter__(self):
        for thread in self.threads:
            thread.start()
        return self

    def __exit__(self, *_):
        self.over.set()
        for thread in self.threads:
            thread.join()


def ask(control, command):
    with socket.create_connection(("127.0.0.1", control), timeout=20) as client:
        client.sendall(json.dumps(command).encode() + b"\n")
        return json.loads(client.makefile().readline())


def pose(time_s):
    turn = SPEED_MPS * time_s / RADIUS_M
    return {"time_s": time_s, "position_m": [RADIUS_M * math.cos(turn), RADIUS_M * math.sin(turn), 40.0]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("canyon")
    parser.add_argument("--hours", type=float, default=24)
    parser.add_argument("--rate", type=float, default=1, help="epochs a second (1)")
    arguments = parser.parse_args()
    *ports, control = free_ports(len(STREAMS) + 1)
    streams = "\n".join(f'    - {{format: {name}, to: "tcp://127.0.0.1:{port}"}}' for name, port in zip(STREAMS, ports))
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "soak.yaml"
        path.write_text(SCENARIO.format(rate=arguments.rate, streams=streams, control=control), encoding="ascii")
        log = open(pathlib.Path(folder) / "log", "w+", encoding="utf-8")
        process = subprocess.Popen([arguments.canyon, "live", str(path)], stdin=subprocess.PIPE, stderr=log, text=True)
        states, begin = [], time.monotonic()
        try:
            with Clients(ports, control, 1) as clients:
                for step in range(int(arguments.hours * 3600 * arguments.rate) + 1):
                    time_s = step / arguments.rate
                    process.stdin.write(json.dumps(pose(time_s)) + "\n")
                    if step > 0 and step % int(3600 * arguments.rate) == 0:
                        process.stdin.flush()
                        states.append(state_of(process.pid))
                        print(f"{time_s / 3600:4.0f} h  {states[-1][0]:.1f} MB, {states[-1][1]} files, "
                              f"{states[-1][2]} threads, {time.monotonic() - begin:.0f} s", flush=True)
                process.stdin.flush()
                expected = step + 1
                for _ in range(600):  # until it has read them
                    status = ask(control, {"command": "status"})
                    if status["epochs"] >= expected - 1:
                        break
                    time.sleep(0.1)
                print("clients: " + ", ".join(f"{n} {kind}" for kind, n in clients.counts.items()))
            process.stdin.close()
            process.wait(timeout=60)
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
                process.wait(timeout=60)
        log.seek(0)
        text = log.read()
    last = [line for line in text.splitlines() if line.startswith("ended")]
    print(last[-1] if last else text[-2000:])
    problems = []
    if process.returncode != 0:
        problems.append(f"the program ended with status {process.returncode}")
    if status["epochs"] < expected - 1 or status["missed"] > 0:
        problems.append(f"{status['epochs']} epochs of {expected}, {status['missed']} missed")
    if clients.counts["command"] == 0:
        problems.append("no command was answered")
    if len(states) > 2:
        (memory, files, threads), (memory_end, files_end, threads_end) = states[1], states[-1]
        if memory_end > 1.05 * memory + 1:
            problems.append(f"memory grew from {memory:.1f} to {memory_end:.1f} MB")
        if files_end > files + 8 or threads_end > threads:  # present clients have files too
            problems.append(f"open files {files} to {files_end}, threads {threads} to {threads_end}")
    for problem in problems:
        print("soak: " + problem, file=sys.stderr)
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
