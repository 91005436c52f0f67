// The page: filters, figures, tables, the details of a problem, and the state in the address.

const byId = id => document.getElementById(id);
const fill = (element, ...children) => element.replaceChildren(...children.flat().filter(c => c !== null && c !== undefined));

// ------------------------------------------------------------------------------------------------ texts of numbers

const short = (v, digits = 3) => {
  if (Number.isNaN(v) || v === null || v === undefined) return "";
  if (v === Infinity) return "∞";
  if (v === 0) return "0";
  const size = Math.abs(v);
  return size >= 1e-3 && size < 1e6 ? String(Number(v.toPrecision(digits))) : v.toExponential(digits - 1);
};
const residual = v => (Number.isNaN(v) ? "" : v.toExponential(1));
const whole = v => (Number.isNaN(v) || v === null || v === undefined ? "" : String(v));
const percent = (part, all) => (all ? `${((100 * part) / all).toFixed(part === all || part === 0 ? 0 : 1)} %` : "");
const share = v => `${(100 * v).toFixed(1)} %`;
const mebi = bytes => (Number.isNaN(bytes) ? "" : short(bytes / 2 ** 20));
const plural = (n, one, many = `${one}s`) => `${n} ${n === 1 ? one : many}`;
const toleranceText = v => (v > 0 ? v.toExponential().replace("+", "") : String(v));
const familyOf = p => data.families[data.problems.family[p]];
const endingText = name => name.replaceAll("_", " ");

// ------------------------------------------------------------------------------------------------ state

const state = {
  view: whatever(),
  epsilon: null, // of the data profile; null: the tolerance of the view
  heat: "solved",
  theme: "",
  runs: { column: null, down: false, text: "", page: 0, all: false },
};
const epsilonOf = () => state.epsilon ?? data.tolerances[state.view.tolerance];

/** Keeps a view possible: another kind may lack the tolerance and the group. */
function mended(view) {
  if (!kindOf(view).tolerances.includes(view.tolerance)) view.tolerance = usual(view.kind);
  if (!groupOf(view)) view.group = 0;
  return view;
}

/** A view by names: { kind, tolerance, family or size, solvers }; what is not named is as in the beginning. */
function viewOf(asked = {}) {
  const view = whatever();
  const find = (what, all, name) => {
    const k = all.indexOf(name);
    if (k < 0) throw new Error(`${what}: expected one of ${all.join(", ")}, found ${name}`);
    return k;
  };
  if (asked.kind !== undefined) view.kind = find("kind", data.kinds.map(k => k.name), asked.kind);
  view.tolerance = asked.tolerance === undefined ? usual(view.kind) : find("tolerance", data.tolerances, asked.tolerance);
  const { groups } = kindOf(view);
  if (asked.family !== undefined) view.group = find("family", groups.map(familyOfGroup), asked.family);
  if (asked.size !== undefined) view.group = find("size", groups.map(sizeOfGroup), asked.size);
  if (asked.solvers) {
    view.solvers.fill(false);
    for (const name of asked.solvers) view.solvers[find("solver", data.solvers.map(s => s.label), name)] = true;
  }
  return mended(view);
}

/** What differs from the state at the beginning, as the fragment of the address. */
function toHash() {
  const parts = new URLSearchParams();
  const { view } = state;
  if (view.kind !== 0) parts.set("kind", kindOf(view).name);
  if (view.tolerance !== usual(view.kind)) parts.set("tol", String(data.tolerances[view.tolerance]));
  const [family, size] = [familyOfGroup(groupOf(view)), sizeOfGroup(groupOf(view))];
  if (family !== null) parts.set("family", family);
  if (size !== null) parts.set("size", size);
  const [on, off] = [indices(view.solvers), indices(view.solvers.map(v => !v))];
  const fewer = on.length < off.length;
  if (off.length) (fewer ? on : off).forEach(s => parts.append(fewer ? "only" : "not", data.solvers[s].label));
  if (fewer && !on.length) parts.set("only", "");
  if (state.epsilon !== null) parts.set("eps", String(state.epsilon));
  if (state.heat !== "solved") parts.set("heat", state.heat);
  if (state.theme) parts.set("theme", state.theme);
  const text = parts.toString();
  if (text !== location.hash.slice(1)) history.replaceState(null, "", text ? `#${text}` : location.pathname + location.search);
}

/** What an address says that this page does not know is passed over. */
function fromHash() {
  const parts = new URLSearchParams(location.hash.slice(1));
  const view = whatever();
  const known = (all, name) => Math.max(0, all.indexOf(name));
  view.kind = known(data.kinds.map(k => k.name), parts.get("kind"));
  view.tolerance = parts.has("tol") ? data.tolerances.indexOf(Number(parts.get("tol"))) : usual(view.kind);
  const { groups } = kindOf(view);
  if (parts.has("family")) view.group = known(groups.map(familyOfGroup), parts.get("family"));
  if (parts.has("size")) view.group = known(groups.map(sizeOfGroup), parts.get("size"));
  const [only, not] = [parts.getAll("only"), new Set(parts.getAll("not"))];
  view.solvers = data.solvers.map(s => (only.length ? only.includes(s.label) : !not.has(s.label)));
  state.view = mended(view);
  state.epsilon = parts.has("eps") && Number(parts.get("eps")) > 0 ? Number(parts.get("eps")) : null;
  state.heat = parts.get("heat") === "fastest" ? "fastest" : "solved";
  state.theme = ["light", "dark"].includes(parts.get("theme")) ? parts.get("theme") : "";
}

