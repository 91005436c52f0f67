#!/usr/bin/env bash
# Makes docs/benchmarks-linear.md and its figures, and the plot of times against n, from the problems to the page: `bash docs/benchmarks/linear.sh [FOLDER]`.
# The problems, the runs and the report are kept in FOLDER (target/benchmarks-linear); ended half-way, the same command goes on.
# The machine should have nothing else to do meanwhile.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
work=${1:-target/benchmarks-linear}
mkdir -p "$work"
cargo build --release --quiet
nonsmooth=${CARGO_TARGET_DIR:-target}/release/nonsmooth

"$nonsmooth" gen --suite docs/benchmarks/suite-linear.toml --out "$work/problems" >/dev/null

solvers=()
for name in auto lemke lemke_howson keller criss_cross block_pivoting ip_mehrotra ip_mty qp newton_min newton_fb newton_pfb pgs psor rpsor mprgp tnnmg split/lemke split/ip_mehrotra; do
    solvers+=(--solver "$name")
done
"$nonsmooth" bench run "$work/problems" "${solvers[@]}" --tol 1e-10 \
    --time-limit 0.5 --repeat-below 0.05 --jobs 2 --out "$work/runs.jsonl" --resume
"$nonsmooth" bench report "$work/runs.jsonl" --out "$work/report.html"
"$nonsmooth" bench page "$work/runs.jsonl" --out docs/benchmarks-linear.md \
    --command 'bash docs/benchmarks/linear.sh'
cargo run --release --quiet -p nonsmooth-figures --example scaling -- docs/linear/figures
