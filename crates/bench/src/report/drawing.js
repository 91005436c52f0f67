// Elements, curves as SVG, and files out of figures. Texts become text nodes only, never markup.

const SVG = "http://www.w3.org/2000/svg";

/** An element. Attributes that are functions are listeners, null and false are left out, children may be texts. */
function make(space, tag, attributes, children) {
  const element = space ? document.createElementNS(space, tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name, value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== null && value !== undefined && value !== false) element.setAttribute(name, value);
  }
  element.append(...children.flat().filter(c => c !== null && c !== undefined));
  return element;
}
const h = (tag, attributes = {}, ...children) => make(null, tag, attributes, children);
const g = (tag, attributes = {}, ...children) => make(SVG, tag, attributes, children);

// Okabe and Ito's colours without the yellow, which is lost on white, and black in its place; five dashes. Five and
// eight have no common divisor, so forty solvers differ, and neighbours differ in grey too. The page has the dark set.
const INK = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7a4fa3", "#1a1a1a"];
const DASHES = ["", "7 3", "2 2.5", "9 3 2 3", "14 4"];
const PAPER = { text: "#1a1a1a", faint: "#5c5c5c", grid: "#dddddd", axis: "#8a8a8a", best: "#8a8a8a", page: "#ffffff" };

/** The value of a colour by name: a variable of the page, or the ink of an export. */
const inkOf = (name, paper) => (paper ? PAPER[name] ?? INK[Number(name.slice(1))] : `var(--${name})`);
const colourOf = s => (s === BEST ? "best" : `c${s % INK.length}`);
const dashOf = s => (s === BEST ? "" : DASHES[s % DASHES.length]);
const labelOf = s => (s === BEST ? "virtual best" : data.solvers[s].label + (data.solvers[s].foreign ? " †" : ""));

const SUPERSCRIPTS = "⁰¹²³⁴⁵⁶⁷⁸⁹";
const power = e => `10${e < 0 ? "⁻" : ""}${[...String(Math.abs(e))].map(d => SUPERSCRIPTS[d]).join("")}`;

/** Positions on a logarithmic axis: { ticks: [[value, text]], minor: [value] }. */
function logTicks(min, max, room) {
  const [low, high] = [Math.log10(min), Math.log10(max)];
  const between = v => v >= min * (1 - 1e-9) && v <= max * (1 + 1e-9);
  const decades = [];
  for (let e = Math.floor(low + 1e-9); e <= Math.ceil(high - 1e-9); e++) decades.push(e);
  if (high - low <= 2) {
    const digits = high - low < 0.8 ? [1, 1.5, 2, 3, 4, 5, 7] : [1, 2, 5];
    const ticks = decades.flatMap(e => digits.map(d => Number(`${d}e${e}`))).filter(between);
    return { ticks: ticks.map(v => [v, v >= 0.01 && v < 1e4 ? String(v) : v.toExponential(0)]), minor: [] };
  }
  const every = Math.max(1, Math.ceil((high - low) / room));
  const shown = decades.filter(e => e % every === 0);
  const minor = every > 1
    ? decades.filter(e => e % every !== 0).map(e => 10 ** e)
    : high - low <= 7 ? decades.flatMap(e => [2, 3, 4, 5, 6, 7, 8, 9].map(d => d * 10 ** e)) : [];
  return {
    ticks: shown.map(e => [Number(`1e${e}`), e === 0 ? "1" : power(e)]).filter(([v]) => between(v)),
    minor: minor.filter(between),
  };
}

/** A scale from [min, max] to pixels [from, to], and back. */
function scale(axis, from, to) {
  const f = axis.log ? Math.log10 : v => v;
  const [a, b] = [f(axis.min), f(axis.max)];
  const at = v => from + ((f(Math.min(Math.max(v, Math.min(axis.min, axis.max)), Math.max(axis.min, axis.max))) - a)
    / (b - a)) * (to - from);
  const back = pixel => {
    const v = a + ((pixel - from) / (to - from)) * (b - a);
    return axis.log ? 10 ** v : v;
  };
  return { at, back };
}

// A curve is { solver, x, y }; of a stepped one, `before` is its value before its first step, if it has one, and `ends`
// says that it has none after its last.

/** The value of a curve at x: of the last step at or before it, or of the point nearest to it; NaN where there is none. */
function valueAt(curve, x, stepped) {
  if (!stepped) {
    let k = 0;
    curve.x.forEach((v, i) => {
      if (Math.abs(Math.log(v / x)) < Math.abs(Math.log(curve.x[k] / x))) k = i;
    });
    return curve.y[k];
  }
  let [low, high] = [0, curve.x.length];
  if (curve.ends && x > curve.x[high - 1]) return NaN;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (curve.x[middle] <= x) low = middle + 1; else high = middle;
  }
  return low ? curve.y[low - 1] : curve.before ?? NaN;
}

