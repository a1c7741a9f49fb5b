#!/usr/bin/env bash
# Runs the fuzz targets one after the other. What they find is written to tests/fuzz/findings/TARGET, where the ordinary
# tests replay it; what reached new code stays in BUILD/corpus/TARGET for the next time.
# usage: fuzz.sh BUILD MINUTES [TARGET...]
set -euo pipefail
cd "$(dirname "$0")/../.."
fuzzer=$1/bin/canyon_fuzz
minutes=${2:?"say how many minutes: ./run fuzz MINUTES [TARGET...]"}
seconds=$(awk "BEGIN {print int($minutes * 60)}")
targets=("${@:3}")
[ ${#targets[@]} -gt 0 ] || read -r -a targets < <("$fuzzer" 2>&1 | sed -n 's/.*must be one of: //p')
export TMPDIR=/dev/shm UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1
ulimit -n "$(ulimit -Hn)"    # libosmium leaves a file open for each damaged PBF
found=0
for target in "${targets[@]}"; do
  corpus=$1/corpus/$target log=$1/fuzz-$target.log examples=()
  [ "$target" != scenario ] || examples=(examples profiles)
  mkdir -p "$corpus" "tests/fuzz/findings/$target"
  CANYON_FUZZ_TARGET=$target CANYON_FUZZ_SEEDS=$corpus "$fuzzer" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=2048 \
    -max_len=16384 -artifact_prefix="tests/fuzz/findings/$target/" -print_final_stats=1 "$corpus" "${examples[@]}" >"$log" 2>&1 || found=1
  # libFuzzer's line of counters: cov (edges), ft (features), corp (kept inputs).
  echo "$target: $(sed -n 's/^stat::number_of_executed_units: *//p' "$log") executions, $(grep -oE 'cov: .*corp: [0-9]+' "$log" | tail -n 1)"
  grep -E '^(SUMMARY|.*Test unit written to)' "$log" || true
  rmdir "tests/fuzz/findings/$target" 2>/dev/null || true
done
[ $found -eq 0 ] || { echo "findings are in tests/fuzz/findings: mend them and keep them" >&2; exit 1; }
