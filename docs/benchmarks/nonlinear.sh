#!/usr/bin/env bash
# Makes docs/benchmarks-nonlinear.md and its figures, from the problems to the page: `bash docs/benchmarks/nonlinear.sh [FOLDER]`.
# The problems are those of $NONSMOOTH_CORPUS/mcp where that is set, one file a start, with a manifest.csv that has what other programs reach; else docs/benchmarks/suite-nonlinear.toml.
# The problems, the runs and the report are kept in FOLDER (target/benchmarks-nonlinear); ended half-way, the same command goes on.
# The machine should have nothing else to do meanwhile.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
work=${1:-target/benchmarks-nonlinear}
mkdir -p "$work/problems"
cargo build --release --quiet
nonsmooth=${CARGO_TARGET_DIR:-target}/release/nonsmooth

manifest=()
if [ -d "${NONSMOOTH_CORPUS:-}/mcp" ]; then
    corpus=$(realpath "$NONSMOOTH_CORPUS/mcp")
    manifest=("$corpus/manifest.csv")
    # A family is a problem with all its starts, PNN_NAME_sK.nl; those with the number 37 are one family of small problems.
    # Files that state the same problems as other programs write them are left out.
    for file in "$corpus"/P[0-9][0-9]_*.nl; do
        name=$(basename "$file" .nl)
        family=${name#P??_}
        family=${family%_s[0-9]}
        case $name in P37_*) family=degenerate_ncp ;; esac
        mkdir -p "$work/problems/$family"
        ln -sf "$file" "$work/problems/$family/$name.nl"
    done
else
    "$nonsmooth" gen --suite docs/benchmarks/suite-nonlinear.toml --out "$work/problems" >/dev/null
fi

solvers=()
for name in auto miles path ne_sqp qpcomp smooth proxi semismooth semicomp; do
    solvers+=(--solver "$name")
done
"$nonsmooth" bench run "$work/problems" "${solvers[@]}" --tol 1e-6 \
    --time-limit 5 --repeat-below 0.05 --jobs 2 --out "$work/runs.jsonl" --resume
"$nonsmooth" bench report "$work/runs.jsonl" --out "$work/report.html"
"$nonsmooth" bench page "$work/runs.jsonl" --out docs/benchmarks-nonlinear.md \
    --command 'bash docs/benchmarks/nonlinear.sh'
cargo run --release --quiet -p nonsmooth-figures --example nonlinear -- "$work/runs.jsonl" "${manifest[@]}" \
    >>docs/benchmarks-nonlinear.md