// ------------------------------------------------------------------------------------------------ figures

const shareAxis = (label, name) => ({
  label, name, min: 0, max: 1.02, ticks: [0, 0.2, 0.4, 0.6, 0.8, 1].map(v => [v, `${Math.round(100 * v)} %`]),
});
const solversOf = curves => [...new Set(curves.map(c => c.solver))].sort((a, b) => (a === BEST ? 1e9 : a) - (b === BEST ? 1e9 : b));
const powerBelow = v => 10 ** Math.floor(Math.log10(v) + 1e-9);
const powerAbove = v => 10 ** Math.ceil(Math.log10(v) - 1e-9);
const rangeOf = values => {
  const positive = values.filter(v => v > 0 && Number.isFinite(v));
  return positive.length ? [positive.reduce((a, b) => Math.min(a, b)), positive.reduce((a, b) => Math.max(a, b))] : [1, 10];
};

/** A logarithmic axis over whole decades, one at least, that holds the values. */
function decades(label, name, values) {
  const [least, most] = rangeOf(values);
  return { label, name, log: true, min: powerBelow(least), max: Math.max(powerAbove(most), 10 * powerBelow(least)) };
}

function without(leftOut, why) {
  const mine = leftOut.filter(s => shows(state.view, s));
  if (!mine.length) return "";
  const names = mine.slice(0, 6).map(labelOf).join(", ") + (mine.length > 6 ? ` and ${mine.length - 6} more` : "");
  return ` Not drawn, for ${why}: ${names}.`;
}

/** Times of several machines side by side are no comparison of methods. */
function machinesNote() {
  const machines = new Set(kindOf(state.view).solvers.filter(s => shows(state.view, s)).flatMap(s => data.solvers[s].machines));
  return machines.size > 1 ? " The times come from different machines." : "";
}

function profileFigure(cost) {
  const { view } = state;
  const { problems, profiles: { [cost]: drawn } } = atOf(view);
  const curves = curvesOf(view, drawn);
  const largest = Math.max(1, ...curves.map(c => c.x[c.x.length - 1] ?? 1));
  const max = largest > 100 ? powerAbove(largest) : Math.max(2, largest * 1.1);
  const name = COSTS[cost];
  const tolerance = toleranceText(data.tolerances[view.tolerance]);
  const note = cost === "seconds"
    ? `Share of ${plural(problems, "problem")} that a solver solves to ${tolerance} in at most τ times the least time of any solver, also of those not `
      + "shown (Dolan and Moré 2002). What fails, and a run that is missing, is not solved at any τ; problems that a solver refuses do not count in its "
      + `share. A profile shows the distance from the best; with more than two solvers it does not rank them (Gould and Scott 2016).${machinesNote()}`
    : `As by time, with the number of ${name} in place of the time; ${plural(problems, "problem")}, tolerance ${tolerance}.`;
  return {
    heading: `Performance profile by ${name}`,
    title: `Performance profile by ${name}, tolerance ${tolerance}`,
    x: { label: "ratio τ to the best of all solvers", name: "tau", log: true, min: 1, max },
    y: shareAxis("share of problems", "rho"),
    stepped: true,
    panels: [{ title: "", curves: curves.map(c => ({ ...c, before: 0 })) }],
    solvers: solversOf(curves),
    at: x => `τ = ${short(x)}`,
    format: share,
    note: note + without(drawn.left_out, `their ${name} are not known`),
  };
}

function dataFigure() {
  const { view } = state;
  const epsilon = epsilonOf();
  const drawn = groupOf(view).data[kindOf(view).epsilons.indexOf(epsilon)];
  const curves = curvesOf(view, drawn);
  return {
    heading: "Data profile",
    title: `Data profile, residual ${toleranceText(epsilon)}`,
    x: decades("time limit t, s", "seconds", curves.flatMap(c => c.x)),
    y: shareAxis("share of problems", "share"),
    stepped: true,
    panels: [{ title: "", curves: curves.map(c => ({ ...c, before: 0 })) }],
    solvers: solversOf(curves),
    at: x => `t = ${short(x)} s`,
    format: share,
    note: `Share of ${plural(groupOf(view).problems, "problem")} on which the best residual that a solver has reached within t seconds is at most ${
      toleranceText(epsilon)}, over its runs at all tolerances: by the residual against time where it was kept, else at the end of the run. `
      + `Failed runs count by the residual that they reached.${machinesNote()}${without(drawn.left_out, "their residuals or times are not known")}`,
  };
}

/** What figures of residuals against time share. */
const residualsInTime = (curves, label) => ({
  x: decades("time t, s", "seconds", curves.flatMap(c => c.x)),
  y: decades(label, "residual", curves.flatMap(c => c.y)),
  stepped: true,
  panels: [{ title: "", curves }],
  solvers: solversOf(curves),
  at: x => `t = ${short(x)} s`,
  format: residual,
  lowest: true,
});

function medianFigure() {
  const { problems, residual: drawn } = groupOf(state.view);
  const curves = curvesOf(state.view, drawn);
  return {
    title: "Median residual against time",
    ...residualsInTime(curves, "median residual"),
    note: `Median over ${plural(problems, "problem")} of the best residual that a solver has reached within t seconds, over its runs at all `
      + `tolerances. A problem without an answer yet counts as infinite, so a curve begins where half of them have one.${
        machinesNote()}${without(drawn.left_out, "their residuals or times are not known")}`,
  };
}

