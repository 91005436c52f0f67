// Draws a picture, as picture.rs describes it, with three.js; names follow it. Nothing moves by itself: a frame is drawn when something has changed.

import * as THREE from 'three';
import { OrbitControls } from 'controls';

const { picture, chains, size, width, forces, view, colours } = JSON.parse(document.getElementById('data').textContent);
const frame = picture.frames[picture.frames.length - 1];
const lines = chains[chains.length - 1];
const element = id => document.getElementById(id);
const canvas = element('scene');
const vector = x => new THREE.Vector3(...x);
const statusColour = contact => colours[contact.status ?? 'contact'];

/** The impulse on b in the frame of the world. */
const impulse = contact => {
  const r = new THREE.Vector3();
  contact.frame.forEach((axis, k) => r.addScaledVector(vector(axis), contact.r[k]));
  return r;
};

// ---------------------------------------------------------------------------------------------------- the scene

const scene = new THREE.Scene();
scene.background = new THREE.Color('#fff');
scene.add(new THREE.HemisphereLight('#fff', '#c8c8c8', 2.2));
const lamp = new THREE.DirectionalLight('#fff', 1.4);
scene.add(lamp, lamp.target);

const solidMaterials = new Map();
/** One material a colour, so that opacity is set once for all bodies of it. */
function solidMaterial(colour) {
  if (!solidMaterials.has(colour)) {
    solidMaterials.set(colour, new THREE.MeshLambertMaterial({ color: colour, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }));
  }
  return solidMaterials.get(colour);
}
const edgeMaterial = new THREE.LineBasicMaterial({ color: colours.edge, transparent: true });
const sphere = new THREE.SphereGeometry(1, 32, 20);

/** Faces as triangles with normals of their own, and edges as pairs of points. */
function polyhedra(parts) {
  const [triangles, edges] = [[], []];
  for (const { convex: { vertices, faces } } of parts) {
    const drawn = new Set();
    for (const face of faces) {
      for (let k = 1; k + 1 < face.length; k++) {
        for (const i of [0, k, k + 1]) triangles.push(...vertices[face[i]]);
      }
      // Most edges belong to two faces.
      face.forEach((from, k) => {
        const to = face[(k + 1) % face.length];
        const edge = `${Math.min(from, to)} ${Math.max(from, to)}`;
        if (!drawn.has(edge)) edges.push(...vertices[from], ...vertices[to]);
        drawn.add(edge);
      });
    }
  }
  const geometry = numbers => {
    const g = new THREE.BufferGeometry();
    return g.setAttribute('position', new THREE.Float32BufferAttribute(numbers, 3));
  };
  const faces = geometry(triangles);
  faces.computeVertexNormals();
  return [faces, geometry(edges)];
}

const bodies = new THREE.Group();
picture.bodies.forEach((body, k) => {
  const material = solidMaterial(body.fixed ? colours.obstacle : colours.bodies[k % colours.bodies.length]);
  const place = object => {
    const { position, rotation: [w, x, y, z] } = frame.poses[k];
    object.position.set(...position);
    object.quaternion.set(x, y, z, w);
    object.userData.body = body.fixed ? null : k;
    bodies.add(object);
  };
  for (const { ball } of body.parts.filter(part => part.ball)) {
    const mesh = new THREE.Mesh(sphere, material);
    mesh.scale.setScalar(ball.radius);
    place(mesh);
  }
  const convex = body.parts.filter(part => part.convex);
  if (convex.length > 0) {
    const [faces, edges] = polyhedra(convex);
    place(new THREE.Mesh(faces, material));
    place(new THREE.LineSegments(edges, edgeMaterial));
  }
});
scene.add(bodies);

const box = new THREE.Box3().setFromObject(bodies);
const ball = box.getBoundingSphere(new THREE.Sphere());

if (picture.ground) {
  const { point, normal, along } = picture.ground;
  const n = vector(normal).normalize();
  const t = vector(along).addScaledVector(n, -vector(along).dot(n)).normalize();
  const side = 3 * ball.radius;
  const grid = new THREE.GridHelper(side, 20, '#c2c8ce', '#dde1e5');
  // A grid lies across its y axis.
  grid.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(t, n, t.clone().cross(n)));
  const height = ball.center.clone().sub(vector(point)).dot(n);
  grid.position.copy(ball.center).addScaledVector(n, -height - 1e-3 * ball.radius);
  scene.add(grid);
}

// ---------------------------------------------------------------------------------------------------- contacts and arrows

const up = new THREE.Vector3(0, 1, 0);

