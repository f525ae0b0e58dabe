// Player of a scene in WebGL 2.  All data is in the block "scene-data" of the page; nothing is loaded from elsewhere.
// Between saved times, positions are interpolated linearly and rotations by normalised quaternions; `#t=0.5` in the
// address sets the time.
"use strict";
(function () {
const scene = JSON.parse(document.getElementById("scene-data").textContent);
const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
const floats = (text) => new Float32Array(bytes(text));
const byId = (name) => document.getElementById(name);

// ---- vectors (arrays of three) and matrices (sixteen numbers, column by column)
const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const size = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => { const n = size(a) || 1; return [a[0] / n, a[1] / n, a[2] / n]; };
function times(a, b) {
  const c = new Float32Array(16);
  for (let j = 0; j < 4; j++) for (let i = 0; i < 4; i++) {
    c[4 * j + i] = a[i] * b[4 * j] + a[4 + i] * b[4 * j + 1] + a[8 + i] * b[4 * j + 2] + a[12 + i] * b[4 * j + 3];
  }
  return c;
}
const moved = (m, p) => [0, 1, 2].map((i) => m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2] + m[12 + i]);
function posed(p, q) { // from a position and a quaternion x y z w
  const [x, y, z, w] = q;
  return new Float32Array([
    1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 0,
    2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x), 0,
    2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y), 0, p[0], p[1], p[2], 1]);
}
function spanning(a, b, radius) { // takes the unit solid along z to the line from a to b
  const d = add(b, a, -1), z = unit(d);
  const x = unit(cross(Math.abs(z[0]) < 0.8 ? [1, 0, 0] : [0, 1, 0], z)), y = cross(z, x);
  return new Float32Array([...x.map((c) => c * radius), 0, ...y.map((c) => c * radius), 0, ...d, 0, ...a, 1]);
}

// ---- the machine: one shader for solids, shadows and picking, one for the ground
const canvas = byId("view");
const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, stencil: true, premultipliedAlpha: false });
if (!gl) { byId("title").textContent = "This picture needs a browser with WebGL 2."; return; }
const SOLID = [`#version 300 es
layout(location=0) in vec3 place; layout(location=1) in vec3 normal; layout(location=2) in float value;
uniform mat4 model, camera, flat_; out vec3 n, p; out float v;
void main() {
  vec4 world = model * vec4(place, 1.0); mat3 m = mat3(model);
  n = mat3(cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])) * normal;
  p = world.xyz; v = value; gl_Position = camera * (flat_ * world);
}`, `#version 300 es
precision highp float;
in vec3 n, p; in float v; out vec4 ink;
uniform vec4 color; uniform vec3 eye, up, light; uniform int mode;
const vec3 A = vec3(.14, .38, .60), B = vec3(.36, .68, .66), C = vec3(.95, .74, .25), D = vec3(.78, .16, .13);
vec3 heat(float x) { return x < .5 ? mix(A, B, x / .5) : x < .8 ? mix(B, C, (x - .5) / .3) : mix(C, D, (x - .8) / .2); }
void main() {
  if (mode == 1) { ink = color; return; }
  vec3 base = mode == 2 ? heat(clamp(v, 0., 1.)) : color.rgb;
  vec3 s = normalize(eye - p), m = normalize(n);
  if (dot(m, s) < 0.) m = -m;
  float sky = .62 + .26 * dot(m, up), key = max(dot(m, light), 0.), all = mode == 2 ? .8 : 1.;
  float shine = pow(max(dot(m, normalize(light + s)), 0.), 48.), rim = pow(1. - max(dot(m, s), 0.), 3.);
  ink = vec4(base * all * (sky + .50 * key) + .22 * shine + .07 * rim, color.a);
}`];
const GROUND = [`#version 300 es
layout(location=0) in vec3 place; uniform mat4 model, camera; out vec2 q;
void main() { q = place.xy; gl_Position = camera * (model * vec4(place, 1.0)); }`, `#version 300 es
precision highp float;
in vec2 q; out vec4 ink; uniform float cells;
float lines(vec2 x, float w) { vec2 f = fwidth(x); vec2 d = abs(fract(x - .5) - .5) / f; return 1. - min(min(d.x, d.y) / w, 1.); }
void main() {
  float fade = smoothstep(.95, .2, length(q));
  float a = max(.17 * lines(q * cells, 1.1), .30 * lines(q * cells / 5., 1.2));
  ink = vec4(.42, .48, .55, a * fade);
}`];
function program([vertex, fragment]) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text); gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  const names = ["model", "camera", "flat_", "color", "eye", "up", "light", "mode", "cells"];
  return { made, at: Object.fromEntries(names.map((name) => [name, gl.getUniformLocation(made, name)])) };
}
const solid = program(SOLID), ground = program(GROUND);
function buffers(vertices, normals, index, usage = gl.STATIC_DRAW) {
  const own = gl.createVertexArray(), parts = [vertices, normals, new Float32Array(vertices.length / 3)];
  gl.bindVertexArray(own);
  const slots = parts.map((data, k) => {
    const slot = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, slot); gl.bufferData(gl.ARRAY_BUFFER, data, usage);
    gl.enableVertexAttribArray(k); gl.vertexAttribPointer(k, k == 2 ? 1 : 3, gl.FLOAT, false, 0, 0);
    return slot;
  });
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, index, gl.STATIC_DRAW);
  gl.bindVertexArray(null);
  return { own, slots, count: index.length };
}
const shapes = scene.solids.map((s) => buffers(floats(s.vertices), floats(s.normals), new Uint32Array(bytes(s.faces))));
const plane = buffers(new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]), new Float32Array(12), new Uint32Array([0, 1, 2, 0, 2, 3]));