function successFigure() {
  const { success, success_left_out: leftOut } = groupOf(state.view);
  const classes = success.map(c => ({
    ...c, curves: c.shares.filter(([s]) => shows(state.view, s)).map(([solver, y]) => ({ solver, x: data.decades, y })),
  }));
  return {
    title: `Success against tolerance, by number of ${counted()}`,
    x: { label: "residual ε", name: "epsilon", log: true, min: 1e-3, max: 1e-14 },
    y: shareAxis("share of problems", "share"),
    stepped: false,
    panels: classes.map(c => ({ title: `${c.size === "all" ? "all" : `${c.size} ${counted()}`} (${c.problems})`, name: c.size, curves: c.curves })),
    solvers: solversOf(classes.flatMap(c => c.curves)),
    at: x => `ε = ${toleranceText(data.decades.reduce((a, b) => (Math.abs(Math.log(b / x)) < Math.abs(Math.log(a / x)) ? b : a)))}`,
    format: share,
    note: "Share of problems whose smallest residual, over the runs of a solver at all tolerances, is at most ε; in brackets their number. A run stops at its own tolerance, so "
      + `the shares below the smallest tolerance that was asked for (${toleranceText(Math.min(...data.tolerances))}) are what runs happened to reach.${
        data.solvers.some(s => s.foreign) ? " † by the program's own residual." : ""}${without(leftOut, "their residuals are not known")}`,
  };
}

const FIGURES = {
  "profile-time": () => profileFigure("seconds"),
  "profile-iterations": () => profileFigure("iterations"),
  "profile-factorisations": () => profileFigure("factorisations"),
  "data-profile": dataFigure,
  "median-residual": medianFigure,
  success: successFigure,
};

/** What is shown of each figure: its definition, element, and scales. */
const shown = {};

/** The width of a column on paper, and whether the figures are drawn for it. */
const HALF = 345;
let printing = false;

function figureButtons(name, figure) {
  const one = (text, what, save_) => h("button", { type: "button", click: save_, title: `Save as ${text}`, "aria-label": `Save ${what} as ${text}` }, text);
  return h("span", { class: "exports" },
    one("SVG", name, () => save(`${name}.svg`, new Blob([svgText(figure())], { type: "image/svg+xml" }))),
    one("PNG", name, () => pngBlob(figure()).then(blob => save(`${name}.png`, blob), e => alert(`${name}.png: ${e.message}`))),
    one("CSV", name, () => save(`${name}.csv`, new Blob([figureCsv(figure())], { type: "text/csv" }))));
}

/** A place for a figure: heading, buttons, drawing, legend (on paper and narrow screens), definition. */
function place(name, figure, extra = null) {
  const wide = ["profile-time", "success"].includes(name);
  const box = h("figure", { id: `figure-${name}`, class: wide ? "wide" : null });
  const heading = h("h3");
  const drawing = h("div", { class: "drawing", tabindex: 0, role: "group", "aria-label": "arrow keys read the curves" });
  const key = h("div", { class: "key" });
  const tip = h("div", { class: "tip", role: "status", hidden: true });
  const note = h("figcaption");
  box.append(h("div", { class: "head" }, heading, extra ?? "", figureButtons(name, () => shown[name].figure)), drawing, key, tip, note);
  shown[name] = { box, wide, heading, drawing, key, tip, note, make: figure };
  listen(shown[name]);
  return box;
}

function render(name) {
  const it = shown[name];
  const figure = it.make();
  it.figure = figure;
  it.heading.textContent = clean(figure.heading ?? figure.title);
  it.note.textContent = figure.note;
  const { svg, panels } = draw(figure, { width: printing ? it.wide ? 2 * HALF : HALF : Math.max(280, it.drawing.clientWidth || 560) });
  it.panels = panels;
  it.svg = svg;
  it.cursor = null;
  it.tip.hidden = true;
  fill(it.drawing, svg);
  fill(it.key, figure.solvers.map(s => h("span", {}, swatch(s), labelOf(s))));
}

const swatch = s => {
  const svg = g("svg", { width: 28, height: 10, viewBox: "0 0 28 10", "aria-hidden": "true" });
  svg.append(sample(s, 1, 5, false));
  return svg;
};

/** The curves at a place of the cursor: a line, and their values beside it. */
function point(it, panel, pixel, vertical) {
  const { figure } = it;
  it.cursor?.remove();
  const x = Math.min(Math.max(pixel, panel.left), panel.left + panel.width);
  const at = panel.x.back(x);
  const values = panel.curves.map(c => ({ solver: c.solver, y: valueAt(c, at, figure.stepped) }))
    .filter(v => !Number.isNaN(v.y) && v.y !== undefined);
  values.sort((a, b) => (figure.lowest ? a.y - b.y : b.y - a.y));
  const near = vertical === null || !values.length ? null : values.reduce((a, b) => (
    Math.abs(panel.y.at(b.y) - vertical) < Math.abs(panel.y.at(a.y) - vertical) ? b : a)).solver;
  const marks = values.map(v => g("circle", { cx: x, cy: panel.y.at(v.y), r: 3, style: `fill:var(--${colourOf(v.solver)})` }));
  it.cursor = g("g", { class: "cursor" },
    g("line", { x1: x, x2: x, y1: panel.top, y2: panel.top + panel.height, style: "stroke:var(--faint)" }), marks);
  it.svg.append(it.cursor);
  const most = 16;
  const rows = values.slice(0, most).map(v => h("div", { class: v.solver === near ? "near" : null },
    swatch(v.solver), h("span", {}, labelOf(v.solver)), h("b", {}, figure.format(v.y))));
  fill(it.tip, h("div", { class: "at" }, panel.title ? `${panel.title}, ` : "", figure.at(at)), rows,
    values.length > most ? h("div", { class: "more" }, `and ${values.length - most} more`) : null);
  it.tip.hidden = false;
  const room = it.drawing.clientWidth;
  const [width, ratio] = [it.tip.offsetWidth, room / it.svg.viewBox.baseVal.width];
  const left = x * ratio + 16 + width > room ? x * ratio - width - 16 : x * ratio + 16;
  it.tip.style.left = `${Math.max(0, left) + it.drawing.offsetLeft}px`;
  it.tip.style.top = `${it.drawing.offsetTop + panel.top * ratio + 8}px`;
  it.place = { panel, x };
  emphasise(near);
}

