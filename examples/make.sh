#!/usr/bin/env bash
# Makes the examples and their pictures again, by the commands of README.md: `bash examples/make.sh [FOLDER]`, by default where they are.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
cd "${1:-$here}"
grep -E '^nonsmooth .*--(draw|plot) ' "$here/README.md" | bash -euo pipefail
