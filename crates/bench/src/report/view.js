// The data of the page, and the view of it that is looked at. All numbers of figures and tables were counted when the page
// was made: here they are read, chosen, and hidden. No drawing, no page.

const data = JSON.parse(document.getElementById("data").textContent);

const SOLVED = [data.endings.indexOf("solved"), data.endings.indexOf("infeasible")];
const BEST = -1; // Stands for the virtual best among the solvers.

const nRuns = data.runs.problem.length;

/** A column of numbers as it was embedded: absent, or with null where the value is not known. */
function floats(values) {
  const column = new Float64Array(nRuns).fill(NaN);
  if (values) values.forEach((v, k) => { if (v !== null) column[k] = v; });
  return column;
}

const runs = {
  ...data.runs,
  ...Object.fromEntries(["iterations", "factorisations", "seconds", "reached", "peak_memory"].map(name => [name, floats(data.runs[name])])),
};
const solved = r => SOLVED.includes(runs.ending[r]);

const COSTS = { seconds: "time", iterations: "iterations", factorisations: "factorisations" };

const indices = flags => flags.flatMap((on, k) => (on ? [k] : []));

// A view: { kind, group, tolerance, solvers }. Kind and group are indices, tolerance one of data.tolerances; solvers
// holds a truth value for each of data.solvers.

const kindOf = view => data.kinds[view.kind];
/** What the size of a problem of the kind that is shown counts: contacts, pairs, variables. */
const counted = () => kindOf(state.view).counted;
const capital = text => text.charAt(0).toUpperCase() + text.slice(1);
const groupOf = view => kindOf(view).groups[view.group];
const atOf = view => groupOf(view).at[kindOf(view).tolerances.indexOf(view.tolerance)];
const shows = (view, s) => s === BEST || view.solvers[s];
const familyOfGroup = group => (group.family === undefined ? null : data.families[group.family] || "(no family)");
const sizeOfGroup = group => (group.size === undefined ? null : data.sizes[group.size]);

/** The tolerance of a kind to begin with: the one nearest to 1e-8. */
function usual(kind) {
  const far = k => Math.abs(Math.log10(data.tolerances[k] > 0 ? data.tolerances[k] : 1e-300) + 8);
  return data.kinds[kind]?.tolerances.reduce((best, k) => (far(k) < far(best) ? k : best));
}

const whatever = () => ({ kind: 0, group: 0, tolerance: usual(0), solvers: data.solvers.map(() => true) });

const passes = (view, p) => {
  const { family, size } = groupOf(view);
  return data.problems.kind[p] === view.kind && (family === undefined || data.problems.family[p] === family)
    && (size === undefined || data.problems.size[p] === size);
};

/** Values from their differences on a grid of a thousand points a decade. */
function fromGrid(differences) {
  let k = 0;
  return differences.map(d => 10 ** ((k += d) / 1000));
}

/** The shown curves of a figure; of a share each x stands for a rise by one of `of` problems. */
function curvesOf(view, drawn) {
  return drawn.curves.filter(c => shows(view, c.solver)).map(({ solver, x, y, of }) => {
    const [xs, ys] = [fromGrid(x), y ? fromGrid(y) : x.map((_, k) => (k + 1) / of)];
    const last = xs.map((v, k) => xs[k + 1] !== v);
    return { solver, x: xs.filter((_, k) => last[k]), y: ys.filter((_, k) => last[k]) };
  });
}
