#!/usr/bin/env bash
# Passes ninja's output on into a log and shows how far it is: one line that is written over on a terminal, else a line
# every half minute.
# usage: cmake --build ... 2>&1 | progress.sh LOG
set -u
shown=$SECONDS width=$(tput cols 2>/dev/null || echo 80)
while IFS= read -r line; do
  printf '%s\n' "$line" >&3
  [[ $line =~ ^\[[0-9]+/[0-9]+\] ]] || continue
  if [ -t 2 ]; then printf '\r\033[K%s' "${line:0:width-1}" >&2
  elif ((SECONDS - shown >= 30)); then printf '    %s\n' "$line" >&2; shown=$SECONDS; fi
done 3>>"$1"
[ ! -t 2 ] || printf '\r\033[K' >&2
