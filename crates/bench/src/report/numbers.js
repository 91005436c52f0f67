// The data of the page and everything that is counted from it. No drawing, no page.
//
// A selection names what is looked at: { tolerance, families, sizes, kinds, solvers }, each but the tolerance an array
// of truth values by index. P is the set of its problems for which at least one of its solvers has a run.

const data = JSON.parse(document.getElementById("data").textContent);

const SOLVED = 0;
const BEST = -1; // Stands for the virtual best among the solvers of a selection.

/** A column of numbers as it was embedded: absent, or with null where the value is not known. */
function floats(values, n) {
  const column = new Float64Array(n).fill(NaN);
  if (values) values.forEach((v, k) => { if (v !== null) column[k] = v; });
  return column;
}

const nRuns = data.runs.problem.length;
const nProblems = data.problems.name.length;
const nSolvers = data.solvers.length;
const nTolerances = data.tolerances.length;

const runs = {
  ...data.runs,
  ...Object.fromEntries(["iterations", "factorisations", "seconds", "reached", "peak_memory"].map(name => [name, floats(data.runs[name], nRuns)])),
};

const sizeOf = data.problems.contacts.map(nc => {
  const k = data.sizes.findIndex(s => s.most === null || nc <= s.most);
  return k < 0 ? data.sizes.length - 1 : k;
});

/** The run of (problem, solver, tolerance), or -1. */
const runIndex = new Int32Array(nProblems * nSolvers * nTolerances).fill(-1);
const runAt = (p, s, k) => runIndex[(p * nSolvers + s) * nTolerances + k];
for (let r = 0; r < nRuns; r++) {
  runIndex[(runs.problem[r] * nSolvers + runs.solver[r]) * nTolerances + runs.tolerance[r]] = r;
}

// Costs: what they are called, and the floor of a cost of zero.
const COSTS = {
  seconds: { name: "time", floor: 1e-9 },
  iterations: { name: "iterations", floor: 1 },
  factorisations: { name: "factorisations", floor: 1 },
};

/** Per column whether any run of a solver has a value there: a solver without any is left out of a figure, not failed. */
const known = Object.fromEntries([...Object.keys(COSTS), "reached"].map(name => {
  const has = new Array(nSolvers).fill(false);
  for (let r = 0; r < nRuns; r++) if (!Number.isNaN(runs[name][r])) has[runs.solver[r]] = true;
  return [name, has];
}));

/** t_ps: the cost of a run that solved, else Infinity; -1 stands for a run that is missing. */
function costOf(r, cost) {
  if (r < 0 || runs.ending[r] !== SOLVED || Number.isNaN(runs[cost][r])) return Infinity;
  return Math.max(runs[cost][r], COSTS[cost].floor);
}

const passes = (selection, p) => selection.families[data.problems.family[p]]
  && selection.kinds[data.problems.kind[p]] && selection.sizes[sizeOf[p]];

const indices = flags => flags.flatMap((on, k) => (on ? [k] : []));

const ALL_TOLERANCES = data.tolerances.map((_, k) => k);

/** P, by the runs at the selection's tolerance or at others. */
function problemsOf(selection, tolerances = [selection.tolerance]) {
  const solvers = indices(selection.solvers);
  const found = [];
  for (let p = 0; p < nProblems; p++) {
    if (passes(selection, p) && solvers.some(s => tolerances.some(k => runAt(p, s, k) >= 0))) found.push(p);
  }
  return found;
}

/** The right-continuous step function x ↦ |{v ≤ x}| / count of some values; Infinity never counts. */
function steps(values, count) {
  const sorted = Float64Array.from(values.filter(Number.isFinite)).sort();
  const x = [];
  const y = [];
  sorted.forEach((v, k) => {
    if (k + 1 < sorted.length && sorted[k + 1] === v) return;
    x.push(v);
    y.push((k + 1) / count);
  });
  return { x, y };
}

function median(values) {
  if (values.length === 0) return NaN;
  const sorted = Float64Array.from(values).sort();
  const half = sorted.length >> 1;
  return sorted.length % 2 ? sorted[half] : (sorted[half - 1] + sorted[half]) / 2;
}

