// Draws a picture, as picture.rs describes it, with three.js; names follow it. Nothing moves by itself: a frame is drawn when something has changed.

import * as THREE from 'three';
import { arrows, cone, element, grid, instances, keyEntry, largest, place, polyhedra, rod, short, sphere, stage, tips, vector } from 'common';

const { picture, chains, size, width, forces, view, colours } = JSON.parse(document.getElementById('data').textContent);
const frame = picture.frames[picture.frames.length - 1];
const lines = chains[chains.length - 1];
const statusColour = contact => colours[contact.status ?? 'contact'];

/** The impulse on b in the frame of the world. */
const impulse = contact => {
  const r = new THREE.Vector3();
  contact.frame.forEach((axis, k) => r.addScaledVector(vector(axis), contact.r[k]));
  return r;
};

// ---------------------------------------------------------------------------------------------------- the scene

const solidMaterials = new Map();
/** One material a colour, so that opacity is set once for all bodies of it. */
function solidMaterial(colour) {
  if (!solidMaterials.has(colour)) {
    solidMaterials.set(colour, new THREE.MeshLambertMaterial({ color: colour, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }));
  }
  return solidMaterials.get(colour);
}
const edgeMaterial = new THREE.LineBasicMaterial({ color: colours.edge, transparent: true });
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
    const [faces, edges] = polyhedra(convex.map(part => part.convex));
    place(new THREE.Mesh(faces, material));
    place(new THREE.LineSegments(edges, edgeMaterial));
  }
});
const box = new THREE.Box3().setFromObject(bodies);
const ball = box.getBoundingSphere(new THREE.Sphere());

const canvas = element('scene');
const eye = stage(canvas, ball, view, '#fff');
const { scene, draw } = eye;
scene.add(bodies);

if (picture.ground) {
  const { point, normal, along } = picture.ground;
  const n = vector(normal).normalize();
  const t = vector(along).addScaledVector(n, -vector(along).dot(n)).normalize();
  const height = ball.center.clone().sub(vector(point)).dot(n);
  const foot = ball.center.clone().addScaledVector(n, -height - 1e-3 * ball.radius);
  scene.add(grid(3 * ball.radius, foot, t, n, ['#c2c8ce', '#dde1e5']));
}

// ---------------------------------------------------------------------------------------------------- contacts and arrows

const many = (shape, all) => place(instances(shape, all.length), all);

function chainGroup() {
  const most = largest(lines.map(line => line.size));
  const halves = lines.flatMap(({ contact, size: force, segments }) => segments.map(([from, to]) => ({
    from: vector(from), to: vector(to), contact, radius: width * force / most, colour: statusColour(frame.contacts[contact]),
  })));
  // A body's centre on the contact leaves no direction.
  return new THREE.Group().add(many(rod, halves.filter(h => h.from.distanceTo(h.to) > 0)));
}

const arrowGroup = (all, length) => {
  const [rods, heads] = arrows(all, largest(all.map(arrow => arrow.vector.length())), length, 0.25 * width);
  return new THREE.Group().add(many(rod, rods), many(cone, heads));
};

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

function key() {
  const entry = (colour, text) => keyEntry(element('key'), colour, text);
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

/** The contact or body at a place of the window, as a text. */
function told(x, y) {
  const solid = bodies.visible && Number(element('opacity').value) === 1;
  const targets = [chainLines, impulseArrows, dots].filter(target => target.visible);
  // Through a transparent body one points at what is inside.
  if (solid) targets.push(bodies);
  const hit = eye.hit(x, y, targets);
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

tips(canvas, told);

element('opacity').value = forces ? 0.2 : 1;
element('forces').value = !solved ? 'none' : forces ? 'chains' : 'arrows';
element('velocities').checked = !forces && fastest > 0;
element('contacts').checked = !forces;
for (const id of ['bodies', 'opacity', 'forces', 'velocities', 'contacts']) element(id).addEventListener('input', apply);
element('reset').addEventListener('click', eye.home);
element('panel').addEventListener('submit', event => event.preventDefault());

key();
eye.resize();
eye.home();
apply();

/** Where a contact is in the window, and what can be asked of the page from outside. */
window.view = {
  drawn: eye.drawn,
  place: number => eye.seen(vector(frame.contacts[number].point)),
};