function pathOf(curve, x, y, axis, stepped) {
  const n = v => v.toFixed(1);
  if (!stepped) return curve.x.map((v, k) => `${k ? "L" : "M"}${n(x.at(v))} ${n(y.at(curve.y[k]))}`).join("");
  let text = curve.before === undefined ? "" : `M${n(x.at(axis.min))} ${n(y.at(curve.before))}`;
  let last = "";
  curve.x.forEach((v, k) => {
    if (v > axis.max) return;
    const [px, py] = [n(x.at(v)), n(y.at(curve.y[k]))];
    text += text ? (px === last ? `V${py}` : `H${px}V${py}`) : `M${px} ${py}`;
    last = px;
  });
  return text && (curve.ends ? text : `${text}H${n(x.at(axis.max))}`);
}

const sample = (s, x, y, paper) => g("line", {
  x1: x, x2: x + 26, y1: y, y2: y, "stroke-width": s === BEST ? 1.4 : 1.8, "stroke-dasharray": dashOf(s) || null,
  style: `stroke:${inkOf(colourOf(s), paper)}`,
});

/** A legend in columns under a drawing: [element, height]. */
function legend(solvers, width, top, paper) {
  const longest = Math.max(0, ...solvers.map(s => labelOf(s).length));
  const columns = Math.max(1, Math.min(solvers.length, Math.floor((width - 20) / (44 + longest * 6.4))));
  const rows = Math.ceil(solvers.length / columns);
  const group = g("g", { class: "legend" });
  solvers.forEach((s, k) => {
    const x = 12 + Math.floor(k / rows) * ((width - 20) / columns);
    const y = top + 10 + (k % rows) * 17;
    group.append(sample(s, x, y, paper), g("text", { x: x + 32, y: y + 4, style: `fill:${inkOf("text", paper)}` }, clean(labelOf(s))));
  });
  return [group, rows * 17 + 10];
}

/** XML 1.0 knows no control characters. */
const clean = text => String(text).replace(/[\u0000-\u0008\u000b-\u001f\u007f-\u009f\ufffe\uffff]/g, "\ufffd");

/**
 * Draws a figure: { title, x: { label, log, min, max }, y: { … }, stepped, panels: [{ title, curves }] }.
 * `options`: width; paper (fixed inks on white, with title and legend). Returns { svg, panels } with the scales.
 */
