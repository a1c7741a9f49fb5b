#!/usr/bin/env bash
# The data set of examples/datasets: complete, labelled, split by drive, repeatable; a classifier trains on it.
# usage: tests/datasets.sh CANYON
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
make() { python3 examples/datasets/make.py --canyon "$1" --out "$folder/$2" --drives 3 --seconds 40 --seed 5 2>/dev/null; }
fail() { echo "datasets: $*" >&2; exit 1; }

make "$1" a
make "$1" b
cmp "$folder/a/observations.csv" "$folder/b/observations.csv" || fail "the same seed gives another data set"
python3 - "$folder/a" <<'EOF' || fail "observations.csv is not as docs/datasets.md has it"
import csv, json, pathlib, sys
folder = pathlib.Path(sys.argv[1])
rows = list(csv.DictReader(open(folder / "observations.csv")))
card = json.load(open(folder / "card.json"))
assert len(rows) == sum(card["observations"].values()) > 1000, len(rows)
assert {(row["split"], row["drive"]) for row in rows} == {("train", "1"), ("train", "2"), ("test", "3")}
assert {row["visibility"] for row in rows} >= {"LOS+multipath", "NLOS"}
assert all(float(row["cn0_dbhz"]) > 0 for row in rows)
assert set(card["known_to_a_receiver"] + card["labels"]) <= set(rows[0])
assert (folder / "drives/003/receiver.obs").is_file()
EOF
# Ctrl-C loses no complete drive: the same command continues. Routes stay in the streets.
python3 - "$1" "$folder/c" <<'EOF' || fail "an interrupted call does not say how it goes on"
import pathlib, signal, subprocess, sys, time
canyon, out = sys.argv[1:]
command = ["python3", "examples/datasets/make.py", "--canyon", canyon, "--out", out, "--drives", "3", "--seconds", "40", "--seed", "5"]
with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as made:
    while made.poll() is None and not pathlib.Path(out + ".part/drives/001").exists():
        time.sleep(0.01)
    made.send_signal(signal.SIGINT)
    said = made.communicate()[1]
assert made.returncode != 0 and "the same command continues" in said, said
EOF
python3 examples/datasets/make.py --canyon "$1" --out "$folder/c" --drives 3 --seconds 40 --seed 5 2>"$folder/said" >/dev/null
grep -q "drive 1 of 3 (train), kept" "$folder/said" || fail "a whole drive is made again"
cmp "$folder/a/observations.csv" "$folder/c/observations.csv" || fail "going on gives another data set"
python3 examples/datasets/make.py --canyon "$1" --out "$folder/d" --drives 2 --seconds 100 2>"$folder/said" >/dev/null
if grep "inside a building" "$folder/said"; then fail "a way leads through a house"; fi
if python3 examples/datasets/make.py --canyon "$1" --out "$folder/a" 2>"$folder/said"; then fail "a folder is written over"; fi
grep -q "exists already; remove it" "$folder/said" || fail "no cure for a folder that is there"
python=$(command -v /usr/bin/python3 || command -v python3)
"$python" -c "import sklearn, pandas" 2>/dev/null || { echo "SKIPPED: train.py (no scikit-learn and pandas here)"; exit 0; }
learnt=$("$python" examples/datasets/train.py "$folder/a")
[[ $learnt =~ area\ under\ the\ curve\ 0\.[89] ]] || fail "the classifier does not learn: $learnt"