function leave(it) {
  it.cursor?.remove();
  it.cursor = null;
  it.place = null;
  it.tip.hidden = true;
  emphasise(null);
}

function listen(it) {
  it.drawing.addEventListener("pointermove", event => {
    const box = it.svg.getBoundingClientRect();
    const ratio = it.svg.viewBox.baseVal.width / box.width;
    const [x, y] = [(event.clientX - box.left) * ratio, (event.clientY - box.top) * ratio];
    const panel = it.panels.find(p => x >= p.left - 8 && x <= p.left + p.width + 8 && y >= p.top - 8 && y <= p.top + p.height + 8);
    if (panel) point(it, panel, x, y); else leave(it);
  });
  it.drawing.addEventListener("pointerleave", () => leave(it));
  it.drawing.addEventListener("blur", () => leave(it));
  it.drawing.addEventListener("keydown", event => {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (event.key === "Escape") leave(it);
    if (!step || !it.panels.length) return;
    event.preventDefault();
    const now = it.place ?? { panel: it.panels[0], x: it.panels[0].left - step };
    let [k, x] = [it.panels.indexOf(now.panel), now.x + (step * now.panel.width) / (event.shiftKey ? 10 : 40)];
    const beyond = x > now.panel.left + now.panel.width + 1 ? 1 : x < now.panel.left - 1 ? -1 : 0;
    if (beyond && it.panels[k + beyond]) {
      k += beyond;
      x = beyond > 0 ? it.panels[k].left : it.panels[k].left + it.panels[k].width;
    }
    point(it, it.panels[k], x, null);
  });
}

/** One solver stands out in all figures; null: none. */
function emphasise(solver) {
  for (const curve of document.querySelectorAll(".curve")) {
    curve.classList.toggle("dim", solver !== null && Number(curve.dataset.solver) !== solver);
  }
}

// ------------------------------------------------------------------------------------------------ filters

/** The solvers of the kind; hiding one hides its curves and rows. */
function solverList() {
  const { solvers, refusing } = kindOf(state.view);
  const all = on => h("button", { type: "button", click: () => change(v => v.solvers.fill(on)) }, on ? "all" : "none");
  const rows = solvers.map(s => {
    const box = h("input", { type: "checkbox", "data-solver": s, change: () => change(v => { v.solvers[s] = box.checked; }) });
    const row = h("label", {}, box, swatch(s), h("span", { class: "label", title: clean(labelOf(s)) }, clean(labelOf(s))),
      h("button", {
        type: "button", class: "only", "aria-label": `only ${clean(labelOf(s))}`,
        click: event => { event.preventDefault(); change(v => { v.solvers.fill(false); v.solvers[s] = true; }); },
      }, "only"));
    row.addEventListener("pointerenter", () => emphasise(s));
    row.addEventListener("pointerleave", () => emphasise(null));
    return row;
  });
  return [h("legend", {}, "Solvers shown", " ", h("span", { class: "exports" }, all(true), all(false))), rows,
    refusing.length ? h("details", { class: "note" }, h("summary", {}, `${refusing.length} ${refusing.length === 1 ? "takes" : "take"} no problem of this kind`),
      clean(refusing.map(labelOf).join(", "))) : null];
}

/** A select whose options have values of their own; `change` gets the value chosen. */
function choice(id, title, options, choose) {
  const select = h("select", { id, change: () => choose(Number(select.value)) }, options);
  return h("label", { class: "line" }, title, " ", select);
}
const option = (value, text) => h("option", { value }, clean(text));

/** The filters of the kind that is shown: it decides on tolerances, groups of problems and solvers. */
function buildFilters() {
  const { groups, tolerances } = kindOf(state.view);
  const part = (title, name) => {
    const options = groups.flatMap((group, k) => (name(group) === null ? [] : [option(k, `${name(group)} (${group.problems})`)]));
    return options.length ? h("optgroup", { label: title }, options) : null;
  };
  fill(byId("filters"),
    data.kinds.length > 1 ? choice("filter-kind", "Kind", data.kinds.map((k, i) => option(i, `${k.name || "(not known)"} (${k.groups[0].problems})`)), k => {
      change(v => { v.kind = k; v.group = 0; });
    }) : null,
    choice("filter-tolerance", "Tolerance", tolerances.map(k => option(k, toleranceText(data.tolerances[k]))), k => change(v => { v.tolerance = k; })),
    choice("filter-group", "Problems", [option(0, `all (${groups[0].problems})`), part("Family", familyOfGroup), part(capital(counted()), sizeOfGroup)]
      .filter(o => o !== null), k => change(v => { v.group = k; })),
    h("fieldset", { id: "filter-solvers" }, solverList().flat()),
    h("p", { class: "line" },
      h("button", { type: "button", click: () => { state.view = whatever(); state.epsilon = null; changed(); } }, "Reset"),
      " ", h("button", { type: "button", id: "theme", click: () => turn() }, "Light or dark")));
  const residuals = kindOf(state.view).epsilons;
  fill(byId("epsilon"), h("option", { value: "" }, "residual: the tolerance"),
    residuals.map(e => h("option", { value: String(e) }, `residual: ${toleranceText(e)}`)));
  built = state.view.kind;
}
let built = null;

