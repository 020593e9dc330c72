"use strict";
// State of the page. The server keeps the points; the page sends where in a picture one was set, and is told where all are.
const views = {};
let head, state, chosen = null, colour = {}, order = [];

const group = name => name.replace(/\d+$/, "");
const plain = name => `${group(name).replaceAll("_", " ")} ${Number(name.slice(group(name).length))}`;

function draw() {
  const placed = new Set(state.placed);
  for (const [name, view] of Object.entries(views)) {
    const {box, svg, dots} = view;
    svg.setAttribute("viewBox", `${box.x} ${box.y} ${box.width} ${box.height}`);
    const pixel = Math.max(box.width / (svg.clientWidth || 1), box.height / (svg.clientHeight || 1));
    dots.replaceChildren();
    const seen = Object.entries(state.seen[name]).filter(([, p]) => p[2]);
    seen.sort((a, b) => (a[0] === chosen) - (b[0] === chosen));  // the chosen one is drawn last, over the others
    for (const [point, place] of seen) {
      dot(place, (point === chosen ? 7 : 4.5) * pixel, colour[group(point)], plain(point), dots,
        {"data-point": point, class: [point === chosen && "chosen", placed.has(point) && "placed"].filter(Boolean).join(" ")});
    }
  }
  for (const button of document.querySelectorAll("[data-name]")) {
    button.classList.toggle("placed", placed.has(button.dataset.name));
    button.dataset.name === chosen ? button.setAttribute("aria-current", "true") : button.removeAttribute("aria-current");
  }
  const all = Object.keys(state.seen.front).length;
  $("count").textContent = `${all} of ${order.length} points, ${placed.size} set by hand`;
  $("undo").disabled = !state.undo;
  listed($("faults"), state.faults, all < order.length ? "points are missing" : "nothing so far");
  $("help").textContent = all < order.length
    ? `No guess fitted this mesh. Set at least six points, of the lips, the nose and the face: the others follow.`
    : "Points with a dark ring were set by hand.";
  reference();
}

function reference() {
  $("marks").replaceChildren();
  $("chosen").textContent = chosen ? plain(chosen) : "Choose a point";
  for (const [name, place] of Object.entries(head.reference.points)) {
    if (name === chosen || (chosen && group(name) === group(chosen)))
      dot(place, name === chosen ? 7 : 2.5, colour[group(name)], plain(name), $("marks"), {class: name === chosen ? "chosen" : ""});
  }
}

function choose(name) {
  chosen = name;
  document.querySelector(`[data-name="${name}"]`).closest("details").open = true;
  draw();
  document.querySelector(`[data-name="${name}"]`).scrollIntoView({block: "nearest"});
}

function along(step) {
  const at = order.indexOf(chosen);
  choose(order[at < 0 ? 0 : (at + step + order.length) % order.length]);
}

const set = guarded(async (view, name, [x, y]) => {
  state = {...state, ...await ask("points", {view, name, x, y})};
  say(`${plain(name)} is set`); draw();
}, () => draw());
const undo = guarded(async () => { state = {...state, ...await ask("undo", {})}; say("taken back"); draw(); }, () => draw());

function look(names, room) {  // all views show these points, or the whole picture
  for (const [name, view] of Object.entries(views)) {
    const own = names.map(n => state.seen[name][n]).filter(Boolean), [width, height] = view.size;
    if (!own.length) { view.box = {x: 0, y: 0, width, height}; continue; }
    const xs = own.map(p => p[0]), ys = own.map(p => p[1]);
    const wide = room * (Math.max(...xs) - Math.min(...xs)), high = room * (Math.max(...ys) - Math.min(...ys));
    view.box = {x: (Math.max(...xs) + Math.min(...xs) - wide) / 2, y: (Math.max(...ys) + Math.min(...ys) - high) / 2, width: wide, height: high};
  }
  draw();
}

function zoom(view, factor, [x, y]) {
  const width = Math.min(Math.max(view.box.width * factor, 20), 3 * view.size[0]), by = width / view.box.width;
  view.box = {x: x - (x - view.box.x) * by, y: y - (y - view.box.y) * by, width, height: view.box.height * by};
  draw();
}