/** Ratios r_ps = t_ps / min_s t_ps by solver, over P, of the solvers whose cost is known. */
function ratios(selection, cost) {
  const problems = problemsOf(selection);
  const selected = indices(selection.solvers);
  const solvers = selected.filter(s => known[cost][s]);
  const bySolver = new Map(solvers.map(s => [s, []]));
  const least = problems.map(p => {
    const costs = solvers.map(s => costOf(runAt(p, s, selection.tolerance), cost));
    const best = Math.min(Infinity, ...costs);
    solvers.forEach((s, k) => bySolver.get(s).push(costs[k] === Infinity ? Infinity : costs[k] / best));
    return best;
  });
  return { problems, solvers, bySolver, least, leftOut: selected.filter(s => !known[cost][s]) };
}

/** Performance profiles: the share of P with r_ps ≤ τ. */
function performanceProfile(selection, cost) {
  const { problems, solvers, bySolver, least, leftOut } = ratios(selection, cost);
  const n = problems.length;
  const curves = solvers.map(s => ({ solver: s, ...steps(bySolver.get(s), n) }));
  if (n > 0 && solvers.length > 1) curves.push({ solver: BEST, ...steps(least.map(t => (t < Infinity ? 1 : t)), n) });
  return { problems: n, curves, leftOut };
}

/** Of each (problem, solver) the times at which its best residual fell, over all its runs: [times, residuals]. */
const progress = new Map();
function progressOf(p, s) {
  const key = p * nSolvers + s;
  let found = progress.get(key);
  if (found) return found;
  const points = [];
  for (let k = 0; k < nTolerances; k++) {
    const r = runAt(p, s, k);
    if (r < 0) continue;
    const trace = data.traces[r];
    if (trace) trace[0].forEach((t, i) => points.push([t, trace[1][i]]));
    if (!Number.isNaN(runs.seconds[r]) && !Number.isNaN(runs.reached[r])) points.push([runs.seconds[r], runs.reached[r]]);
  }
  points.sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  found = [[], []];
  let best = Infinity;
  for (const [t, residual] of points) {
    if (residual >= best) continue;
    best = residual;
    found[0].push(t);
    found[1].push(residual);
  }
  progress.set(key, found);
  return found;
}

function firstTime(p, s, epsilon) {
  const [times, residuals] = progressOf(p, s);
  const k = residuals.findIndex(v => v <= epsilon);
  return k < 0 ? Infinity : times[k];
}

/** Data profiles: the share of P whose best residual is at most ε within t seconds. */
function dataProfile(selection, epsilon) {
  const problems = problemsOf(selection, ALL_TOLERANCES);
  const selected = indices(selection.solvers);
  const solvers = selected.filter(s => known.reached[s] && known.seconds[s]);
  const times = solvers.map(s => problems.map(p => firstTime(p, s, epsilon)));
  const n = problems.length;
  const curves = solvers.map((s, k) => ({ solver: s, ...steps(times[k], n) }));
  if (n > 0 && solvers.length > 1) {
    curves.push({ solver: BEST, ...steps(problems.map((_, i) => Math.min(...times.map(t => t[i]))), n) });
  }
  return { problems: n, curves, leftOut: selected.filter(s => !solvers.includes(s)) };
}

/** The first place in sorted numbers whose value is not below v. */
function lowerBound(sorted, v) {
  let [low, high] = [0, sorted.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] < v) low = middle + 1; else high = middle;
  }
  return low;
}

/** The (lower) median over P of the best residual known at time t; a problem without an answer yet counts as Infinity. */
function medianResidual(selection) {
  const problems = problemsOf(selection, ALL_TOLERANCES);
  const selected = indices(selection.solvers);
  const solvers = selected.filter(s => known.reached[s] && known.seconds[s]);
  const rank = Math.max(0, Math.ceil(problems.length / 2) - 1);
  const curves = solvers.map(s => {
    const events = problems.flatMap((p, i) => {
      const [times, residuals] = progressOf(p, s);
      return times.map((t, k) => [t, i, residuals[k]]);
    });
    events.sort((a, b) => a[0] - b[0]);
    const now = new Float64Array(problems.length).fill(Infinity);
    const sorted = now.slice();
    const [x, y] = [[], []];
    for (const [t, i, residual] of events) {
      // The residual of a problem falls: its place moves down, those between move up.
      const [to, from] = [lowerBound(sorted, residual), lowerBound(sorted, now[i])];
      sorted.copyWithin(to + 1, to, from);
      sorted[to] = residual;
      now[i] = residual;
      const value = sorted[rank];
      if (x[x.length - 1] === t) { x.pop(); y.pop(); }
      if (value !== (y[y.length - 1] ?? Infinity)) { x.push(t); y.push(value); }
    }
    return { solver: s, x, y };
  });
  return { problems: problems.length, curves, leftOut: selected.filter(s => !solvers.includes(s)) };
}