/** Many copies of a shape along y, each from a point to another, with a radius and a colour; `owner` is the contact that each tells of. */
function along(shape, all) {
  const mesh = new THREE.InstancedMesh(shape, new THREE.MeshLambertMaterial({ color: '#fff' }), all.length);
  const [matrix, turn] = [new THREE.Matrix4(), new THREE.Quaternion()];
  all.forEach(({ from, to, radius, colour }, k) => {
    const way = to.clone().sub(from);
    turn.setFromUnitVectors(up, way.clone().normalize());
    matrix.compose(from, turn, new THREE.Vector3(radius, way.length(), radius));
    mesh.setMatrixAt(k, matrix);
    mesh.setColorAt(k, new THREE.Color(colour));
  });
  mesh.userData.contacts = all.map(one => one.contact);
  // The bounds of the instances, for picking and for what lies outside the view.
  mesh.computeBoundingSphere();
  return mesh;
}
// From the origin to y = 1.
const rod = new THREE.CylinderGeometry(1, 1, 1, 12).translate(0, 0.5, 0);
const cone = new THREE.ConeGeometry(1, 1, 16).translate(0, 0.5, 0);

const largest = all => all.reduce((most, x) => Math.max(most, x), 0);

function chainGroup() {
  const most = largest(lines.map(line => line.size));
  const halves = lines.flatMap(({ contact, size: force, segments }) => segments.map(([from, to]) => ({
    from: vector(from), to: vector(to), contact, radius: width * force / most, colour: statusColour(frame.contacts[contact]),
  })));
  // A body's centre on the contact leaves no direction.
  return new THREE.Group().add(along(rod, halves.filter(h => h.from.distanceTo(h.to) > 0)));
}

/** Arrows from points, the longest `length` long; those below a twentieth of it would be blots. */
function arrowGroup(all, length) {
  const most = largest(all.map(arrow => arrow.vector.length()));
  const seen = all.filter(arrow => arrow.vector.length() > 0.05 * most);
  const shaft = 0.25 * width;
  const [rods, heads] = [[], []];
  for (const { from, vector: v, contact, colour } of seen) {
    const to = from.clone().addScaledVector(v, length / most);
    const head = Math.min(0.35 * from.distanceTo(to), 8 * shaft);
    const neck = to.clone().addScaledVector(v.clone().normalize(), -head);
    rods.push({ from, to: neck, radius: Math.min(shaft, 0.2 * head), contact, colour });
    heads.push({ from: neck, to, radius: Math.min(2.5 * shaft, 0.45 * head), contact, colour });
  }
  return new THREE.Group().add(along(rod, rods), along(cone, heads));
}

const solved = frame.contacts.some(contact => contact.r);
const empty = () => new THREE.Group();
const chainLines = solved ? chainGroup() : empty();
const impulseArrows = solved
  ? arrowGroup(frame.contacts.map((c, contact) => ({ from: vector(c.point), vector: impulse(c), contact, colour: statusColour(c) })), 1.3 * size)
  : empty();
const moving = frame.poses.filter((_, k) => !picture.bodies[k].fixed);
const velocityArrows = arrowGroup(moving.map(pose => ({ from: vector(pose.position), vector: vector(pose.velocity), colour: colours.velocity })), 1.5 * size);

const fastest = largest(moving.map(pose => Math.hypot(...pose.velocity)));

const dots = new THREE.InstancedMesh(new THREE.SphereGeometry(1, 12, 8), new THREE.MeshLambertMaterial({ color: '#fff' }), frame.contacts.length);
frame.contacts.forEach((contact, k) => {
  const radius = 0.4 * width;
  dots.setMatrixAt(k, new THREE.Matrix4().makeScale(radius, radius, radius).setPosition(...contact.point));
  dots.setColorAt(k, new THREE.Color(statusColour(contact)));
});
dots.userData.contacts = frame.contacts.map((_, k) => k);
scene.add(chainLines, impulseArrows, velocityArrows, dots);

// ---------------------------------------------------------------------------------------------------- the view

let renderer;
try {
  renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
} catch {
  const said = document.body.appendChild(document.createElement('p'));
  said.className = 'problem';
  said.textContent = 'This browser has no WebGL, with which the page draws.';
}
const camera = new THREE.PerspectiveCamera(30, 1, 0.01 * ball.radius, 100 * ball.radius);
camera.up.set(0, 0, 1);
const controls = new OrbitControls(camera, canvas);

function draw() {
  if (!renderer) return;
  // The light comes from above, over the left shoulder.
  const right = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 0);
  lamp.target.position.copy(controls.target);
  lamp.position.copy(controls.target).addScaledVector(right, -0.5 * ball.radius).addScaledVector(camera.up, 2 * ball.radius)
    .addScaledVector(camera.position.clone().sub(controls.target).normalize(), ball.radius);
  renderer.render(scene, camera);
}

function home() {
  const [azimuth, elevation] = [view.azimuth, view.elevation].map(THREE.MathUtils.degToRad);
  const out = new THREE.Vector3(Math.cos(elevation) * Math.cos(azimuth), Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation));
  // Far enough for the sphere around all bodies, in the narrower direction.
  const half = THREE.MathUtils.degToRad(camera.fov / 2);
  const narrow = Math.min(half, Math.atan(Math.tan(half) * camera.aspect));
  controls.target.copy(ball.center);
  camera.position.copy(ball.center).addScaledVector(out, 1.05 * ball.radius / Math.sin(narrow));
  controls.update();
  draw();
}

