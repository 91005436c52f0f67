#!/usr/bin/env bash
# Makes docs/benchmarks.md and docs/benchmarks-large.md with their figures, from the problems to the pages: `bash docs/benchmarks/make.sh [FOLDER]`.
# The problems, the runs and the reports are kept in FOLDER (target/benchmarks); ended half-way, the same command goes on.
# The machine should have nothing else to do meanwhile: half an hour on two cores.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
work=${1:-target/benchmarks}
mkdir -p "$work"
cargo build --release --quiet
nonsmooth=${CARGO_TARGET_DIR:-target}/release/nonsmooth

# make PAGE SUITE RUNS SOLVER... -- OPTION...: runs the solvers on a suite and writes the page.
make() {
    local page=$1 suite=$2 runs=$work/$3 solvers=()
    shift 3
    while [ "$1" != -- ]; do
        solvers+=(--solver "$1")
        shift
    done
    shift
    "$nonsmooth" gen --suite "docs/benchmarks/$suite" --out "$runs-problems"
    "$nonsmooth" bench run "$runs-problems" "${solvers[@]}" "$@" --jobs 2 --out "$runs.jsonl" --resume
    "$nonsmooth" bench report "$runs.jsonl" --out "$runs.html"
    "$nonsmooth" bench page "$runs.jsonl" --problems "$runs-problems" --out "docs/$page" \
        --command 'bash docs/benchmarks/make.sh'
}

# One or two of each family: all would take hours and say little more.
make benchmarks.md suite.toml runs \
    auto nsgs psor extragradient hyperplane admm proximal/nsgs newton_ac newton_fb \
    tresca panagiotopoulos cadoux ip convex_relaxation -- \
    --tol 1e-4 --tol 1e-8 --tol 1e-12 --time-limit 1 --repeat-below 0.05
# Those that can be expected to solve something.
make benchmarks-large.md suite-large.toml large \
    auto nsgs admm proximal/nsgs newton_ac ip -- \
    --tol 1e-4 --tol 1e-8 --time-limit 20 --repeat-below 0.05