const EPSILONS = Array.from({ length: 12 }, (_, k) => Number(`1e-${k + 3}`));

/** Shares of P whose best residual is at most ε, ε = 1e-3 … 1e-14, of all sizes and then per class of size. */
function success(selection) {
  const problems = problemsOf(selection, ALL_TOLERANCES);
  const selected = indices(selection.solvers);
  const solvers = selected.filter(s => known.reached[s]);
  const best = (p, s) => {
    let least = Infinity;
    for (let k = 0; k < nTolerances; k++) {
      const r = runAt(p, s, k);
      if (r >= 0 && runs.reached[r] < least) least = runs.reached[r];
    }
    return least;
  };
  const classes = [];
  [null, ...data.sizes].forEach((size, k) => {
    const inside = problems.filter(p => size === null || sizeOf[p] === k - 1);
    if (inside.length === 0) return;
    const residuals = solvers.map(s => inside.map(p => best(p, s)));
    const share = values => EPSILONS.map(e => values.filter(v => v <= e).length / inside.length);
    const curves = solvers.map((s, i) => ({ solver: s, x: EPSILONS, y: share(residuals[i]) }));
    if (solvers.length > 1) {
      curves.push({ solver: BEST, x: EPSILONS, y: share(inside.map((_, i) => Math.min(...residuals.map(v => v[i])))) });
    }
    classes.push({ size: size === null ? "all" : size.name, problems: inside.length, curves });
  });
  return { classes, leftOut: selected.filter(s => !known.reached[s]) };
}

/** Per solver, the virtual best last: solved, fastest, median ratio over those solved, failures by ending, runs missing. */
function summary(selection) {
  const { problems, bySolver, least } = ratios(selection, "seconds");
  const rows = indices(selection.solvers).map(s => {
    const endings = new Array(data.endings.length).fill(0);
    let missing = 0;
    let seconds = 0;
    for (const p of problems) {
      const r = runAt(p, s, selection.tolerance);
      if (r < 0) { missing++; continue; }
      endings[runs.ending[r]]++;
      if (runs.ending[r] === SOLVED && !Number.isNaN(runs.seconds[r])) seconds += runs.seconds[r];
    }
    const mine = bySolver.get(s) ?? [];
    return {
      solver: s, problems: problems.length, solved: endings[SOLVED], fastest: mine.filter(v => v === 1).length,
      medianRatio: median(mine.filter(Number.isFinite)), seconds, endings, missing,
    };
  });
  const solvers = indices(selection.solvers);
  const anyone = problems.filter(p => solvers.some(s => {
    const r = runAt(p, s, selection.tolerance);
    return r >= 0 && runs.ending[r] === SOLVED;
  })).length;
  const finite = least.filter(Number.isFinite);
  rows.push({
    solver: BEST, problems: problems.length, solved: anyone, fastest: finite.length,
    medianRatio: finite.length ? 1 : NaN, seconds: finite.reduce((a, b) => a + b, 0), endings: null, missing: 0,
  });
  return rows;
}

/** Per solver and family the numbers of problems of P, of runs, of those solved, and of those solved fastest. */
function byFamily(selection) {
  const { problems, bySolver } = ratios(selection, "seconds");
  const families = indices(selection.families).filter(f => problems.some(p => data.problems.family[p] === f));
  const rows = indices(selection.solvers).map(s => ({
    solver: s,
    cells: families.map(f => {
      const cell = { problems: 0, runs: 0, solved: 0, fastest: 0 };
      problems.forEach((p, i) => {
        if (data.problems.family[p] !== f) return;
        cell.problems++;
        const r = runAt(p, s, selection.tolerance);
        if (r >= 0) cell.runs++;
        if (r >= 0 && runs.ending[r] === SOLVED) cell.solved++;
        if (bySolver.get(s)?.[i] === 1) cell.fastest++;
      });
      return cell;
    }),
  }));
  return { families, rows };
}

/** The problems of P that no solver of the selection solved, with the best residual reached and by whom. */
function unsolved(selection) {
  const solvers = indices(selection.solvers);
  const k = selection.tolerance;
  return problemsOf(selection).flatMap(p => {
    const mine = solvers.map(s => runAt(p, s, k)).filter(r => r >= 0);
    if (mine.some(r => runs.ending[r] === SOLVED)) return [];
    let best = -1;
    for (const r of mine) if (runs.reached[r] < (best < 0 ? Infinity : runs.reached[best])) best = r;
    return [{ problem: p, best }];
  });
}
