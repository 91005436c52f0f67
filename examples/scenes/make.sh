#!/usr/bin/env bash
# Draws the last frame of every scene: `bash examples/scenes/make.sh [FOLDER]`, by default beside the scenes.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
to=$(cd "${1:-$here}" && pwd)
for scene in "$here"/*.toml; do
    nonsmooth simulate "$scene" --svg "$to/$(basename "$scene" .toml).svg" >/dev/null
    echo "$(basename "$scene" .toml).svg"
done