function showFilters() {
  const { view } = state;
  if (built !== view.kind) buildFilters();
  for (const [id, value] of [["kind", view.kind], ["tolerance", view.tolerance], ["group", view.group]]) {
    const select = byId(`filter-${id}`);
    if (select) select.value = String(value);
  }
  byId("filter-solvers").querySelectorAll("input").forEach(box => { box.checked = view.solvers[box.dataset.solver]; });
  const { name, solvers } = kindOf(view);
  const [family, size] = [familyOfGroup(groupOf(view)), sizeOfGroup(groupOf(view))];
  const on = solvers.filter(s => view.solvers[s]).length;
  byId("filters-state").textContent = [
    data.kinds.length > 1 ? clean(name) : "", `tolerance ${toleranceText(data.tolerances[view.tolerance])}`,
    family === null ? "" : clean(family), size === null ? "" : `${size} ${counted()}`,
    on < solvers.length ? `${on} of ${plural(solvers.length, "solver")} shown` : plural(on, "solver"), plural(atOf(view).problems, "problem"),
  ].filter(Boolean).join(" · ");
}

function turn() {
  const dark = state.theme ? state.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  state.theme = dark ? "light" : "dark";
  showTheme();
  toHash();
}
function showTheme() {
  if (state.theme) document.documentElement.dataset.theme = state.theme;
  else delete document.documentElement.dataset.theme;
}

// ------------------------------------------------------------------------------------------------ tables

const cell = (value, attributes = {}) => h("td", attributes, clean(value));
const number = (value, attributes = {}) => cell(value, { class: "n", ...attributes });

function csvButton(name, rows) {
  return h("span", { class: "exports" }, h("button", {
    type: "button", title: "Save as CSV", "aria-label": `Save ${name} as CSV`,
    click: () => save(`${name}.csv`, new Blob([csvText(rows())], { type: "text/csv" })),
  }, "CSV"));
}

/** The endings other than an answer that occur in a summary. */
const causes = rows => data.endings.map((_, e) => e).filter(e => data.endings[e] !== "solved" && rows.some(r => r.endings?.[e]));
const shownRows = rows => rows.filter(r => shows(state.view, r.solver));
const labelled = s => (s === BEST ? "virtual best" : data.solvers[s].label);

function summaryRows() {
  const rows = shownRows(atOf(state.view).rows);
  const ended = causes(rows);
  const head = ["solver", "problems", "solved", "fastest", "median_ratio", "seconds", ...ended.map(e => data.endings[e]), "missing"];
  return [head, ...rows.map(r => [
    labelled(r.solver), r.problems, r.solved, r.fastest, r.ratio, r.seconds,
    ...ended.map(e => (r.endings ? r.endings[e] : "")), r.endings ? r.missing : "",
  ])];
}

function renderSummary() {
  const { problems, rows: all } = atOf(state.view);
  const rows = shownRows(all);
  const ended = causes(rows);
  const missing = rows.some(r => r.missing);
  const sorted = [...rows].sort((a, b) => (a.solver === BEST) - (b.solver === BEST) || b.solved - a.solved || b.fastest - a.fastest);
  const table = h("table", { id: "summary" },
    h("thead", {}, h("tr", {},
      h("th", {}, "solver"), ["solved", "", "fastest", "median ratio", "seconds"].map(t => h("th", { class: "n" }, t)),
      ended.map(e => h("th", { class: "n" }, endingText(data.endings[e]))), missing ? h("th", { class: "n" }, "no run") : null)),
    h("tbody", {}, sorted.map(r => h("tr", { class: r.solver === BEST ? "best" : null },
      h("td", { class: "name" }, swatch(r.solver), clean(labelOf(r.solver))),
      number(r.solved), number(percent(r.solved, r.problems - r.refused)), number(percent(r.fastest, r.problems - r.refused)), number(short(r.ratio)),
      number(short(r.seconds)), ended.map(e => number(r.endings?.[e] || "")), missing ? number(r.missing || "") : null))));
  byId("summary-note").textContent = `${plural(problems, "problem")} at tolerance ${toleranceText(data.tolerances[state.view.tolerance])}. `
    + "Solved: by an answer that the judge accepts, or by a verified proof that there is none (infeasible). Fastest: the share of problems on which "
    + "the solver needs the least time of all solvers, ties for each. Shares leave out the problems that the solver refuses. Median ratio: of its time "
    + "to the least, over the problems that it solves. Seconds: all its runs, failed ones included; of the virtual best those that solve. "
    + `The other columns count endings.${machinesNote()}`;
  fill(byId("summary-place"), table);
}

/** The families of the view, each with its rows by solver. */
const familiesOf = () => atOf(state.view).families.map(([family, rows]) => ({
  family, problems: rows[0]?.problems ?? 0, rows: new Map(shownRows(rows).map(r => [r.solver, r])),
}));

