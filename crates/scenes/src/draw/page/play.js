// Plays a motion, as playback.rs describes it, with three.js; names follow it.

import * as THREE from 'three';
import { arrows, chainEnd, cone, element, grid, instances, keyEntry, largest, place, polyhedra, rod, short, sphere, stage, tips, vector } from 'common';

// Room beside a plot for its labels.
const [LEFT, RIGHT] = [52, 12];

const data = JSON.parse(element('data').textContent);
const { bodies, colours } = data;

/** The bytes of a table. */
function bytes(text) {
  const packed = atob(text);
  const out = new Uint8Array(packed.length);
  for (let k = 0; k < packed.length; k++) out[k] = packed.charCodeAt(k);
  return out.buffer;
}
const times = new Float64Array(bytes(data.times));
const positions = new Float32Array(bytes(data.positions));
const rotations = new Int16Array(bytes(data.rotations));
const ends = new Uint32Array(bytes(data.ends));
const pairs = new Int32Array(bytes(data.pairs));
const numbers = new Float32Array(bytes(data.forces));
const offsets = new Float32Array(bytes(data.offsets));
const statuses = new Uint8Array(bytes(data.statuses));
const energy = new Float32Array(bytes(data.energy));
const residual = new Float32Array(bytes(data.residual));
const shapes = new Float32Array(bytes(data.shapes));
const [first, last] = [times[0], times[times.length - 1]];

const NAMES = ['near', 'open', 'stick', 'slip'];
const themed = name => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const quantile = (all, share) => all.length === 0 ? 0 : all[Math.min(all.length - 1, Math.floor(share * all.length))];
const sorted = all => Float64Array.from(all).sort();
const bodyName = k => bodies[k].name || `body ${k}`;

/** The contacts of a frame. */
function contactsOf(frame) {
  const all = [];
  for (let k = frame === 0 ? 0 : ends[frame - 1]; k < ends[frame]; k++) {
    all.push({
      number: k, a: pairs[2 * k], b: pairs[2 * k + 1], status: NAMES[statuses[k]],
      point: vector(numbers.subarray(6 * k, 6 * k + 3)), offset: offsets.length > 0 ? vector(offsets.subarray(3 * k, 3 * k + 3)) : null, impulse: vector(numbers.subarray(6 * k + 3, 6 * k + 6)),
    });
  }
  return all;
}
const statusColour = contact => colours[contact.status] ?? colours.contact;

// ---------------------------------------------------------------------------------------------------- sizes

const moving = bodies.map((_, k) => k).filter(k => !bodies[k].fixed);
/** The middle radius of what moves, by which arrows are long. */
const size = quantile(sorted(moving.map(k => bodies[k].radius).filter(r => r > 0)), 0.5) || 1;
const width = 0.15 * size;

/** What is to be seen: where bodies are most of the time, so that one that flies away does not make all others small. */
function seen() {
  const every = Math.max(1, Math.floor(data.frames * bodies.length / 50000));
  const lists = [[], [], []];
  for (let frame = 0; frame < data.frames; frame += every) {
    for (const k of moving.length > 0 ? moving : bodies.keys()) {
      for (const d of [0, 1, 2]) lists[d].push(positions[3 * (frame * bodies.length + k) + d]);
    }
  }
  const ranges = lists.map(sorted);
  const box = new THREE.Box3(vector(ranges.map(r => quantile(r, 0.01))), vector(ranges.map(r => quantile(r, 0.99))));
  box.expandByScalar(largest(moving.map(k => bodies[k].radius)) || size);
  return box.getBoundingSphere(new THREE.Sphere());
}
const ball = seen();
/** The impulse that is drawn at full length: nearly the largest, but for the peaks of impacts. */
const strong = (() => {
  const sizes = [];
  for (let k = 0; k < numbers.length; k += 6) {
    const r = Math.hypot(numbers[k + 3], numbers[k + 4], numbers[k + 5]);
    if (r > 0) sizes.push(r);
  }
  return quantile(sorted(sizes), 0.95);
})();

const canvas = element('scene');
const eye = stage(canvas, ball, data.view, themed('ground'));
const { scene } = eye;

// ---------------------------------------------------------------------------------------------------- bodies