function resize() {
  const [width, height] = [innerWidth, innerHeight];
  renderer?.setPixelRatio(devicePixelRatio);
  renderer?.setSize(width, height, false);
  camera.aspect = width / height;
  camera.updateProjectionMatrix();
  draw();
}

// ---------------------------------------------------------------------------------------------------- the panel

function apply() {
  const opacity = Number(element('opacity').value);
  bodies.visible = element('bodies').checked && opacity > 0;
  for (const material of [...solidMaterials.values(), edgeMaterial]) {
    material.opacity = material === edgeMaterial ? Math.min(1, 0.15 + opacity) : opacity;
    material.transparent = opacity < 1;
    // What lies behind a transparent body is seen.
    material.depthWrite = opacity === 1;
    material.needsUpdate = true;
  }
  const kind = element('forces').value;
  chainLines.visible = kind === 'chains';
  impulseArrows.visible = kind === 'arrows';
  velocityArrows.visible = element('velocities').checked;
  dots.visible = element('contacts').checked;
  draw();
}

const short = x => x === 0 ? '0' : Number(x.toPrecision(3)).toString();

function key() {
  const entry = (colour, text) => {
    const row = element('key').appendChild(document.createElement('div'));
    const mark = row.appendChild(document.createElement('span'));
    mark.className = 'mark';
    mark.style.background = colour;
    row.append(text);
  };
  for (const status of ['stick', 'slip', 'open']) {
    const count = frame.contacts.filter(contact => contact.status === status).length;
    if (count > 0) entry(colours[status], `${count} ${status}`);
  }
  const bare = frame.contacts.filter(contact => !contact.status).length;
  if (bare > 0) entry(colours.contact, `${bare} contacts`);
  if (fastest > 0) entry(colours.velocity, `velocities up to ${short(fastest)} m/s`);
  if (solved) element('key').append(`impulses up to ${short(largest(lines.map(line => line.size)))} N s`);
  element('velocities').disabled = fastest === 0;
  element('forces').disabled = !solved;
}

// ---------------------------------------------------------------------------------------------------- the pointer

const ray = new THREE.Raycaster();

/** The contact or body at a place of the window, as a text. */
function told(x, y) {
  const place = new THREE.Vector2(2 * x / innerWidth - 1, 1 - 2 * y / innerHeight);
  ray.setFromCamera(place, camera);
  const solid = bodies.visible && Number(element('opacity').value) === 1;
  const targets = [chainLines, impulseArrows, dots].filter(target => target.visible);
  // Through a transparent body one points at what is inside.
  if (solid) targets.push(bodies);
  const hit = ray.intersectObjects(targets).find(found => !found.object.isLine);
  if (!hit) return '';
  const contact = hit.object.userData.contacts?.[hit.instanceId];
  if (contact === undefined) return hit.object.userData.body === null ? 'obstacle' : `body ${hit.object.userData.body}`;
  return describe(contact);
}

function describe(number) {
  const { a, b, status, r, u, mu } = frame.contacts[number];
  const three = x => `(${x.map(short).join(', ')})`;
  const rows = [`contact ${number}${status ? `: ${status}` : ''}`, `${a === null ? 'ground' : `body ${a}`} – body ${b}, mu ${short(mu)}`];
  if (r) rows.push(`r ${three(r)} N s`);
  if (u) rows.push(`u ${three(u)} m/s`);
  return rows.join('\n');
}

canvas.addEventListener('pointermove', event => {
  const text = event.buttons === 0 ? told(event.clientX, event.clientY) : '';
  const tip = element('tip');
  tip.hidden = text === '';
  tip.textContent = text;
  // On the side of the pointer where there is room.
  const left = event.clientX > 0.6 * innerWidth;
  tip.style.left = left ? '' : `${event.clientX + 14}px`;
  tip.style.right = left ? `${innerWidth - event.clientX + 14}px` : '';
  tip.style.top = `${Math.min(event.clientY + 12, innerHeight - 90)}px`;
});
canvas.addEventListener('pointerleave', () => { element('tip').hidden = true; });

element('opacity').value = forces ? 0.2 : 1;
element('forces').value = !solved ? 'none' : forces ? 'chains' : 'arrows';
element('velocities').checked = !forces && fastest > 0;
element('contacts').checked = !forces;
for (const id of ['bodies', 'opacity', 'forces', 'velocities', 'contacts']) element(id).addEventListener('input', apply);
element('reset').addEventListener('click', home);
element('panel').addEventListener('submit', event => event.preventDefault());
controls.addEventListener('change', draw);
addEventListener('resize', resize);

key();
resize();
home();
apply();

/** Where a contact is in the window, and what can be asked of the page from outside. */
window.view = {
  drawn: () => renderer ? renderer.info.render.triangles : 0,
  place: number => {
    const { x, y } = vector(frame.contacts[number].point).project(camera);
    return [(x + 1) / 2 * innerWidth, (1 - y) / 2 * innerHeight];
  },
};
