#!/usr/bin/env bash
# Makes docs/benchmarks-linear.md and its figures, and the plot of times against n, from the problems to the page: `bash docs/benchmarks/linear.sh [FOLDER]`.
# The problems, the runs and the report are kept in FOLDER (target/benchmarks-linear); ended half-way, the same command goes on.
# The machine should have nothing else to do meanwhile.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
work=${1:-target/benchmarks-linear}
mkdir -p "$work/problems"
cargo build --release --quiet
nonsmooth=${CARGO_TARGET_DIR:-target}/release/nonsmooth

# make FAMILY/NAME KIND key=value…
make() {
    local out=$work/problems/$1.toml kind=$2
    shift 2
    [ -f "$out" ] && return
    mkdir -p "$(dirname "$out")"
    local settings=()
    for setting in "$@"; do settings+=(--set "$setting"); done
    "$nonsmooth" gen "$kind" "${settings[@]}" --out "$out" >/dev/null
}
for class in spd m_matrix h_plus p lcprand psd kkt copositive_plus contact bimatrix; do
    for n in 12 60 240; do
        make "$class/$n" lcp class=$class n=$n seed=1
        make "$class/$n-degenerate" lcp class=$class n=$n degenerate=0.3 seed=2
    done
done
for blocks in regular singular_a no_b; do
    for pairs in 12 60 240; do
        make "mlcp_$blocks/$pairs" mlcp blocks=$blocks pairs=$pairs free=$((pairs / 2)) seed=1
        make "mlcp_$blocks/$pairs-degenerate" mlcp blocks=$blocks pairs=$pairs free=$((pairs / 2)) degenerate=0.3 seed=2
    done
done
for n in 10 30 100; do
    make "obstacle/$n" obstacle n=$n
    make "bearing/$n" bearing nx=$n ny=$n
done

solvers=()
for name in auto lemke keller criss_cross block_pivoting ip_mehrotra ip_mty qp newton_min newton_fb newton_pfb psor rpsor mprgp; do
    solvers+=(--solver "$name")
done
"$nonsmooth" bench run "$work/problems" "${solvers[@]}" --tol 1e-10 \
    --time-limit 1 --repeat-below 0.05 --jobs 2 --out "$work/runs.jsonl" --resume
"$nonsmooth" bench report "$work/runs.jsonl" --out "$work/report.html"
"$nonsmooth" bench page "$work/runs.jsonl" --out docs/benchmarks-linear.md \
    --command 'bash docs/benchmarks/linear.sh'
cargo run --release --quiet -p nonsmooth-bench --example scaling -- docs/linear/figures