function renderHeat() {
  const families = familiesOf();
  // Paper has no room for many columns side by side.
  const most = printing ? 14 : Math.max(1, families.length);
  const parts = Array.from({ length: Math.ceil(families.length / most) }, (_, k) => families.slice(k * most, (k + 1) * most));
  const share = r => {
    const of = r.problems - r.refused;
    if (r.missing === r.problems || !of) return h("td", {}, r.refused ? h("small", {}, "refused") : "");
    const part = (100 * r[state.heat]) / of;
    return h("td", { class: "n heat", style: `--share:${part.toFixed(0)}%`, title: `${r[state.heat]} of ${of}${r.refused ? `, ${r.refused} refused` : ""}` },
      String(Math.round(part)));
  };
  const solvers = kindOf(state.view).solvers.filter(s => shows(state.view, s));
  fill(byId("heat-place"), families.length ? null : h("p", {}, "Nothing to show."), parts.map(part => h("table", { class: families.length > 9 ? "many" : null },
    h("thead", {}, h("tr", {}, h("th", {}, "solver"), part.map(f => (
      h("th", { class: "n" }, h("span", {}, clean(data.families[f.family] || "(no family)"), h("small", {}, ` ${f.problems}`))))))),
    h("tbody", {}, solvers.map(s => h("tr", {}, h("td", { class: "name" }, swatch(s), clean(labelOf(s))), part.map(f => share(f.rows.get(s)))))))));
  byId("heat-note").textContent = `Share of problems, in per cent, that a solver ${state.heat === "solved" ? "solves" : "solves in the least time of all"}, `
    + "by family, of those that it does not refuse. The small numbers are those of the problems; where a solver has no run at all, its place is empty.";
}

const heatRows = () => [["solver", "family", "problems", "refused", "missing", "solved", "fastest"], ...familiesOf().flatMap(f => [...f.rows.values()].map(r => [
  labelled(r.solver), data.families[f.family], r.problems, r.refused, r.missing, r.solved, r.fastest]))];

const problemLink = p => h("button", { type: "button", class: "link", click: () => openProblem(p) }, clean(data.problems.name[p]));

function renderUnsolved() {
  const found = atOf(state.view).unsolved;
  const most = 200;
  byId("unsolved-note").textContent = found.length
    ? `${plural(found.length, "problem")} that none of the solvers solves to ${toleranceText(data.tolerances[state.view.tolerance])}.${
      found.length > most ? ` The first ${most} are shown; the CSV has all.` : ""}`
    : "None: every problem is solved by at least one of the solvers.";
  fill(byId("unsolved-place"), found.length ? h("table", { id: "unsolved" },
    h("thead", {}, h("tr", {}, h("th", {}, "problem"), h("th", {}, "family"), h("th", { class: "n" }, counted()),
      h("th", { class: "n" }, "least residual"), h("th", {}, "by"))),
    h("tbody", {}, found.slice(0, most).map(([p, closest]) => h("tr", {},
      h("td", {}, problemLink(p)), cell(familyOf(p)), number(data.problems.contacts[p]),
      number(closest ? residual(closest[1]) : ""), cell(closest ? labelOf(closest[0]) : ""))))) : null);
}

function renderUnreadable() {
  byId("unreadable").hidden = data.unreadable.length === 0;
  fill(byId("unreadable-place"), h("table", {},
    h("thead", {}, h("tr", {}, h("th", {}, "problem"), h("th", {}, "what is wrong with it"))),
    h("tbody", {}, data.unreadable.map(([name, error]) => h("tr", {}, cell(name), cell(error))))));
}

// ------------------------------------------------------------------------------------------------ the table of runs

// Each column: its name, and its heading where that depends on the kind; the value that sorts, the text that shows; its name and value in files where they differ.
const titleOf = c => c.title?.() ?? c.name;
const messageOf = r => (runs.message && runs.message[r] !== null ? data.messages[runs.message[r]] : "");
const COLUMNS = [
  { name: "problem", sort: r => data.problems.name[runs.problem[r]] },
  // As a rule the family stands in the problem's name.
  { name: "family", sort: r => familyOf(runs.problem[r]), hidden: data.problems.name.every((name, p) => name.startsWith(`${familyOf(p)}/`)) },
  { name: "contacts", title: counted, n: true, sort: r => data.problems.contacts[runs.problem[r]] },
  { name: "solver", sort: r => data.solvers[runs.solver[r]].label, show: r => labelOf(runs.solver[r]) },
  { name: "tolerance", n: true, sort: r => data.tolerances[runs.tolerance[r]], show: r => toleranceText(data.tolerances[runs.tolerance[r]]) },
  { name: "ending", sort: r => runs.ending[r], show: r => endingText(data.endings[runs.ending[r]]), plain: r => data.endings[runs.ending[r]] },
  { name: "iterations", column: "iterations", n: true, sort: r => runs.iterations[r], show: r => whole(runs.iterations[r]) },
  { name: "factorisations", column: "factorisations", n: true, sort: r => runs.factorisations[r], show: r => whole(runs.factorisations[r]) },
  { name: "seconds", n: true, sort: r => runs.seconds[r], show: r => short(runs.seconds[r]) },
  { name: "residual", n: true, sort: r => runs.reached[r], show: r => residual(runs.reached[r]) },
  { name: "memory, MiB", column: "peak_memory", n: true, sort: r => runs.peak_memory[r], show: r => mebi(runs.peak_memory[r]),
    file: "peak_memory", plain: r => runs.peak_memory[r] },
  { name: "message", sort: messageOf },
].filter(c => !c.column || data.runs[c.column]);
const SHOWN = COLUMNS.filter(c => !c.hidden);
const PAGE = 50;
const classOf = (c, r) => (c.n ? "n" : c.name === "ending" && !solved(r) && data.endings[runs.ending[r]] !== "refused" ? "failed" : c.name);

