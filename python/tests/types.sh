#!/usr/bin/env bash
# Checks the package's types with mypy. usage: python/tests/types.sh PYTHON CACHE_FOLDER
set -euo pipefail
cd "$(dirname "$0")/../.."
"$1" -c 'import mypy' 2>/dev/null || { echo "SKIPPED: mypy is missing"; exit 77; }
exec "$1" -m mypy --cache-dir "$2" python/canyon
