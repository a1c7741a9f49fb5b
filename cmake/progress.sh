#!/usr/bin/env bash
# Writes ninja's output to a log and shows the progress, the elapsed time, and the remaining time if the rest takes as long
# per step: one overwritten line on a terminal, else a line every half minute.
# usage: cmake --build ... 2>&1 | progress.sh LOG
set -u
shown=$SECONDS width=$(tput cols 2>/dev/null || echo 80)
clock() { printf '%d:%02d' $(($1 / 60)) $(($1 % 60)); }
while IFS= read -r line; do
  printf '%s\n' "$line" >&3
  [[ $line =~ ^\[([0-9]+)/([0-9]+)\]\ *(.*) ]] || continue
  [ -t 2 ] || ((SECONDS - shown >= 30)) || continue
  shown=$SECONDS done=${BASH_REMATCH[1]} all=${BASH_REMATCH[2]}
  left=''
  ((SECONDS < 5)) || left=", $(clock $((SECONDS * (all - done) / done))) left"
  state="[$done/$all] $(clock "$SECONDS")$left: ${BASH_REMATCH[3]}"
  if [ -t 2 ]; then printf '\r\033[K%s' "${state:0:width-1}" >&2; else printf '    %s\n' "$state" >&2; fi
done 3>>"$1"
[ ! -t 2 ] || printf '\r\033[K' >&2