/** The runs of the view, by the filter of texts and in the order of the table. */
function listedRuns() {
  const { view } = state;
  const { column, down, text, all } = state.runs;
  const words = text.toLowerCase().split(/\s+/).filter(Boolean);
  const found = [];
  for (let r = 0; r < nRuns; r++) {
    if (!view.solvers[runs.solver[r]] || (!all && runs.tolerance[r] !== view.tolerance) || !passes(view, runs.problem[r])) continue;
    if (words.length) {
      const line = [data.problems.name[runs.problem[r]], data.solvers[runs.solver[r]].label, endingText(data.endings[runs.ending[r]]), messageOf(r)]
        .join(" ").toLowerCase();
      if (!words.every(w => line.includes(w))) continue;
    }
    found.push(r);
  }
  if (column === null) return found;
  const value = SHOWN[column].sort;
  const keys = new Map(found.map(r => [r, value(r)]));
  // What is not known stands last in both directions.
  const blank = v => v === "" || Number.isNaN(v);
  const order = (a, b) => (typeof a === "string" ? collator.compare(a, b) : a - b);
  return found.sort((a, b) => {
    const [x, y] = [keys.get(a), keys.get(b)];
    return blank(x) - blank(y) || (blank(x) ? 0 : down ? order(y, x) : order(x, y)) || a - b;
  });
}
const collator = new Intl.Collator("en", { numeric: true });

function renderRuns() {
  const found = listedRuns();
  const pages = Math.max(1, Math.ceil(found.length / PAGE));
  const page = state.runs.page = Math.min(Math.max(0, state.runs.page), pages - 1);
  const rows = found.slice(page * PAGE, (page + 1) * PAGE);
  const heads = SHOWN.map((c, k) => {
    const mine = state.runs.column === k;
    return h("th", { class: c.n ? "n" : null, "aria-sort": mine ? (state.runs.down ? "descending" : "ascending") : "none" },
      h("button", {
        type: "button", click: () => {
          Object.assign(state.runs, { column: k, down: mine && !state.runs.down, page: 0 });
          renderRuns();
          byId("runs").querySelectorAll("thead button")[k].focus();
        },
      }, titleOf(c), h("span", { class: "arrow" }, mine ? (state.runs.down ? " ▼" : " ▲") : "")));
  });
  fill(byId("runs-place"), h("table", { id: "runs" }, h("thead", {}, h("tr", {}, heads)), h("tbody", {}, rows.map(r => h("tr", {},
    SHOWN.map((c, k) => {
      if (k === 0) return h("td", {}, problemLink(runs.problem[r]));
      const text = (c.show ?? c.sort)(r);
      return cell(text, {
        class: classOf(c, r),
        title: c.name === "message" ? clean(text) : null,
      });
    }))))));
  const to = (text, where, off) => h("button", {
    type: "button", disabled: off, click: () => { state.runs.page = where; renderRuns(); },
  }, text);
  fill(byId("runs-pages"),
    to("First", 0, page === 0), to("Previous", page - 1, page === 0), to("Next", page + 1, page === pages - 1), to("Last", pages - 1, page === pages - 1));
  const from = page * PAGE;
  byId("runs-note").textContent = found.length
    ? `Rows ${from + 1} to ${from + rows.length} of ${found.length}. A problem's name opens all that was measured on it.`
    : "No run passes the filters.";
  byId("runs-left-out").textContent = found.length > rows.length
    ? `On paper ${rows.length} of ${found.length} rows are shown; ${found.length - rows.length} are left out, and stand in the data.` : "";
}

const runRows = found => [
  COLUMNS.map(c => c.file ?? titleOf(c)), ...found.map(r => COLUMNS.map(c => (c.plain ?? c.sort)(r))),
];

// ------------------------------------------------------------------------------------------------ one problem

function traceFigure(p) {
  const k = state.view.tolerance;
  const traced = Object.keys(data.traces).map(Number).filter(r => runs.problem[r] === p && runs.tolerance[r] === k);
  const curves = traced.flatMap(r => {
    const [times, residuals] = data.traces[r];
    const points = times.map((t, i) => [t, residuals[i]]).filter(([t, v]) => t > 0 && v > 0);
    return points.length ? [{ solver: runs.solver[r], x: points.map(v => v[0]), y: points.map(v => v[1]), ends: true }] : [];
  });
  return {
    heading: "Residual against time",
    title: `Residual against time, ${data.problems.name[p]}, tolerance ${toleranceText(data.tolerances[k])}`,
    ...residualsInTime(curves, "residual"),
    note: "The judge's residual at its visits, thinned to a few dozen of them.",
  };
}