function draw(figure, { width, paper = false }) {
  const ink = name => `fill:${inkOf(name, paper)}`;
  const line = (name, more = "") => `stroke:${inkOf(name, paper)};${more}`;
  const count = figure.panels.length;
  const columns = Math.max(1, Math.min(count, Math.floor(width / 230)));
  const margin = { left: 62, right: 20, top: count > 1 ? 24 : 10, bottom: 42 };
  const cell = width / columns;
  const inner = cell - margin.left - margin.right;
  const tall = count > 1 ? Math.min(230, Math.max(170, inner)) : Math.min(380, Math.max(220, inner * 0.58));
  const rows = Math.ceil(count / columns);
  const head = paper ? 26 : 0;
  const body = rows * (tall + margin.top + margin.bottom);
  const svg = g("svg", {
    xmlns: SVG, role: "img", "font-family": "system-ui, 'Segoe UI', 'Helvetica Neue', Arial, sans-serif", "font-size": 12,
    "aria-label": clean(figure.title),
  });
  const solvers = figure.solvers;
  const [key, keyHeight] = legend(solvers, width, head + body, paper);
  const height = head + body + (paper ? keyHeight : 0);
  svg.setAttribute("viewBox", `0 0 ${Math.round(width)} ${Math.round(height)}`);
  svg.setAttribute("width", Math.round(width));
  svg.setAttribute("height", Math.round(height));
  if (paper) {
    svg.append(g("title", {}, clean(figure.title)), g("rect", { width: "100%", height: "100%", style: ink("page") }));
    svg.append(g("text", { x: 12, y: 18, "font-weight": 600, style: ink("text") }, clean(figure.title)));
  }
  const panels = figure.panels.map((panel, k) => {
    const left = (k % columns) * cell + margin.left;
    const top = head + Math.floor(k / columns) * (tall + margin.top + margin.bottom) + margin.top;
    const x = scale(figure.x, left, left + inner);
    const y = scale(figure.y, top + tall, top);
    if (count > 1) svg.append(g("text", { x: left, y: top - 8, "font-weight": 600, style: ink("text") }, clean(panel.title)));
    const spread = Math.max(2, inner / 46);
    const ticks = (axis, room) => {
      if (!axis.log) return { ticks: axis.ticks, minor: [] };
      return logTicks(Math.min(axis.min, axis.max), Math.max(axis.min, axis.max), room);
    };
    const [tx, ty] = [ticks(figure.x, spread), ticks(figure.y, tall / 26)];
    const grid = g("g", { "shape-rendering": "crispEdges" });
    for (const [v] of tx.ticks) grid.append(g("line", { x1: x.at(v), x2: x.at(v), y1: top, y2: top + tall, style: line("grid") }));
    for (const [v] of ty.ticks) grid.append(g("line", { x1: left, x2: left + inner, y1: y.at(v), y2: y.at(v), style: line("grid") }));
    for (const v of tx.minor) grid.append(g("line", { x1: x.at(v), x2: x.at(v), y1: top + tall, y2: top + tall + 3, style: line("axis") }));
    for (const [v] of tx.ticks) grid.append(g("line", { x1: x.at(v), x2: x.at(v), y1: top + tall, y2: top + tall + 5, style: line("axis") }));
    grid.append(g("path", { d: `M${left} ${top}V${top + tall}H${left + inner}`, fill: "none", style: line("axis") }));
    svg.append(grid);
    for (const [v, text] of tx.ticks) {
      svg.append(g("text", { x: x.at(v), y: top + tall + 19, "text-anchor": "middle", style: ink("text") }, text));
    }
    for (const [v, text] of ty.ticks) {
      svg.append(g("text", { x: left - 7, y: y.at(v) + 4, "text-anchor": "end", style: ink("text") }, text));
    }
    svg.append(g("text", { x: left + inner / 2, y: top + tall + 36, "text-anchor": "middle", style: ink("faint") }, clean(figure.x.label)));
    if (k % columns === 0) {
      svg.append(g("text", {
        x: 0, y: 0, transform: `translate(${left - 50} ${top + tall / 2}) rotate(-90)`, "text-anchor": "middle", style: ink("faint"),
      }, clean(figure.y.label)));
    }
    // The virtual best lies under the others.
    const ordered = [...panel.curves].sort((a, b) => (a.solver === BEST ? -1 : 0) - (b.solver === BEST ? -1 : 0));
    const curves = g("g", { fill: "none", "stroke-linejoin": "round" });
    for (const curve of ordered) {
      const d = pathOf(curve, x, y, figure.x, figure.stepped);
      if (!d) continue;
      const paint = line(colourOf(curve.solver), `stroke-width:${curve.solver === BEST ? 1.4 : 1.8}`);
      curves.append(g("path", {
        d, class: "curve", "data-solver": curve.solver, "stroke-dasharray": dashOf(curve.solver) || null, style: paint,
      }));
      if (!figure.stepped) {
        const radius = curve.solver === BEST ? 1.5 : 2.2;
        const dots = g("g", { class: "curve", "data-solver": curve.solver, style: `fill:${inkOf(colourOf(curve.solver), paper)}` });
        curve.x.forEach((v, i) => dots.append(g("circle", { cx: x.at(v).toFixed(1), cy: y.at(curve.y[i]).toFixed(1), r: radius })));
        curves.append(dots);
      }
    }
    if (!curves.childNodes.length) {
      svg.append(g("text", { x: left + inner / 2, y: top + tall / 2, "text-anchor": "middle", style: ink("faint") }, "nothing to show"));
    }
    svg.append(curves);
    return { x, y, left, top, width: inner, height: tall, curves: panel.curves, title: panel.title };
  });
  if (paper) svg.append(key);
  return { svg, panels, height };
}

// ------------------------------------------------------------------------------------------------ files

const EXPORT_WIDTH = 640;

function svgText(figure) {
  const { svg } = draw(figure, { width: figure.panels.length > 1 ? 1.5 * EXPORT_WIDTH : EXPORT_WIDTH, paper: true });
  return `<?xml version="1.0" encoding="UTF-8"?>\n${new XMLSerializer().serializeToString(svg)}\n`;
}

/** The figure as PNG, three pixels to each unit of the drawing. */
async function pngBlob(figure) {
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svgText(figure))}`;
  await image.decode();
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [3 * image.width, 3 * image.height];
  const context = canvas.getContext("2d");
  context.fillStyle = PAPER.page;
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((resolve, reject) => {
    canvas.toBlob(blob => (blob ? resolve(blob) : reject(new Error("the picture is too large for this browser"))), "image/png");
  });
}

const csvField = value => {
  const text = value === null || value === undefined || Number.isNaN(value) ? "" : String(value);
  return /[",\n\r]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
};
const csvText = rows => rows.map(row => `${row.map(csvField).join(",")}\r\n`).join("");

/** The points of a figure, one a line. */
function figureCsv(figure) {
  const many = figure.panels.some(panel => panel.title);
  const head = [...(many ? ["panel"] : []), "solver", figure.x.name, figure.y.name];
  return csvText([head, ...figure.panels.flatMap(panel => panel.curves.flatMap(curve => curve.x.map((x, k) => (
    [...(many ? [panel.name] : []), labelled(curve.solver), x, curve.y[k]]))))]);
}

function save(name, blob) {
  const address = URL.createObjectURL(blob);
  h("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}