/** A round solid in two shades, so that one sees it turn. */
function shaded(geometry, dark) {
  const g = geometry.index ? geometry.toNonIndexed() : geometry;
  const at = g.getAttribute('position');
  const shades = new Float32Array(3 * at.count);
  for (let k = 0; k < at.count; k += 3) {
    const middle = [0, 1, 2].map(d => at.getComponent(k, d) + at.getComponent(k + 1, d) + at.getComponent(k + 2, d));
    shades.fill(dark(...middle) ? 0.78 : 1, 3 * k, 3 * k + 9);
  }
  return g.setAttribute('color', new THREE.BufferAttribute(shades, 3));
}
function plain(geometry) {
  return geometry.setAttribute('color', new THREE.BufferAttribute(new Float32Array(3 * geometry.getAttribute('position').count).fill(1), 3));
}

const solidMaterial = new THREE.MeshLambertMaterial({ color: '#fff', vertexColors: true, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
const edgeMaterial = new THREE.LineBasicMaterial({ color: colours.edge, transparent: true });
const corners = [[-1, -1, -1], [1, -1, -1], [-1, 1, -1], [1, 1, -1], [-1, -1, 1], [1, -1, 1], [-1, 1, 1], [1, 1, 1]];
const cube = { vertices: corners, faces: [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] };

/** Solids of one shape: the geometry, what its copies are scaled by, and its edges as pairs of points. */
function shapeOf(form) {
  if (form.sphere) {
    const make = () => [shaded(sphere, (x, y, z) => x * y * z > 0), null];
    return { key: 'sphere', scale: [form.sphere.radius, form.sphere.radius, form.sphere.radius], make };
  }
  const solid = shape => {
    const [faces, edges] = polyhedra([shape]);
    return [plain(faces), edges.getAttribute('position').array];
  };
  if (form.box) return { key: 'box', scale: form.box.half, make: () => solid(cube) };
  if (form.capsule) {
    const { half_length: half, radius } = form.capsule;
    const make = () => [shaded(new THREE.CapsuleGeometry(radius, 2 * half, 10, 24).rotateX(Math.PI / 2), (x, y) => x * y > 0), null];
    return { key: `capsule ${half} ${radius}`, scale: [1, 1, 1], make };
  }
  const round = form.cylinder ?? form.cone;
  if (round) {
    const { half_length: half, radius } = round;
    const top = form.cone ? 0 : radius;
    const make = () => {
      const geometry = new THREE.CylinderGeometry(top, radius, 2 * half, 32).rotateX(Math.PI / 2);
      return [shaded(geometry, (x, y) => x * y > 0), null];
    };
    return { key: `cylinder ${half} ${radius} ${top}`, scale: [1, 1, 1], make };
  }
  if (form.mesh) return { key: JSON.stringify(form.mesh), scale: [1, 1, 1], make: () => [plain(polyhedra([form.mesh])[0]), null] };
  return { key: JSON.stringify(form.polyhedron), scale: [1, 1, 1], make: () => solid(form.polyhedron) };
}
const rotationOf = ([w, x, y, z]) => new THREE.Quaternion(x, y, z, w);
const solids = new THREE.Group();
const kinds = new Map();
const sheets = [];
bodies.slice(0, bodies.length - data.deforming).forEach((body, k) => body.parts.forEach(({ form, position, rotation }) => {
  const local = new THREE.Matrix4().compose(vector(position), rotationOf(rotation), new THREE.Vector3(1, 1, 1));
  if (form === 'plane') {
    sheets.push({ body: k, local });
    return;
  }
  const { key, scale, make } = shapeOf(form);
  if (!kinds.has(key)) kinds.set(key, { shape: make(), copies: [] });
  kinds.get(key).copies.push({ body: k, local: local.scale(vector(scale)) });
}));
for (const kind of kinds.values()) {
  const { shape: [geometry], copies } = kind;
  kind.mesh = instances(geometry, copies.length, solidMaterial);
  kind.mesh.frustumCulled = false;
  copies.forEach(({ body }, i) => kind.mesh.setColorAt(i, new THREE.Color(bodies[body].fixed ? colours.obstacle : colours.bodies[body % colours.bodies.length])));
  kind.mesh.userData.bodies = copies.map(copy => copy.body);
  solids.add(kind.mesh);
}
/** The edges of all solids are one object, its points moved with them; too many are left out. */
const MOST_EDGES = 400000;
const edged = [...kinds.values()].filter(kind => kind.shape[1]);
const edgePoints = edged.reduce((sum, { shape, copies }) => sum + copies.length * shape[1].length / 3, 0);
let edges = null;
if (edgePoints > 0 && edgePoints <= MOST_EDGES) {
  edges = new THREE.LineSegments(new THREE.BufferGeometry().setAttribute('position', new THREE.BufferAttribute(new Float32Array(3 * edgePoints), 3)), edgeMaterial);
  edges.frustumCulled = false;
  solids.add(edges);
}
/** Bodies that deform: triangles and lines between vertices that each frame has anew, `width` numbers a frame. */
const soft = { width: 0, all: [] };
bodies.slice(bodies.length - data.deforming).forEach((body, k) => {
  const { vertices, faces } = body.parts[0].form.mesh;
  const corners = faces.flatMap(face => face.slice(2).flatMap((_, i) => [face[0], face[i + 1], face[i + 2]]));
  const sides = faces.flatMap(face => face.flatMap((from, i) => [from, face[(i + 1) % face.length]]));
  const empty = count => new THREE.BufferGeometry().setAttribute('position', new THREE.BufferAttribute(new Float32Array(3 * count), 3));
  const number = bodies.length - data.deforming + k;
  const material = solidMaterial.clone();
  material.color.set(colours.bodies[number % colours.bodies.length]);
  const mesh = new THREE.Mesh(plain(empty(corners.length)), material);
  const lines = new THREE.LineSegments(empty(sides.length), edgeMaterial);
  mesh.frustumCulled = lines.frustumCulled = false;
  mesh.userData.bodies = [number];
  solids.add(mesh, lines);
  soft.all.push({ first: soft.width, mesh, parts: [[mesh, corners], [lines, sides]] });
  soft.width += 3 * vertices.length;
});
/** Puts them where they are, a share of the way from a frame to the next. */
function deform(frame, share) {
  for (const { first, mesh, parts } of soft.all) {
    for (const [{ geometry }, ends] of parts) {
      const to = geometry.getAttribute('position');
      ends.forEach((vertex, i) => {
        for (const d of [0, 1, 2]) {
          const k = frame * soft.width + first + 3 * vertex + d;
          to.array[3 * i + d] = share > 0 ? (1 - share) * shapes[k] + share * shapes[k + soft.width] : shapes[k];
        }
      });
      to.needsUpdate = true;
    }
    mesh.geometry.computeVertexNormals();
    mesh.geometry.boundingSphere = null;
  }
}
scene.add(solids);

const ground = new THREE.Group();
let sheetGroups = [];
/** Planes as sheets with a grid, in the colours of the theme. */
function layGround() {
  ground.clear();
  sheetGroups = sheets.map(({ body, local }) => {
    const group = new THREE.Group();
    group.matrixAutoUpdate = false;
    const pose = poseOf(0, 0, body, new THREE.Matrix4()).multiply(local);
    const centre = ball.center.clone().applyMatrix4(pose.clone().invert()).setZ(0);
    const side = 3 * ball.radius;
    const material = new THREE.MeshBasicMaterial({ color: themed('sheet'), transparent: true, opacity: 0.3, side: THREE.DoubleSide, forceSinglePass: true, depthWrite: false });
    const sheet = new THREE.Mesh(new THREE.PlaneGeometry(side, side), material);
    sheet.position.copy(centre).setZ(-1e-3 * ball.radius);
    group.add(sheet, grid(side, sheet.position, new THREE.Vector3(1, 0, 0), new THREE.Vector3(0, 0, 1), [themed('line'), themed('thin')]));
    ground.add(group);
    return { body, local, group };
  });
}
scene.add(ground);

const [here, there, turn, next] = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Quaternion(), new THREE.Quaternion()];
const one = new THREE.Vector3(1, 1, 1);
/** Where a body is, a share of the way from a frame to the next. */
function poseOf(frame, share, body, matrix) {
  const read = (f, at, q) => {
    const i = f * bodies.length + body;
    at.fromArray(positions, 3 * i);
    q.set(rotations[4 * i + 1], rotations[4 * i + 2], rotations[4 * i + 3], rotations[4 * i]).normalize();
  };
  read(frame, here, turn);
  if (share > 0) {
    read(frame + 1, there, next);
    // What has come in on the other side of a cell was not between.
    if (data.jump && here.distanceTo(there) > data.jump) share = share < 0.5 ? 0 : 1;
    here.lerp(there, share);
    turn.slerp(next, share);
  }
  return matrix.compose(here, turn, one);
}

// ---------------------------------------------------------------------------------------------------- a moment

const poses = bodies.map(() => new THREE.Matrix4());
const [product, point] = [new THREE.Matrix4(), new THREE.Vector3()];
const centre = k => new THREE.Vector3().setFromMatrixPosition(poses[k]);
const most = ends.reduce((count, end, k) => Math.max(count, end - (k === 0 ? 0 : ends[k - 1])), 0);
const [rods, heads, chains] = [instances(rod, most), instances(cone, most), instances(rod, 2 * most)];
const dots = instances(new THREE.SphereGeometry(1, 12, 8).scale(1, 0.5, 1).translate(0, 0.5, 0), most);
const arrowGroup = new THREE.Group().add(rods, heads);
scene.add(arrowGroup, chains, dots);

let time = first;
let contacts = [];
let followed = -1;

/** The frame before a time and the share of the way to the next. */
function frameAt(t) {
  let [low, high] = [0, data.frames - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle; else high = middle;
  }
  if (t >= times[high]) return [high, 0];
  const span = times[low + 1] - times[low];
  return [low, span > 0 ? (t - times[low]) / span : 0];
}

function show() {
  const [frame, share] = frameAt(time);
  const before = followed >= 0 ? centre(followed) : null;
  bodies.forEach((_, k) => poseOf(frame, share, k, poses[k]));
  for (const { copies, mesh } of kinds.values()) {
    copies.forEach(({ body, local }, i) => mesh.setMatrixAt(i, product.multiplyMatrices(poses[body], local)));
    mesh.instanceMatrix.needsUpdate = true;
    // Computed anew when somebody points at it.
    mesh.boundingSphere = null;
  }
  deform(frame, share);
  if (edges) {
    const to = edges.geometry.getAttribute('position');
    let at = 0;
    for (const { shape, copies } of edged) {
      for (const { body, local } of copies) {
        product.multiplyMatrices(poses[body], local);
        for (let i = 0; i < shape[1].length; i += 3) {
          point.fromArray(shape[1], i).applyMatrix4(product).toArray(to.array, at);
          at += 3;
        }
      }
    }
    to.needsUpdate = true;
  }
  for (const { body, local, group } of sheetGroups) {
    group.matrix.multiplyMatrices(poses[body], local);
    group.matrixWorldNeedsUpdate = true;
  }
  // Contacts belong to the step that ends at a frame: those of the nearer one.
  contacts = contactsOf(share < 0.5 ? frame : frame + 1);
  forces();
  if (before) {
    const way = centre(followed).sub(before);
    eye.controls.target.add(way);
    eye.camera.position.add(way);
    eye.camera.updateMatrixWorld();
  }
  tell();
  eye.draw();
}

/** The shown impulses: peaks beyond three times the strong ones are cut, since they would hide all else. */
function forces() {
  const kind = element('forces').value;
  [arrowGroup.visible, chains.visible, dots.visible] = [kind === 'arrows', kind === 'chains', element('contacts').checked];
  const pressed = contacts.filter(contact => contact.impulse.length() > 1e-3 * strong);
  if (arrowGroup.visible) {
    const all = pressed.map(c => ({ from: c.point, vector: c.impulse.clone().clampLength(0, 3 * strong), contact: c, colour: statusColour(c) }));
    const [lines, tips] = arrows(all, strong, 1.6 * size, 0.3 * width);
    place(rods, lines);
    place(heads, tips);
  }
  if (chains.visible) {
    // An image of the first body touches where that itself is not.
    const touched = (c, k) => k === c.a && c.offset ? c.point.clone().sub(c.offset) : c.point;
    const halves = pressed.flatMap(c => [c.a, c.b].filter(k => k >= 0 && !bodies[k].fixed).map(k => ({
      from: touched(c, k), to: chainEnd(touched(c, k), centre(k), c.impulse, bodies[k].ball), contact: c,
      radius: width * Math.min(c.impulse.length() / strong, 2.5), colour: statusColour(c),
    })));
    place(chains, halves.filter(half => half.from.distanceTo(half.to) > 0));
  }
  if (dots.visible) {
    const radius = 0.4 * width;
    place(dots, contacts.map(c => ({ from: c.point.clone().add(new THREE.Vector3(0, -radius, 0)), to: c.point.clone().add(new THREE.Vector3(0, radius, 0)), radius, contact: c, colour: statusColour(c) })));
  }
}

// ---------------------------------------------------------------------------------------------------- the panel and the bar

const digits = Math.max(2, Math.min(6, Math.ceil(-Math.log10((last - first) / data.frames || 1))));
function tell() {
  element('clock').textContent = `${time.toFixed(digits)} of ${short(last)} s`;
  element('time').value = time;
  const key = element('key');
  key.textContent = '';
  const count = name => contacts.filter(contact => contact.status === name).length;
  for (const name of ['stick', 'slip', 'open']) keyEntry(key, colours[name], `${count(name)} ${name}`);
  if (count('near') > 0) keyEntry(key, colours.contact, `${count('near')} near`);
  if (strong > 0) key.append(`impulses up to ${short(largest(contacts.map(c => c.impulse.length())))} N s`);
  moveCursors();
}

function apply() {
  const opacity = Number(element('opacity').value);
  solids.visible = element('bodies').checked && opacity > 0;
  [solidMaterial.opacity, edgeMaterial.opacity] = [opacity, Math.min(1, 0.15 + opacity)];
  solidMaterial.transparent = opacity < 1;
  // What lies behind a transparent body is seen.
  solidMaterial.depthWrite = opacity === 1;
  solidMaterial.needsUpdate = true;
  element('plots').hidden = plots.length === 0 || !element('plotted').checked;
  forces();
  eye.resize();
  drawPlots();
}

function follow(k) {
  followed = k;
  element('follow').value = String(k);
}

let playing = false;
let clock = 0;
function play(on) {
  playing = on;
  const button = element('play');
  button.textContent = on ? '❚❚' : '▶';
  button.setAttribute('aria-label', on ? 'pause' : 'play');
  if (!on) return;
  if (time >= last) time = first;
  clock = performance.now();
  requestAnimationFrame(tick);
}
function tick(now) {
  if (!playing) return;
  time += Math.max(0, now - clock) / 1000 * Number(element('speed').value);
  clock = now;
  if (time >= last) {
    if (element('again').checked && last > first) time = first + (time - first) % (last - first);
    else {
      time = last;
      play(false);
    }
  }
  show();
  if (playing) requestAnimationFrame(tick);
}
function seek(t) {
  time = Math.min(last, Math.max(first, t));
  clock = performance.now();
  show();
}
/** To the frame before or after. */
function step(by) {
  play(false);
  const [frame, share] = frameAt(time);
  const to = by > 0 || share === 0 ? frame + by : frame;
  seek(times[Math.min(data.frames - 1, Math.max(0, to))]);
}

// ---------------------------------------------------------------------------------------------------- curves

const curve = (table, stride, of) => Array.from({ length: table.length / stride }, (_, k) => [table[stride * k], of(...table.subarray(stride * k, stride * k + stride))]);
const plots = [];
if (energy.length > 0) {
  plots.push({ title: 'energy, J', log: false, curves: [
    { name: 'kinetic', points: curve(energy, 3, (_, kinetic) => kinetic) },
    { name: 'potential', points: curve(energy, 3, (_, kinetic, potential) => potential) },
    { name: 'total', points: curve(energy, 3, (_, kinetic, potential) => kinetic + potential) },
  ] });
}
if (residual.length > 0) plots.push({ title: 'residual of the steps', log: true, curves: [{ name: 'residual', points: curve(residual, 2, (_, r) => r) }] });
for (const plot of plots) {
  const figure = element('plots').appendChild(document.createElement('figure'));
  const caption = figure.appendChild(document.createElement('figcaption'));
  caption.append(plot.title);
  for (const { name } of plot.curves.length > 1 ? plot.curves : []) {
    const word = caption.appendChild(document.createElement('span'));
    word.className = name;
    word.textContent = name;
  }
  plot.svg = figure.appendChild(svg('svg', { role: 'img', 'aria-label': `${plot.title} against time` }));
  const toTime = event => {
    const { left, width } = plot.svg.getBoundingClientRect();
    return first + (event.clientX - left - LEFT) / (width - LEFT - RIGHT) * (last - first);
  };
  plot.svg.addEventListener('pointerdown', event => { plot.svg.setPointerCapture(event.pointerId); seek(toTime(event)); });
  plot.svg.addEventListener('pointermove', event => { if (event.buttons) seek(toTime(event)); });
}

function svg(name, attributes) {
  const node = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  return node;
}

/** Round numbers between two, about four of them; of a logarithm whole powers of ten. */
function ticks(low, high, log) {
  const rough = (high - low) / (log ? 3 : 4);
  const power = 10 ** Math.floor(Math.log10(rough));
  const unit = log ? Math.max(1, Math.ceil(rough)) : power * [1, 2, 5, 10].find(m => m * power >= rough);
  const all = [];
  for (let k = Math.ceil(low / unit - 1e-9); k * unit <= high + 1e-9 * unit; k++) all.push(k * unit);
  return all;
}

function drawPlots() {
  if (element('plots').hidden) return;
  for (const plot of plots) {
    const { clientWidth: wide, clientHeight: high } = plot.svg;
    const height = plot.log ? y => y > 0 ? Math.log10(y) : NaN : y => y;
    const all = plot.curves.flatMap(c => c.points.map(([, y]) => height(y))).filter(Number.isFinite);
    let [low, top] = [all.reduce((a, b) => Math.min(a, b), Infinity), all.reduce((a, b) => Math.max(a, b), -Infinity)];
    if (!(low <= top)) [low, top] = [plot.log ? -16 : 0, plot.log ? 0 : 1];
    if (plot.log) [low, top] = [Math.floor(low), Math.max(Math.ceil(top), Math.floor(low) + 1)];
    const room = Math.max(0.06 * (top - low), plot.log ? 0 : 1e-6 * Math.max(Math.abs(top), Math.abs(low)), 1e-30);
    [low, top] = [low - room, top + room];
    const [x, y] = [t => LEFT + (wide - LEFT - RIGHT) * (last > first ? (t - first) / (last - first) : 0), v => 4 + (high - 24) * (top - v) / (top - low)];
    plot.x = x;
    plot.svg.replaceChildren();
    plot.svg.setAttribute('viewBox', `0 0 ${wide} ${high}`);
    const text = (at, words, anchor) => { plot.svg.appendChild(svg('text', { x: at[0], y: at[1], 'text-anchor': anchor })).textContent = words; };
    for (const v of ticks(low, top, plot.log)) {
      plot.svg.append(svg('line', { class: 'frame', x1: LEFT, x2: wide - RIGHT, y1: y(v), y2: y(v) }));
      text([LEFT - 5, y(v) + 4], plot.log ? `1e${v}` : short(Math.abs(v) < 1e-9 * (top - low) ? 0 : v), 'end');
    }
    for (const t of ticks(first, last > first ? last : first + 1, false)) text([x(t), high - 5], `${short(t)}${t === 0 ? ' s' : ''}`, 'middle');
    for (const { name, points } of plot.curves) {
      let [d, pen] = ['', 'M'];
      for (const [t, value] of points) {
        const v = height(value);
        if (Number.isFinite(v)) d += `${pen}${x(t).toFixed(1)} ${y(v).toFixed(1)}`;
        pen = Number.isFinite(v) ? 'L' : 'M';
      }
      plot.svg.append(svg('path', { class: `curve ${name}`, d }));
    }
    plot.cursor = plot.svg.appendChild(svg('line', { class: 'cursor', y1: 2, y2: high - 18 }));
  }
  moveCursors();
}
function moveCursors() {
  for (const { cursor, x } of plots) {
    if (!cursor) continue;
    cursor.setAttribute('x1', x(time));
    cursor.setAttribute('x2', x(time));
  }
}

// ---------------------------------------------------------------------------------------------------- hands

/** The contact or body at a place of the window. */
function under(x, y) {
  const solid = solids.visible && Number(element('opacity').value) === 1;
  const targets = [rods, heads, chains, dots].filter(mesh => mesh.count > 0 && (mesh.parent === scene ? mesh : mesh.parent).visible);
  // Through a transparent body one points at what is inside.
  if (solid) targets.push(...[...kinds.values()].map(kind => kind.mesh), ...soft.all.map(({ mesh }) => mesh));
  const hit = eye.hit(x, y, targets);
  if (!hit) return {};
  const { contacts: touched, bodies: owners } = hit.object.userData;
  return touched ? { contact: touched[hit.instanceId] } : { body: owners[hit.instanceId ?? 0] };
}
tips(canvas, (x, y) => {
  const { contact, body } = under(x, y);
  const three = v => `(${v.toArray().map(short).join(', ')})`;
  if (contact) {
    const pair = [contact.a, contact.b].map(k => k < 0 ? 'ground' : bodyName(k)).join(' – ');
    return `contact: ${contact.status}\n${pair}\nr ${three(contact.impulse)} N s`;
  }
  return body === undefined ? '' : `${bodyName(body)}${bodies[body].fixed ? ', fixed' : ''}\nx ${three(centre(body))} m`;
});
canvas.addEventListener('dblclick', event => follow(under(event.clientX, event.clientY).body ?? -1));

/** A list of all bodies is of use only while it can be read. */
const LISTED = 500;
moving.slice(0, LISTED).forEach(k => element('follow').append(new Option(bodyName(k), k)));
for (const [k, body] of bodies.entries()) {
  if (body.fixed || moving.indexOf(k) >= LISTED) element('follow').append(Object.assign(new Option(bodyName(k), k), { hidden: true }));
}
// Slow enough to see it.
const speeds = [0.001, 0.01, 0.03, 0.1, 0.25, 0.5, 1, 2, 4, 10, 100];
const usual = [...speeds].reverse().find(s => s <= 1 && (last - first) / s >= 4) ?? speeds[0];
for (const s of speeds) element('speed').append(new Option(`${s} ×`, s, s === usual, s === usual));

const fewer = data.every > 1 ? `, one of ${data.every} of the ${data.recorded} recorded: the motion takes no more than ${short(data.limit / 1e6)} MB` : '';
element('said').textContent = `${bodies.length} bodies, ${data.frames} frames${fewer}.`;
element('panel').open = innerWidth > 700;
element('forces').value = strong > 0 ? 'arrows' : 'none';
element('forces').disabled = strong === 0;
element('curves').hidden = plots.length === 0;
Object.assign(element('time'), { min: first, max: last, value: first });
for (const id of ['bodies', 'opacity', 'forces', 'contacts', 'plotted']) element(id).addEventListener('input', apply);
element('follow').addEventListener('input', event => follow(Number(event.target.value)));
element('reset').addEventListener('click', () => { follow(-1); eye.home(); });
element('play').addEventListener('click', () => play(!playing));
element('time').addEventListener('input', event => seek(Number(event.target.value)));
element('bar').addEventListener('submit', event => event.preventDefault());
addEventListener('keydown', event => {
  if (event.target.matches?.('input, select, button, summary')) return;
  const does = { ' ': () => play(!playing), ArrowRight: () => step(1), ArrowLeft: () => step(-1), Home: () => seek(first), End: () => seek(last) }[event.key];
  if (!does) return;
  event.preventDefault();
  does();
});
addEventListener('resize', drawPlots);
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
  scene.background.set(themed('ground'));
  layGround();
  show();
});

layGround();
show();
apply();
eye.home();

/** What can be asked of the page from outside. */
window.view = {
  drawn: eye.drawn, seek, play,
  playing: () => playing,
  time: () => time,
  contacts: () => contacts.length,
  at: body => eye.seen(centre(body)),
  place: number => eye.seen(contacts[number].point),
};
