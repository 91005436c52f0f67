#!/usr/bin/env bash
# Makes docs/benchmarks.md and its figures, from the problems to the page: `bash docs/benchmarks/make.sh [FOLDER]`.
# The problems, the runs and the report are kept in FOLDER (target/benchmarks); ended half-way, the same command goes on.
# The machine should have nothing else to do meanwhile.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
work=${1:-target/benchmarks}
mkdir -p "$work"
cargo build --release --quiet
nonsmooth=${CARGO_TARGET_DIR:-target}/release/nonsmooth
"$nonsmooth" gen --suite docs/benchmarks/suite.toml --out "$work/problems"
# One or two of each family: all would take hours and say little more.
solvers=()
for name in auto nsgs psor extragradient hyperplane admm proximal/nsgs newton_ac newton_fb \
    tresca panagiotopoulos cadoux ip convex_relaxation; do
    solvers+=(--solver "$name")
done
"$nonsmooth" bench run "$work/problems" "${solvers[@]}" --tol 1e-4 --tol 1e-8 --tol 1e-12 \
    --time-limit 1 --repeat-below 0.05 --jobs 2 --out "$work/runs.jsonl" --resume
"$nonsmooth" bench report "$work/runs.jsonl" --out "$work/report.html"
"$nonsmooth" bench page "$work/runs.jsonl" --problems "$work/problems" --out docs/benchmarks.md \
    --command 'bash docs/benchmarks/make.sh'