// ---- objects at a time
const ts = floats(scene.ts), last = ts.length - 1;
const objects = scene.objects.map((s) => ({ ...s, tracks: floats(s.tracks), arrows: s.arrows && { ...s.arrows,
  place: floats(s.arrows.place), force: floats(s.arrows.force) }, meshes: s.meshes.map((mesh) => {
  const rest = floats(mesh.rest), faces = new Uint32Array(bytes(mesh.faces)), edges = new Uint32Array(bytes(mesh.edges));
  return { ...mesh, rest, faces, now: new Float32Array(rest), normals: new Float32Array(rest.length),
    values: new Float32Array(rest.length / 3), basis: floats(mesh.basis), amplitudes: floats(mesh.amplitudes),
    shares: mesh.shares && floats(mesh.shares),
    skin: buffers(rest, new Float32Array(rest.length), faces, gl.DYNAMIC_DRAW),
    wires: buffers(rest, new Float32Array(rest.length), edges, gl.DYNAMIC_DRAW),
    ghost: buffers(rest, new Float32Array(rest.length), edges) };
}) }));
function instant(t) { // the number of the saved time before, and the share of the next
  let low = 0, high = last;
  while (high - low > 1) { const middle = (low + high) >> 1; if (ts[middle] <= t) low = middle; else high = middle; }
  const span = ts[high] - ts[low];
  return [low, high, span > 0 ? Math.min(1, Math.max(0, (t - ts[low]) / span)) : 0];
}
const blend = (data, width, k, [i, j, s]) => {
  const out = new Array(width);
  for (let c = 0; c < width; c++) out[c] = (1 - s) * data[i * k.all + k.from + c] + s * data[j * k.all + k.from + c];
  return out;
};
function poses(object, when) {
  const all = object.bodies.length * 7;
  return object.bodies.map((_, b) => {
    const row = blend(object.tracks, 7, { all, from: 7 * b }, when), q = row.slice(3), n = Math.hypot(...q);
    return posed(add(row.slice(0, 3), object.offset), q.map((c) => c / n));
  });
}
function deform(mesh, when) { // rest + scale * sum of shapes times amplitudes, its normals and its size
  const m = mesh.amplitudes.length / ts.length, n = mesh.rest.length;
  const a = blend(mesh.amplitudes, m, { all: m, from: 0 }, when), now = mesh.now;
  now.fill(0);
  for (let k = 0; k < m; k++) for (let c = 0, from = k * n; c < n; c++) now[c] += a[k] * mesh.basis[from + c];
  const shares = mesh.shares && blend(mesh.shares, n / 3, { all: n / 3, from: 0 }, when);
  for (let v = 0; v < n / 3; v++) {
    mesh.values[v] = shares ? shares[v] : Math.hypot(now[3 * v], now[3 * v + 1], now[3 * v + 2]) / (mesh.largest || 1);
  }
  for (let c = 0; c < n; c++) now[c] = mesh.rest[c] + mesh.scale * now[c];
  mesh.normals.fill(0);
  const at = (v) => [now[3 * v], now[3 * v + 1], now[3 * v + 2]];
  for (let f = 0; f < mesh.faces.length; f += 3) {
    const [i, j, k] = mesh.faces.subarray(f, f + 3), o = at(i), g = cross(add(at(j), o, -1), add(at(k), o, -1));
    for (const v of [i, j, k]) for (let c = 0; c < 3; c++) mesh.normals[3 * v + c] += g[c];
  }
  for (const [part, normals] of [[mesh.skin, mesh.normals], [mesh.wires, null]]) {
    [now, normals, mesh.values].forEach((data, k) => {
      if (data) { gl.bindBuffer(gl.ARRAY_BUFFER, part.slots[k]); gl.bufferSubData(gl.ARRAY_BUFFER, 0, data); }
    });
  }
  return at;
}
const HEAT = [[.14, .38, .60], [.36, .68, .66], [.95, .74, .25], [.78, .16, .13]];
function heat(x) {
  const [i, s] = x < .5 ? [0, x / .5] : x < .8 ? [1, (x - .5) / .3] : [2, Math.min(1, (x - .8) / .2)];
  return HEAT[i].map((c, k) => (1 - s) * c + s * HEAT[i + 1][k]);
}
function contents(object, when) { // everything to draw: { shape, model, color, name }
  const at = poses(object, when), found = [];
  for (const item of object.items) {
    if (item.trace && !shown.traces) continue;
    let model = item.body === undefined ? null : item.local ? times(at[item.body], item.local) : at[item.body];
    if (item.ends) {
      const [a, b] = item.ends.map((end) => moved(at[end.body], end.point)), d = add(b, a, -1);
      let [start, end] = item.part;
      if (item.rigid) { // a barrel or a rod keeps its length, from its own end
        const share = item.rigid / Math.max(Math.hypot(...d), 1e-12);
        [start, end] = start === 0 ? [0, share] : [1 - share, 1];
      }
      model = spanning(add(a, d, start), add(a, d, end), item.radius);
    }
    found.push({ shape: shapes[item.solid], model, color: item.color, name: item.name, shadow: !item.trace });
  }
  for (const mesh of object.meshes) {
    const place = deform(mesh, when), model = at[mesh.body], thick = scene.radius;
    const named = { name: mesh.name, mode: 2 };
    found.push({ shape: mesh.skin, model, color: [1, 1, 1, 1], ...named, shadow: true });
    found.push({ shape: mesh.wires, model, color: [.10, .13, .17, .55], lines: true });
    if (shown.rest) found.push({ shape: mesh.ghost, model, color: [.35, .40, .46, .45], lines: true });
    for (const [i, j] of mesh.bars) {
      const color = [...heat((mesh.values[i] + mesh.values[j]) / 2), 1];
      const [a, b] = [i, j].map((v) => moved(model, place(v)));
      found.push({ shape: shapes[scene.cylinder], model: spanning(a, b, .55 * thick), color, name: mesh.name, shadow: true });
    }
    for (const i of mesh.balls) {
      const p = moved(model, place(i)), r = mesh.bars.length ? .56 * thick : .9 * thick;
      const local = new Float32Array([r, 0, 0, 0, 0, r, 0, 0, 0, 0, r, 0, ...p, 1]);
      found.push({ shape: shapes[scene.ball], model: local, color: [...heat(mesh.values[i]), 1], name: mesh.name, shadow: true });
    }
  }
  if (object.arrows && shown.loads) found.push(...arrows(object, when));
  return found;
}
function arrows(object, when) {
  const { names, place, force, limits, largest } = object.arrows, all = 3 * names.length, found = [];
  names.forEach((name, k) => {
    const p = add(blend(place, 3, { all, from: 3 * k }, when), object.offset);
    const f = blend(force, 3, { all, from: 3 * k }, when), newton = size(f), limit = limits[k];
    const share = limit ? newton / limit : newton / (largest || 1);
    const length = scene.reach * (newton / (largest || 1));
    if (!(length > 0.004 * scene.reach)) return;
    const plain = !limit && limits.some((x) => x); // among limits a joint without one is neither near nor far
    const color = [...(plain ? [.55, .58, .6] : heat(Math.min(share, 1))), 1], n = unit(f), head = Math.min(3.4 * scene.radius, .6 * length);
    const tip = add(p, n, length), neck = add(tip, n, -head), told = name + ": " + spoken(newton)
      + (limit ? ", " + (100 * share).toFixed(0) + " % of its limit" : "");
    found.push({ shape: shapes[scene.cylinder], model: spanning(p, neck, .5 * scene.radius), color, name: told, through: true });
    found.push({ shape: shapes[scene.cone], model: spanning(neck, tip, 1.7 * scene.radius), color, name: told, through: true });
  });
  return found;
}
const spoken = (n) => n >= 1e6 ? (n / 1e6).toPrecision(3) + " MN" : n >= 1e3 ? (n / 1e3).toPrecision(3) + " kN" : n.toPrecision(3) + " N";