function openProblem(p) {
  const { problems } = data;
  const facts = [
    ["family", data.families[problems.family[p]]], ["kind", data.kinds[problems.kind[p]].name], [data.kinds[problems.kind[p]].counted, problems.contacts[p]],
    ["unknowns", problems.unknowns[p]], ["degrees of freedom", problems.dofs?.[p]], ["contact density", short(problems.density?.[p])],
    ["asymmetry", short(problems.asymmetry?.[p])],
    ["friction", problems.mu_min?.[p] === undefined || problems.mu_min[p] === null ? "" : problems.mu_min[p] === problems.mu_max?.[p]
      ? short(problems.mu_min[p]) : `${short(problems.mu_min[p])} to ${short(problems.mu_max?.[p])}`],
  ].filter(([, v]) => v !== "" && v !== undefined && v !== null && v !== 0);
  const mine = indices([...runs.problem].map(of => of === p));
  mine.sort((a, b) => runs.tolerance[a] - runs.tolerance[b] || solved(b) - solved(a) || runs.seconds[a] - runs.seconds[b]);
  const columns = SHOWN.filter(c => !["problem", "family", "contacts"].includes(c.name));
  const traced = traceFigure(p).solvers.length > 0;
  const dialog = byId("problem");
  fill(dialog,
    h("form", { method: "dialog", class: "head" }, h("h2", {}, clean(problems.name[p])),
      h("span", { class: "exports" }, h("button", {
        type: "button", click: () => save("problem.csv", new Blob([csvText(runRows(mine))], { type: "text/csv" })), title: "Save as CSV",
      }, "CSV"), h("button", { autofocus: true }, "Close"))),
    h("dl", {}, facts.map(([name, v]) => h("div", {}, h("dt", {}, name), h("dd", {}, clean(v))))),
    traced ? place("trace", () => traceFigure(p)) : null,
    h("div", { class: "scroll" }, h("table", {},
      h("thead", {}, h("tr", {}, columns.map(c => h("th", { class: c.n ? "n" : null }, titleOf(c))))),
      h("tbody", {}, mine.map(r => h("tr", {}, columns.map(c => cell((c.show ?? c.sort)(r), {
        class: classOf(c, r),
      }))))))));
  dialog.showModal();
  if (traced) render("trace");
}

// ------------------------------------------------------------------------------------------------ the whole

function change(how) {
  how(state.view);
  mended(state.view);
  state.runs.page = 0;
  changed();
}

function changed() {
  if (!kindOf(state.view).epsilons.includes(state.epsilon)) state.epsilon = null;
  showFilters();
  for (const name of Object.keys(FIGURES)) render(name);
  byId("epsilon").value = String(state.epsilon ?? "");
  renderSummary();
  renderHeat();
  renderUnsolved();
  renderRuns();
  toHash();
}

function build() {
  const epsilon = h("select", {
    id: "epsilon", "aria-label": "residual of the data profile",
    change: () => { state.epsilon = epsilon.value ? Number(epsilon.value) : null; render("data-profile"); toHash(); },
  });
  const [first, ...others] = Object.entries(FIGURES).map(([name, figure]) => place(name, figure, name === "data-profile" ? epsilon : null));
  fill(byId("first"), first);
  fill(byId("figures"), others);
  byId("summary-buttons").replaceWith(csvButton("summary", summaryRows));
  byId("heat-buttons").replaceWith(csvButton("families", heatRows));
  byId("unsolved-buttons").replaceWith(csvButton("unsolved", () => [["problem", "family", counted(), "residual", "solver"],
    ...atOf(state.view).unsolved.map(([p, closest]) => [data.problems.name[p], familyOf(p), data.problems.contacts[p],
      closest ? closest[1] : "", closest ? labelled(closest[0]) : ""])]));
  byId("runs-buttons").replaceWith(csvButton("runs", () => runRows(listedRuns())));
  byId("heat-what").addEventListener("change", () => { state.heat = byId("heat-what").value; renderHeat(); toHash(); });
  let waiting = 0;
  byId("runs-text").addEventListener("input", () => {
    clearTimeout(waiting);
    waiting = setTimeout(() => { Object.assign(state.runs, { text: byId("runs-text").value, page: 0 }); renderRuns(); }, 120);
  });
  byId("runs-all").addEventListener("change", () => { Object.assign(state.runs, { all: byId("runs-all").checked, page: 0 }); renderRuns(); });

  // On wide screens the filters stand beside the figures, always open; on narrow ones above them, closed at first.
  const wide = matchMedia("(min-width: 1080px)");
  const arrange = () => { byId("filters-box").open = wide.matches; };
  wide.addEventListener("change", arrange);
  arrange();
  let width = 0;
  new ResizeObserver(() => {
    const now = byId("figures").clientWidth;
    if (now === width || !now || printing) return;
    width = now;
    Object.keys(FIGURES).forEach(render);
  }).observe(byId("figures"));
  const print = on => () => { printing = on; Object.keys(FIGURES).forEach(render); renderHeat(); };
  addEventListener("beforeprint", print(true));
  addEventListener("afterprint", print(false));
  addEventListener("hashchange", () => { fromHash(); showTheme(); byId("heat-what").value = state.heat; changed(); });

  fromHash();
  showTheme();
  byId("heat-what").value = state.heat;
  renderUnreadable();
  byId("page").hidden = false;
  width = byId("figures").clientWidth;
  changed();
}

const began = performance.now();
if (nRuns > 0) build();
else byId("empty").hidden = false;

/** For scripts: the numbers of the page by names, and what it shows. */
window.report = {
  select: asked => { state.view = viewOf(asked); state.epsilon = asked?.epsilon ?? null; changed(); },
  curves: name => shown[name].figure.panels.map(panel => panel.curves.map(c => ({ ...c, solver: labelled(c.solver) }))),
  summary: () => summaryRows(),
  svg: name => svgText(shown[name].figure),
  png: name => pngBlob(shown[name].figure),
  csv: name => figureCsv(shown[name].figure),
  script: performance.now() - began,
  ready: performance.now(),
};
