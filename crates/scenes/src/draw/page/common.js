// What both pages are drawn with: meshes, arrows, the view.

import * as THREE from 'three';
import { OrbitControls } from 'controls';

export const element = id => document.getElementById(id);
export const vector = x => new THREE.Vector3(...x);
export const short = x => x === 0 ? '0' : Number(x.toPrecision(3)).toString();
export const largest = all => all.reduce((most, x) => Math.max(most, x), 0);

export const sphere = new THREE.SphereGeometry(1, 32, 20);
// From the origin to y = 1.
export const rod = new THREE.CylinderGeometry(1, 1, 1, 12).translate(0, 0.5, 0);
export const cone = new THREE.ConeGeometry(1, 1, 16).translate(0, 0.5, 0);

/** Faces as triangles with normals of their own, and edges as pairs of points. */
export function polyhedra(solids) {
  const [triangles, edges] = [[], []];
  for (const { vertices, faces } of solids) {
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

const up = new THREE.Vector3(0, 1, 0);
const [matrix, turn, size, colour] = [new THREE.Matrix4(), new THREE.Quaternion(), new THREE.Vector3(), new THREE.Color()];

/** Room for so many copies of a shape along y. */
export function instances(shape, count, material = new THREE.MeshLambertMaterial({ color: '#fff' })) {
  const mesh = new THREE.InstancedMesh(shape, material, count);
  mesh.setColorAt?.(0, colour.set('#fff'));
  return mesh;
}

/** Puts the copies each from a point to another, with a radius and a colour; `contact` is what each tells of. */
export function place(mesh, all) {
  mesh.count = all.length;
  all.forEach(({ from, to, radius, colour: name }, k) => {
    const way = to.clone().sub(from);
    turn.setFromUnitVectors(up, way.clone().normalize());
    matrix.compose(from, turn, size.set(radius, way.length(), radius));
    mesh.setMatrixAt(k, matrix);
    mesh.setColorAt(k, colour.set(name));
  });
  mesh.instanceMatrix.needsUpdate = true;
  if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
  mesh.userData.contacts = all.map(one => one.contact);
  // The bounds of the instances, for picking and for what lies outside the view.
  mesh.computeBoundingSphere();
  return mesh;
}

/** Rods and heads of arrows from points along vectors, `length` long for a vector of size `most`; those below a twentieth of it would be blots. */
export function arrows(all, most, length, shaft) {
  const seen = all.filter(arrow => arrow.vector.length() > 0.05 * most);
  const [rods, heads] = [[], []];
  for (const { from, vector: v, contact, colour } of seen) {
    const to = from.clone().addScaledVector(v, length / most);
    const head = Math.min(0.35 * from.distanceTo(to), 8 * shaft);
    const neck = to.clone().addScaledVector(v.clone().normalize(), -head);
    rods.push({ from, to: neck, radius: Math.min(shaft, 0.2 * head), contact, colour });
    heads.push({ from: neck, to, radius: Math.min(2.5 * shaft, 0.45 * head), contact, colour });
  }
  return [rods, heads];
}

/** The end of a force chain in a body: the centre of a grain; in any other body beside it, along the impulse, as lines of thrust are drawn. */
export function chainEnd(from, centre, impulse, grain) {
  const to = centre.clone().sub(from);
  const square = impulse.lengthSq();
  return from.clone().add(grain || square === 0 ? to : impulse.clone().multiplyScalar(to.dot(impulse) / square));
}

/** A grid across `normal` through `centre`. */
export function grid(side, centre, along, normal, colours) {
  const lines = new THREE.GridHelper(side, 20, ...colours);
  // A grid lies across its y axis.
  lines.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(along, normal, along.clone().cross(normal)));
  lines.position.copy(centre);
  return lines;
}

/** The eye: a camera that a hand turns about a scene with its lights. `ball` is what is to be seen, `view` whence. */
export function stage(canvas, ball, view, background) {
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(background);
  scene.add(new THREE.HemisphereLight('#fff', '#c8c8c8', 2.2));
  const lamp = new THREE.DirectionalLight('#fff', 1.4);
  scene.add(lamp, lamp.target);
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

  /** Fills what its page leaves it of the window. */
  function resize() {
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    renderer?.setPixelRatio(devicePixelRatio);
    renderer?.setSize(width, height, false);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    draw();
  }

  controls.addEventListener('change', draw);
  addEventListener('resize', resize);
  const ray = new THREE.Raycaster();
  return {
    scene, camera, controls, draw, home, resize,
    /** The nearest of some objects, lines left out, at a place of the window. */
    hit(x, y, targets) {
      const { left, top, width, height } = canvas.getBoundingClientRect();
      ray.setFromCamera(new THREE.Vector2(2 * (x - left) / width - 1, 1 - 2 * (y - top) / height), camera);
      return ray.intersectObjects(targets).find(found => !found.object.isLine);
    },
    /** Where a point is in the window. */
    seen(point) {
      const { left, top, width, height } = canvas.getBoundingClientRect();
      const { x, y } = point.clone().project(camera);
      return [left + (x + 1) / 2 * width, top + (1 - y) / 2 * height];
    },
    drawn: () => renderer ? renderer.info.render.triangles : 0,
  };
}

/** Shows what `told` says of a place of the canvas, beside the pointer. */
export function tips(canvas, told) {
  const tip = element('tip');
  canvas.addEventListener('pointermove', event => {
    const text = event.buttons === 0 ? told(event.clientX, event.clientY) : '';
    tip.hidden = text === '';
    tip.textContent = text;
    // On the side of the pointer where there is room.
    const left = event.clientX > 0.6 * innerWidth;
    tip.style.left = left ? '' : `${event.clientX + 14}px`;
    tip.style.right = left ? `${innerWidth - event.clientX + 14}px` : '';
    tip.style.top = `${Math.min(event.clientY + 12, innerHeight - 90)}px`;
  });
  canvas.addEventListener('pointerleave', () => { tip.hidden = true; });
}

/** A line of the key: a mark of a colour and a text. */
export function keyEntry(key, colour, text) {
  const row = key.appendChild(document.createElement('div'));
  const mark = row.appendChild(document.createElement('span'));
  mark.className = 'mark';
  mark.style.background = colour;
  row.append(text);
}
