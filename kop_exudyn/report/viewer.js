"use strict";
// The page around the drawing: what is shown, how it is coloured, and which part is highlighted.

(function () {
  const scene = JSON.parse(document.getElementById("scene").textContent, (key, value) =>
    value && typeof value === "object" && "f32" in value ? decode(value.f32, Float32Array)
      : value && typeof value === "object" && "i32" in value ? decode(value.i32, Int32Array) : value);
  const $ = id => document.getElementById(id);
  const canvas = $("canvas"), root = document.documentElement;
  const NONE = [0.66, 0.66, 0.66], JOINT = [0.23, 0.24, 0.26], OVER = [0.86, 0.05, 0.09];
  const LEAST = 0.0012;  // breadth of what is drawn, times a design's size: about a pixel
  const chosen = {design: -1, stage: null, role: null, colour: "part", target: true, labels: false, part: -1, opening: 1};
  let renderer, tiles = [], queued = false;
  const camera = new Camera();

  function decode(text, Type) {
    const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
    return new Type(bytes.buffer);
  }

  // -- what there is -----------------------------------------------------------------------------------------------
  const unique = list => [...new Set(list)];
  const stages = unique(scene.designs.flatMap(d => [...d.states.map(s => s.stage), ...Object.keys(d.failed)]));
  const ordered = scene.stages.filter(s => stages.includes(s));
  const roles = unique(scene.designs.flatMap(d => d.states.map(s => s.role)));
  const framesOf = (design, stage, role) => design.states.filter(s => s.stage === stage && s.role === role)
    .sort((a, b) => (a.opening ?? 0) - (b.opening ?? 0));

  // The state to draw of a design: between frames where there are several openings.
  function stateOf(design) {
    const frames = framesOf(design, chosen.stage, chosen.role);
    if (frames.length < 2) return frames[0];
    const direction = frames.findIndex(f => f.final) === 0 ? [...frames].reverse() : frames;
    const at = chosen.opening * (frames.length - 1), k = Math.min(Math.floor(at), frames.length - 2);
    return between(direction[k], direction[k + 1], at - k);
  }

  const shown = () => chosen.design < 0 ? scene.designs : [scene.designs[chosen.design]];

  // -- meshes ------------------------------------------------------------------------------------------------------
  function scaleColour(share) {
    if (!(share >= 0)) return NONE;
    const at = Math.min(share, 1) * (scene.scale.length - 1), k = Math.min(Math.floor(at), scene.scale.length - 2);
    return scene.scale[k].map((x, i) => x + (at - k) * (scene.scale[k + 1][i] - x));
  }

  function colouring(rods, state) {
    if (chosen.colour === "plain") return () => NONE;
    if (chosen.colour === "part") return piece => rods.part[piece] < 0 ? NONE : scene.parts[rods.part[piece]].colour;
    const values = state[chosen.colour], limit = scene.limits[chosen.colour];
    const over = chosen.colour === "utilisation" ? 1 : Infinity;
    return values ? (piece, ring) => values[ring] > over ? OVER : scaleColour(values[ring] / limit) : () => NONE;
  }

  // Rings where pieces are stressed most, if that is beyond the elastic limit.
  function overStressed(rods, state) {
    const found = [];
    let ring = 0;
    for (const n of rods.rings) {
      let worst = -1;
      for (let i = ring; i < ring + n; i++) if (state.utilisation?.[i] > 1 && !(state.utilisation[i] <= state.utilisation[worst])) worst = i;
      if (worst >= 0) found.push(worst);
      ring += n;
    }
    return found;
  }

  function rebuild() {
    for (const design of shown()) {
      const state = stateOf(design);
      design.drawn = state;
      if (!state) continue;
      design.box ??= {};
      const box = design.box[state.role] ??= boxOf(design, state.role);
      const rods = design.rods[state.role], build = new MeshBuilder(), least = LEAST * box.size, thick = Math.max(rods.thickness, least);
      sweepRods(build, rods, state, colouring(rods, state), least);
      design.over = overStressed(rods, state);
      for (const i of design.over) build.ball(state.places.subarray(3 * i, 3 * i + 3), 0.75 * thick, OVER, 0);
      for (let k = 0; k < state.joints.length; k += 3) build.ball(state.joints.subarray(k, k + 3), 0.42 * thick, JOINT, 0);
      for (let k = 0; k < state.corners.length; k += 3) {
        const part = rods.corner_part[k / 3];
        if (part < 0 || chosen.colour !== "part" && part !== chosen.part) continue;  // they'd hide the rods' values
        build.ball(state.corners.subarray(k, k + 3), 0.58 * thick, scene.parts[part].colour, part + 1);
      }
      design.mesh = renderer.upload(build, design.mesh);
      if (design.target && !design.surface) design.surface = renderer.upload(surfaceOf(design.target));
    }
    redraw();
  }

  function surfaceOf(target) {
    const build = new MeshBuilder(), normals = new Float32Array(target.vertices.length), v = target.vertices;
    const at = i => v.subarray(3 * i, 3 * i + 3);
    for (let f = 0; f < target.faces.length; f += 3) {
      const [a, b, c] = [0, 1, 2].map(k => target.faces[f + k]), n = V3.cross(V3.sub(at(b), at(a)), V3.sub(at(c), at(a)));
      for (const i of [a, b, c]) n.forEach((x, k) => { normals[3 * i + k] += x; });
    }
    for (let i = 0; i < v.length / 3; i++) build.vertex(at(i), V3.unit(normals.subarray(3 * i, 3 * i + 3)), [0.55, 0.68, 0.80], 0);
    for (let f = 0; f < target.faces.length; f += 3) build.face(target.faces[f], target.faces[f + 1], target.faces[f + 2]);
    return build;
  }

  // What a role's final state of the last stage fills as first seen: the view stays when stages change.
  function boxOf(design, role) {
    const states = design.states.filter(s => s.role === role && s.final).slice(-1), {right, up, back} = new Camera().axes;
    const axes = [right, up, back], low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const {places: x} of states) for (let i = 0; i < x.length; i += 3) axes.forEach((a, k) => {
      const at = a[0] * x[i] + a[1] * x[i + 1] + a[2] * x[i + 2];
      low[k] = Math.min(low[k], at);
      high[k] = Math.max(high[k], at);
    });
    const middle = low.map((x, k) => (x + high[k]) / 2), [w, h, d] = low.map((x, k) => high[k] - x);
    return {centre: [0, 1, 2].map(k => axes.reduce((sum, a, j) => sum + a[k] * middle[j], 0)), size: Math.hypot(w, h, d),
            wide: w / 2, high: h / 2};
  }

  // -- drawing -----------------------------------------------------------------------------------------------------
  function layOut() {
    const n = shown().length, {clientWidth: w, clientHeight: h} = canvas;
    const boxes = shown().map(d => d.drawn && d.box[d.drawn.role]).filter(box => box);
    const mean = key => boxes.reduce((sum, box) => sum + box[key] / box.size, 0) || 1;
    let columns = 1, best = 0;
    for (let c = 1; c <= n; c++) {
      const size = Math.min(w / c / mean("wide"), h / Math.ceil(n / c) / mean("high"));
      if (size > best * 1.001) { best = size; columns = c; }
    }
    const rows = Math.ceil(n / columns);
    tiles = shown().map((design, k) => {  // the last row's tiles share all of its width
      const row = Math.floor(k / columns), across = row < rows - 1 ? columns : n - columns * (rows - 1);
      return {design, x: w * (k % columns) / across, y: h * row / rows, w: w / across, h: h / rows};
    });
    $("labels").replaceChildren(...tiles.map(label));
    [...$("labels").children].forEach((box, k) => {  // drawings begin below their captions
      const tile = tiles[k], below = Math.min(box.offsetTop + box.offsetHeight - tile.y, 0.3 * tile.h);
      tile.y += below;
      tile.h -= below;
    });
  }

  function label(tile) {
    const box = document.createElement("button"), name = document.createElement("b"), note = document.createElement("span");
    box.type = "button";
    box.style.left = `${tile.x}px`; box.style.top = `${tile.y}px`; box.style.maxWidth = `${tile.w - 12}px`;
    name.textContent = tile.design.name;
    note.textContent = tile.design.drawn ? tile.design.drawn.note
      : tile.design.failed[chosen.stage] ? `no equilibrium: ${tile.design.failed[chosen.stage]}` : "not computed";
    box.append(name, note);
    box.title = chosen.design < 0 ? "show this design alone" : "show all designs";
    box.disabled = scene.designs.length < 2;
    box.onclick = () => choose({design: chosen.design < 0 ? scene.designs.indexOf(tile.design) : -1});
    return box;
  }

  function draw(picking = false) {
    renderer.resize();
    renderer.clear(picking);
    for (const tile of tiles) {
      const design = tile.design, state = design.drawn;
      if (!state) continue;
      const meshes = [{mesh: design.mesh, alpha: 1}];
      if (chosen.target && design.surface && state.placed) meshes.push({mesh: design.surface, alpha: 0.34});
      renderer.draw(tile, camera.looking(design.box[state.role]), meshes, chosen.part, picking);
    }
  }

  function redraw() {
    if (queued) return;
    queued = true;
    requestAnimationFrame(() => {
      queued = false;
      paint();
      root.dataset.firstFrame ??= String(Math.round(performance.now()));  // ms from the page's request
    });
  }

  function paint() {
    layOut();
    draw();
    $("overlay").replaceChildren(...tiles.filter(tile => tile.design.drawn).flatMap(overlay));
    root.dataset.drawn = String(1 + Number(root.dataset.drawn || 0));
  }

  // Scale bar, axes and, where asked for, labels of parts over a tile's drawing.
  function overlay(tile) {
    const eye = camera.looking(tile.design.box[tile.design.drawn.role]);
    return [scaleBar(tile, eye), axes(tile, eye), ...(chosen.labels ? partLabels(tile, eye) : [])];
  }

  function scaleBar(tile, eye) {
    const scale = eye.scale(tile), most = Math.min(160, 0.35 * tile.w) / scale, unit = 10 ** Math.floor(Math.log10(most));
    const length = [5, 2, 1].find(k => k * unit <= most * 1.000001) * unit, bar = element("div", "scale-bar");
    bar.style.left = `${tile.x + 14}px`; bar.style.top = `${tile.y + tile.h - 34}px`; bar.style.width = `${length * scale}px`;
    bar.textContent = `${Number(length.toPrecision(3))} ${scene.unit}`;
    return bar;
  }

  function axes(tile, eye) {
    const {right, up} = eye.axes, svg = $("axes").content.firstElementChild.cloneNode(true), r = 20;
    svg.style.left = `${tile.x + tile.w - 72}px`; svg.style.top = `${tile.y + tile.h - 72}px`;
    ["x", "y", "z"].forEach((name, k) => {
      const x = r * right[k], y = -r * up[k], line = svg.querySelector(`line.${name}`), text = svg.querySelector(`text.${name}`);
      line.setAttribute("x2", x); line.setAttribute("y2", y);
      text.setAttribute("x", 1.38 * x); text.setAttribute("y", 1.38 * y);
    });
    return svg;
  }

  // The nearest pieces' labels, as many as have room.
  function partLabels(tile, eye) {
    const {design} = tile, state = design.drawn, rods = design.rods[state.role], found = [];
    let ring = 0;
    for (let piece = 0; piece < rods.rings.length; ring += rods.rings[piece++]) {
      const i = ring + Math.floor((rods.rings[piece] - 1) / 2);
      if (rods.part[piece] >= 0) found.push({part: rods.part[piece], ...eye.pixel(tile, state.places.subarray(3 * i, 3 * i + 3))});
    }
    for (let k = 0; k < rods.corner_part.length; k++)
      if (rods.corner_part[k] >= 0) found.push({part: rods.corner_part[k], ...eye.pixel(tile, state.corners.subarray(3 * k, 3 * k + 3))});
    const kept = [], inside = l => l.x > tile.x + 12 && l.x < tile.x + tile.w - 12 && l.y > tile.y + 30 && l.y < tile.y + tile.h - 8;
    for (const one of found.filter(inside).sort((a, b) => a.depth - b.depth))
      if (kept.every(other => Math.abs(other.x - one.x) > 28 || Math.abs(other.y - one.y) > 15)) kept.push(one);
    return kept.map(({part, x, y}) => {
      const label = element("span", "part-label");
      label.textContent = scene.parts[part].label;
      label.style.left = `${x}px`; label.style.top = `${y}px`;
      return label;
    });
  }

  const element = (tag, name) => Object.assign(document.createElement(tag), {className: name});

  function pick(x, y) {
    draw(true);
    const part = renderer.partAt(x, y);
    draw();
    return part;
  }

  // -- controls ----------------------------------------------------------------------------------------------------
  function options(id, names, key, title = x => x) {
    const select = $(id);
    select.replaceChildren(...names.map((name, k) => new Option(title(name, k), name)));
    select.onchange = () => choose({[key]: key === "design" ? Number(select.value) : select.value});
    select.closest("label").hidden = names.length < 2;
  }

  function choose(change) {
    Object.assign(chosen, change);
    if (!roles.includes(chosen.role)) chosen.role = roles[0];
    const frames = shown().map(d => framesOf(d, chosen.stage, chosen.role));
    $("opening").closest("label").hidden = Math.max(0, ...frames.map(f => f.length)) < 2;
    $("design").value = chosen.design; $("stage").value = chosen.stage; $("role").value = chosen.role;
    $("colour").value = chosen.colour; $("target").checked = chosen.target; $("part-labels").checked = chosen.labels; $("opening").value = chosen.opening;
    $("part-labels").closest("label").hidden = !scene.parts.length;
    $("target").closest("label").hidden = !scene.designs.some(d => d.target);
    rebuild();
    legend();
    openingText();
    const hash = new URLSearchParams({design: chosen.design, stage: chosen.stage, role: chosen.role, colour: chosen.colour,
      target: Number(chosen.target), labels: Number(chosen.labels), opening: chosen.opening, ...(chosen.part >= 0 && {part: scene.parts[chosen.part].label})});
    history.replaceState(null, "", `#${hash}`);
  }

  function openingText() {
    const state = shown().map(d => d.drawn).find(s => s);
    const angle = state && state.opening !== null && shown().length === 1 ? `${(state.opening * 180 / Math.PI).toFixed(1)}°` : `${Math.round(100 * chosen.opening)} %`;
    $("opening-value").textContent = angle;
  }

  function legend() {
    const box = $("legend");
    box.replaceChildren();
    if (chosen.colour in scene.limits) {
      const limit = scene.limits[chosen.colour], bar = document.createElement("div"), ticks = document.createElement("div");
      const beyond = shown().some(d => (d.drawn?.[chosen.colour] ?? []).some(value => value > limit * 1.0001));
      bar.className = "bar";
      bar.style.background = `linear-gradient(90deg, ${scene.scale.map(css).join(",")})`;
      ticks.className = "ticks";
      for (let k = 0; k <= 4; k++) ticks.append(Object.assign(document.createElement("span"), {textContent: `${k === 4 && beyond ? "≥ " : ""}${Number((limit * k / 4).toPrecision(3))}`}));
      const title = {deviation: "distance from the target, % of its size", utilisation: "stress as a share of the elastic limit; above 1 it yields"}[chosen.colour];
      box.append(Object.assign(document.createElement("p"), {textContent: title}), bar, ticks);
      if (!shown().some(d => d.drawn?.[chosen.colour])) box.append(Object.assign(document.createElement("p"), {className: "quiet", textContent: "not known for this stage"}));
    }
    if (shown().some(d => d.drawn && d.over?.length)) box.append(Object.assign(document.createElement("p"), {className: "over", textContent: "Red: stressed beyond the elastic limit"}));
    for (const kind of unique(scene.parts.map(p => p.kind))) {
      const group = document.createElement("div");
      group.className = "parts";
      group.append(Object.assign(document.createElement("p"), {textContent: `${kind} parts`}));
      scene.parts.forEach((part, k) => { if (part.kind === kind) group.append(swatch(part, k)); });
      box.append(group);
    }
    const part = scene.parts[chosen.part];
    $("part").hidden = !scene.parts.length;
    $("part").textContent = part ? "" : "Click a rod, a corner or a label to see where the part is used.";
    if (part) $("part").append(...partText(part));
  }

  function swatch(part, k) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = part.label;
    button.setAttribute("aria-pressed", String(chosen.part === k));
    button.title = part.detail;
    button.style.setProperty("--colour", chosen.colour === "part" ? css(part.colour) : "#a8a8a8");
    button.onclick = () => choose({part: chosen.part === k ? -1 : k});
    return button;
  }

  function partText(part) {
    const uses = part.uses.map((n, k) => `${scene.designs[k].name}: ${n}`).filter((_, k) => part.uses[k]);
    const name = Object.assign(document.createElement("b"), {textContent: `${part.label} `});
    return [name, part.detail, document.createElement("br"),
            part.uses.length ? `used in ${uses.length} of ${part.uses.length} designs — ${uses.join(", ") || "none"}` : ""];
  }

  const css = c => `rgb(${c.map(x => Math.round(255 * x)).join(",")})`;

  // -- mouse, fingers, keys ----------------------------------------------------------------------------------------
  const pointers = new Map();
  let moved = 0;

  function onMove(event) {
    const last = pointers.get(event.pointerId);
    if (!last) return;
    const dx = event.offsetX - last.x, dy = event.offsetY - last.y, other = [...pointers].find(([id]) => id !== event.pointerId);
    moved += Math.abs(dx) + Math.abs(dy);
    if (other) {
      const before = Math.hypot(last.x - other[1].x, last.y - other[1].y), after = Math.hypot(event.offsetX - other[1].x, event.offsetY - other[1].y);
      zoom(after / (before || 1));
    } else if (event.buttons & 2 || event.shiftKey) {
      const scale = 0.95 / (tiles[0].h * camera.zoom);
      camera.pan = [camera.pan[0] + dx * scale, camera.pan[1] - dy * scale];
    } else turn(-0.008 * dx, 0.008 * dy);
    pointers.set(event.pointerId, {x: event.offsetX, y: event.offsetY});
    redraw();
  }

  function turn(azimuth, elevation) {
    camera.azimuth += azimuth;
    camera.elevation = Math.max(-1.5, Math.min(1.5708, camera.elevation + elevation));
    redraw();
  }

  function zoom(factor) { camera.zoom = Math.max(0.3, Math.min(40, camera.zoom * factor)); redraw(); }

  function home() { Object.assign(camera, new Camera()); redraw(); }

  function listen() {
    canvas.addEventListener("pointerdown", e => { canvas.setPointerCapture(e.pointerId); pointers.set(e.pointerId, {x: e.offsetX, y: e.offsetY}); moved = 0; });
    canvas.addEventListener("pointermove", onMove);
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, e => {
      if (pointers.delete(e.pointerId) && name === "pointerup" && moved < 5 && e.button === 0) choose({part: pick(e.offsetX, e.offsetY)});
    });
    canvas.addEventListener("contextmenu", e => e.preventDefault());
    canvas.addEventListener("wheel", e => { e.preventDefault(); zoom(Math.exp(-0.0012 * e.deltaY)); }, {passive: false});
    canvas.addEventListener("dblclick", home);
    canvas.addEventListener("keydown", e => {
      const act = {ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1),
                   "+": () => zoom(1.15), "-": () => zoom(1 / 1.15), Home: home, Escape: () => choose({part: -1})}[e.key];
      if (act) { e.preventDefault(); act(); }
    });
    new ResizeObserver(paint).observe(canvas);  // before the browser paints: the last drawing would be stretched
    $("target").onchange = e => choose({target: e.target.checked});
    $("part-labels").onchange = e => choose({labels: e.target.checked});
    $("opening").oninput = e => choose({opening: Number(e.target.value)});
    $("home").onclick = home;
    $("top").onclick = () => { Object.assign(camera, new Camera(), {azimuth: -Math.PI / 2, elevation: 1.5708, zoom: 0.85}); redraw(); };
    window.addEventListener("hashchange", fromAddress);
  }

  // The address says what is shown, so that a view can be kept and sent.
  function fromAddress() {
    const given = new URLSearchParams(location.hash.slice(1)), change = {};
    for (const [key, names] of [["stage", ordered], ["role", roles], ["colour", scene.colourings]])
      if (names.includes(given.get(key))) change[key] = given.get(key);
    const design = Number(given.get("design") ?? NaN);
    if (Number.isInteger(design) && design >= -1 && design < scene.designs.length) change.design = design;
    if (given.has("target")) change.target = given.get("target") !== "0";
    if (given.has("labels")) change.labels = given.get("labels") === "1";
    if (given.has("opening")) change.opening = Math.max(0, Math.min(1, Number(given.get("opening")) || 0));
    change.part = scene.parts.findIndex(p => p.label === given.get("part"));
    choose(change);
  }

  try {
    renderer = new Renderer(canvas);
  } catch (error) {
    $("message").textContent = `The drawing can't be shown: ${error.message}`;
    $("message").hidden = false;
    root.dataset.failed = "1";
    return;
  }
  chosen.design = scene.designs.length > 1 ? -1 : 0;
  chosen.stage = ordered[ordered.length - 1];
  chosen.role = roles[0];
  chosen.colour = scene.colourings[0];
  options("design", [...(scene.designs.length > 1 ? [-1] : []), ...scene.designs.keys()], "design", k => k < 0 ? "all designs" : scene.designs[k].name);
  options("stage", ordered, "stage");
  options("role", roles, "role");
  options("colour", scene.colourings, "colour");
  listen();
  fromAddress();
  paint();
  root.dataset.ready = "1";
})();