function wire(name, view) {
  const {svg} = view;
  const at = event => {
    const p = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    return [p.x, p.y];
  };
  svg.addEventListener("pointerdown", event => {
    if (event.button !== 0) return;
    const hit = event.target.dataset.point, start = at(event), held = {...view.box}, from = [event.clientX, event.clientY];
    const scale = svg.getScreenCTM().a;
    let moved = false, last = start;
    svg.setPointerCapture(event.pointerId); svg.focus();
    if (hit) choose(hit);
    svg.onpointermove = e => {
      if (Math.hypot(e.clientX - from[0], e.clientY - from[1]) < 3 && !moved) return;
      moved = true; last = at(e);
      if (hit) { state.seen[name][hit] = [...last, true]; draw(); }
      else { svg.classList.add("moving"); view.box = {...held, x: held.x - (e.clientX - from[0]) / scale, y: held.y - (e.clientY - from[1]) / scale}; draw(); }
    };
    svg.onpointerup = svg.onpointercancel = e => {
      svg.onpointermove = svg.onpointerup = svg.onpointercancel = null; svg.classList.remove("moving");
      if (e.type === "pointercancel") return;
      if (hit && moved) set(name, hit, last);
      else if (!hit && !moved && chosen) {
        const fresh = !state.placed.includes(chosen), point = chosen;
        set(name, point, start).then(() => { if (fresh && !state.guessed && state.placed.includes(point)) along(1); });
      }
    };
  });
  svg.addEventListener("wheel", event => { event.preventDefault(); zoom(view, event.deltaY > 0 ? 1.15 : 0.87, at(event)); }, {passive: false});
  svg.addEventListener("keydown", event => {
    const step = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[event.key];
    const own = chosen && state.seen[name][chosen];
    if (!step || !own) return;
    event.preventDefault();
    const by = event.shiftKey ? 5 : 1;
    set(name, chosen, [own[0] + by * step[0], own[1] + by * step[1]]);
  });
}

addEventListener("keydown", event => {
  if (event.altKey || event.ctrlKey || event.metaKey) return;
  const work = {z: () => $("undo").click(), f: () => $("face").click(), l: () => $("lips").click(), ".": () => along(1), ",": () => along(-1)}[event.key.toLowerCase()];
  if (work) { event.preventDefault(); work(); }
});
addEventListener("resize", () => state && draw());

guarded(async () => {
  head = state = await ask("head");
  head.groups.forEach((g, k) => {
    colour[g.name] = head.colours[k % head.colours.length];
    order.push(...g.points);
    const row = document.createElement("details"), title = document.createElement("summary"), dot = document.createElement("i"), all = document.createElement("div");
    dot.style.background = colour[g.name];
    title.append(dot, `${g.name.replaceAll("_", " ")} (${g.points.length})`); row.append(title, all);
    for (const name of g.points) {
      const button = Object.assign(document.createElement("button"), {textContent: Number(name.slice(g.name.length)), title: plain(name)});
      button.dataset.name = name; button.setAttribute("aria-label", plain(name));
      button.addEventListener("click", () => choose(name)); all.append(button);
    }
    row.open = g.name.startsWith("lips"); $("names").append(row);
  });
  for (const {name, size} of head.views) {
    const figure = document.createElement("figure"), caption = document.createElement("figcaption");
    caption.textContent = name; figure.append(caption);
    const svg = element("svg", {tabindex: 0, role: "application", "aria-label": `${name} of the mesh: arrows move the chosen point`}, figure);
    element("image", {href: `view/${encodeURIComponent(name)}`, width: size[0], height: size[1]}, svg);
    views[name] = {svg, size, dots: element("g", {}, svg), box: {x: 0, y: 0, width: size[0], height: size[1]}};
    $("views").append(figure); wire(name, views[name]);
  }
  const [width, height] = head.reference.size;
  $("reference").setAttribute("viewBox", `0 0 ${width} ${height}`);
  for (const [key, value] of Object.entries({href: "reference", width, height})) $("example").setAttribute(key, value);
  $("where").textContent = head.mesh; $("command").textContent = head.next;
  $("undo").addEventListener("click", undo);
  $("next").addEventListener("click", () => along(1));
  $("face").addEventListener("click", () => look([], 1));
  $("lips").addEventListener("click", () => look(order.filter(n => n.startsWith("lips_outer")), 1.7));
  choose(order.find(n => n.startsWith("lips_outer")) || order[0]);
})();