// ---- the camera goes round its target: drag turns, shift or right button shifts, wheel nears
const shown = { loads: true, traces: true, names: false, rest: true, shadow: true };
const right = cross(scene.up, scene.front), start = { ...scene.camera };
let eye = { ...start }, target = [...scene.centre], asked = true;
function look() {
  const c = Math.cos(eye.elevation), s = Math.sin(eye.elevation), sides = canvas.width / canvas.height;
  const flat = add(scene.front.map((x) => x * Math.cos(eye.azimuth)), right, Math.sin(eye.azimuth));
  const back = add(flat.map((x) => x * c), scene.up, s), from = add(target, back, eye.distance);
  const x = unit(cross(scene.up, back)), y = cross(back, x), f = 1 / Math.tan(.5 * scene.angle);
  const near = .02 * eye.distance, far = 40 * eye.distance, wide = Math.min(sides / 1.45, 1);
  const view = new Float32Array([x[0], y[0], back[0], 0, x[1], y[1], back[1], 0, x[2], y[2], back[2], 0,
    -dot(x, from), -dot(y, from), -dot(back, from), 1]);
  const lens = new Float32Array([f * wide / sides, 0, 0, 0, 0, f * wide, 0, 0, 0, 0, (far + near) / (near - far), -1,
    0, 0, 2 * far * near / (near - far), 0]);
  return { camera: times(lens, view), from, x, y, light: unit(add(add(scene.up.map((u) => 1.1 * u), x, -.55), back, .75)) };
}
function flattened(light) { // the shadow of a point on the ground
  const u = scene.up, s = dot(u, light), h = scene.ground, m = new Float32Array(16);
  for (let i = 0; i < 3; i++) {
    for (let j = 0; j < 3; j++) m[4 * j + i] = (i == j ? 1 : 0) - light[i] * u[j] / s;
    m[12 + i] = light[i] * h / s;
  }
  m[15] = 1;
  return m;
}
const STILL = new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
function draw(things, sight, picking) {
  gl.viewport(0, 0, canvas.width, canvas.height);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST);
  gl.disable(gl.BLEND);
  if (!picking) floor(things, sight);
  gl.useProgram(solid.made);
  gl.uniformMatrix4fv(solid.at.camera, false, sight.camera);
  gl.uniformMatrix4fv(solid.at.flat_, false, STILL);
  gl.uniform3fv(solid.at.eye, sight.from); gl.uniform3fv(solid.at.up, scene.up); gl.uniform3fv(solid.at.light, sight.light);
  things.forEach((thing, k) => {
    if (picking && thing.lines) return;
    const see = !picking && thing.color[3] < 1;
    see ? gl.enable(gl.BLEND) : gl.disable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const id = [((k + 1) & 255) / 255, ((k + 1) >> 8) / 255, 0, 1];
    gl.uniform4fv(solid.at.color, picking ? id : thing.color);
    gl.uniform1i(solid.at.mode, picking || thing.lines ? 1 : thing.mode || 0);
    gl.uniformMatrix4fv(solid.at.model, false, thing.model);
    if (thing.mode == 2) { gl.enable(gl.POLYGON_OFFSET_FILL); gl.polygonOffset(1, 1); }
    gl.bindVertexArray(thing.shape.own);
    gl.drawElements(thing.lines ? gl.LINES : gl.TRIANGLES, thing.shape.count, gl.UNSIGNED_INT, 0);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    if (thing.through && !picking) { // loads inside of a body shine through it
      gl.enable(gl.BLEND); gl.depthFunc(gl.GREATER); gl.depthMask(false);
      gl.uniform4fv(solid.at.color, [...thing.color.slice(0, 3), .72]);
      gl.drawElements(gl.TRIANGLES, thing.shape.count, gl.UNSIGNED_INT, 0);
      gl.depthFunc(gl.LESS); gl.depthMask(true);
    }
  });
}
function floor(things, sight) {
  const s = scene.floor, u = scene.up, c = add(scene.centre, u, scene.ground - dot(scene.centre, u));
  gl.enable(gl.BLEND); gl.depthMask(false);
  gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  gl.useProgram(ground.made);
  gl.uniformMatrix4fv(ground.at.camera, false, sight.camera);
  gl.uniform1f(ground.at.cells, scene.cells);
  gl.uniformMatrix4fv(ground.at.model, false, new Float32Array([...right.map((x) => x * s), 0,
    ...scene.front.map((x) => x * s), 0, ...u, 0, ...c, 1]));
  gl.bindVertexArray(plane.own);
  gl.drawElements(gl.TRIANGLES, plane.count, gl.UNSIGNED_INT, 0);
  if (shown.shadow) {
    gl.useProgram(solid.made);
    gl.uniformMatrix4fv(solid.at.camera, false, sight.camera);
    gl.uniformMatrix4fv(solid.at.flat_, false, flattened(unit(add(scene.up, sight.light, .35))));
    gl.uniform4fv(solid.at.color, [.12, .16, .22, .17]); gl.uniform1i(solid.at.mode, 1);
    gl.enable(gl.STENCIL_TEST); gl.stencilFunc(gl.EQUAL, 0, 255); gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    for (const thing of things) if (thing.shadow) {
      gl.uniformMatrix4fv(solid.at.model, false, thing.model);
      gl.bindVertexArray(thing.shape.own);
      gl.drawElements(gl.TRIANGLES, thing.shape.count, gl.UNSIGNED_INT, 0);
    }
    gl.disable(gl.STENCIL_TEST);
  }
  gl.depthMask(true);
}

