#!/usr/bin/env bash
# Lines of source by module, without tests and benchmarks: each folder of canyon/, the command line, each adapter, Python, the viewer.
# usage: tests/lines.sh [ROOT]
set -u
export LC_ALL=C
cd "${1:-$(dirname "$0")/..}" || exit 2
find canyon cli adapters python viewer \( -name node_modules -o -name dist -o -name __pycache__ -o -name build -o -name '*.egg-info' \) -prune -o \
  -type f -regex '.*\.\(cpp\|hpp\|def\|py\|pyi\|ts\|css\|html\|sh\|srv\)' -print 2>/dev/null |
  grep -vE '(_test|_bench)\.|testing/|/test/' | sort | xargs -d '\n' awk '
    FNR == 1 { room = FILENAME
      if (room ~ /^canyon\//) sub("/[^/]*$", "", room)
      else if (room ~ /^adapters\//) { split(room, part, "/"); room = part[1] "/" part[2] }
      else sub("/.*", "", room) }
    { lines[room]++; lines["total"]++ }
    END { for (room in lines) printf "%-28s %6d\n", room, lines[room] }' | sort