// ---- time, buttons, names
let now = ts[0], playing = last > 0, before = null, things = [], hit = null;
const slider = byId("time"), clock = byId("clock"), play = byId("play"), speed = byId("speed"), tip = byId("tip");
function seek(t) { now = Math.min(ts[last], Math.max(ts[0], t)); asked = true; }
function toggle(on) { playing = on && last > 0; play.textContent = playing ? "❚❚" : "▶"; play.title = playing ? "pause" : "play"; }
function frame(stamp) {
  if (playing) {
    const passed = before === null ? 0 : Math.min(.1, (stamp - before) / 1000), span = ts[last] - ts[0];
    now += passed * scene.speed * Number(speed.value);
    if (now > ts[last]) now = ts[0] + ((now - ts[0]) % span);
    asked = true;
  }
  before = stamp;
  const ratio = window.devicePixelRatio || 1, w = Math.round(canvas.clientWidth * ratio), h = Math.round(canvas.clientHeight * ratio);
  if (canvas.width != w || canvas.height != h) { canvas.width = w; canvas.height = h; asked = true; }
  if (asked && w && h) {
    const when = instant(now), sight = look();
    things = objects.flatMap((object) => contents(object, when));
    draw(things, sight, false);
    label(when, sight);
    slider.value = last > 0 ? (now - ts[0]) / (ts[last] - ts[0]) : 0;
    clock.textContent = scene.clock ? scene.clock : (now >= 0 ? "\u2007" : "") + now.toFixed(scene.digits) + " s";
    asked = false;
    document.body.dataset.ready = String(now);
  }
  requestAnimationFrame(frame);
}
const tags = [];
function label(when, sight) {
  const wanted = [];
  for (const object of objects) {
    const at = poses(object, when);
    if (objects.length > 1) wanted.push({ name: object.name, p: add(scene.caption, object.offset), big: true });
    if (shown.names) for (const tag of object.tags) wanted.push({ name: tag.name, p: moved(at[tag.body], tag.point) });
  }
  while (tags.length < wanted.length) tags.push(byId("tags").appendChild(document.createElement("span")));
  tags.forEach((tag, k) => {
    const w = wanted[k], m = sight.camera;
    tag.hidden = !w;
    if (!w) return;
    const q = [0, 1, 3].map((i) => m[i] * w.p[0] + m[4 + i] * w.p[1] + m[8 + i] * w.p[2] + m[12 + i]);
    tag.textContent = w.name; tag.className = w.big ? "big" : "";
    tag.style.left = 50 * (1 + q[0] / q[2]) + "%"; tag.style.top = 50 * (1 - q[1] / q[2]) + "%";
  });
}
play.onclick = () => toggle(!playing);
slider.oninput = () => { toggle(false); seek(ts[0] + slider.value * (ts[last] - ts[0])); };
for (const name of ["loads", "traces", "names", "rest"]) {
  const box = byId(name);
  box.parentElement.hidden = name != "names" && !scene.has[name];
  box.checked = shown[name];
  box.onchange = () => { shown[name] = box.checked; asked = true; };
}
byId("home").onclick = () => { eye = { ...start }; target = [...scene.centre]; asked = true; };
let held = null;
canvas.onpointerdown = (e) => { held = [e.clientX, e.clientY, e.button || e.shiftKey]; canvas.setPointerCapture(e.pointerId); tip.hidden = true; };
canvas.onpointerup = () => { held = null; };
canvas.oncontextmenu = (e) => e.preventDefault();
canvas.onpointermove = (e) => {
  if (!held) { hit = e; return; }
  const dx = e.clientX - held[0], dy = e.clientY - held[1];
  held = [e.clientX, e.clientY, held[2]];
  if (held[2]) {
    const s = 2 * eye.distance * Math.tan(.5 * scene.angle) / canvas.clientHeight, { x, y } = look();
    target = add(add(target, x, -dx * s), y, dy * s);
  } else {
    eye.azimuth -= .008 * dx; eye.elevation = Math.min(1.55, Math.max(-1.2, eye.elevation + .008 * dy));
  }
  asked = true;
};
canvas.onpointerleave = () => { tip.hidden = true; hit = null; };
canvas.onwheel = (e) => { e.preventDefault(); eye.distance *= Math.exp(.0012 * e.deltaY); asked = true; };
document.onkeydown = (e) => {
  if (e.key == " ") { e.preventDefault(); toggle(!playing); }
  const step = { ArrowLeft: -1, ArrowRight: 1 }[e.key];
  if (step && e.target != slider) { toggle(false); seek(ts[Math.min(last, Math.max(0, instant(now)[0] + step))]); }
};
setInterval(() => { // the name under the pointer: all is drawn once more, each thing in a colour of its own
  if (!hit || held) return;
  const box = canvas.getBoundingClientRect(), ratio = canvas.width / box.width, pixel = new Uint8Array(4);
  draw(things, look(), true);
  gl.readPixels((hit.clientX - box.left) * ratio, (box.bottom - hit.clientY) * ratio, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  const found = pixel[3] == 255 ? things[pixel[0] + 256 * pixel[1] - 1] : null;
  draw(things, look(), false);
  tip.hidden = !(found && found.name);
  if (found) tip.textContent = found.name;
  tip.style.left = hit.clientX - box.left + 14 + "px"; tip.style.top = hit.clientY - box.top + 10 + "px";
  if (!playing) hit = null;
}, 120);
byId("title").textContent = scene.title;
for (const part of [slider, clock, play, speed]) part.hidden = last == 0;
byId("scale").hidden = !scene.scale;
if (scene.scale) byId("most").textContent = scene.scale;
function address() {
  const given = new URLSearchParams(location.hash.slice(1));
  if (given.has("t")) { toggle(false); seek(Number(given.get("t"))); }
  for (const name of ["azimuth", "elevation"]) if (given.has(name)) eye[name] = Number(given.get(name));
  if (given.has("names")) { shown.names = byId("names").checked = true; }
  asked = true;
}
window.onhashchange = address;
toggle(true);
address();
requestAnimationFrame(frame);
})();
