"use strict";
// State of the page. Points are in pixels of the picture; (0, 0) is the outer corner of its top left pixel, as in the .pts files.
const COLOURS = ["#ff6b6b", "#ffb454", "#6fc3ff", "#8be28b", "#d59cff", "#ff9ecb", "#5fe0d0", "#e8e26a", "#b0bccb", "#f2a07b"];
const view = $("view");
let sheet, now = 0, points = [], saved = "[]", guessed = false, asked = false, past = [], future = [], chosen = -1, mode = "point", hidden = new Set();
let box = {x: 0, y: 0, width: 1, height: 1}, picture = {width: 1, height: 1};

const path = (kind, image) => `${kind}/${encodeURIComponent(image)}`;
const groupOf = i => sheet.groups.findIndex(g => i >= g.start && i < g.stop);
const nameOf = i => { const g = sheet.groups[groupOf(i)]; return `${g.name} ${i - g.start}`; };
const label = () => sheet.labels[now];
const text = () => JSON.stringify(points);

// Drawing

function draw() {
  view.setAttribute("viewBox", `${box.x} ${box.y} ${box.width} ${box.height}`);
  const pixel = box.width / (view.clientWidth || 1);
  $("lines").replaceChildren(); $("points").replaceChildren();
  sheet.groups.forEach((g, k) => {
    if (hidden.has(g.name)) return;
    const own = points.slice(g.start, g.stop);
    element(g.closed ? "polygon" : "polyline", {points: own.map(p => p.join()).join(" "), stroke: COLOURS[k % COLOURS.length]}, $("lines"));
    own.forEach((place, i) => {
      const at = g.start + i;
      dot(place, (at === chosen ? 7 : 5) * pixel, COLOURS[k % COLOURS.length], nameOf(at), $("points"),
        {"data-point": at, "stroke-width": at === chosen ? 2 : 1, class: at === chosen ? "chosen" : ""});
    });
  });
  $("chosen").textContent = chosen < 0 ? "none chosen" : `${nameOf(chosen)}   x ${points[chosen][0].toFixed(2)}   y ${points[chosen][1].toFixed(2)}`;
  chart();
  $("undo").disabled = !past.length; $("redo").disabled = !future.length; $("copy").disabled = $("previous").disabled = now === 0;
  $("next").disabled = now === sheet.labels.length - 1;
}

// Where each point belongs: the scheme's layout, the chosen point in it.
function chart() {
  $("chart").replaceChildren();
  $("chart").toggleAttribute("hidden", !sheet.layout);
  if (!sheet.layout) return;
  const xs = sheet.layout.map(p => p[0]), ys = sheet.layout.map(p => p[1]), edge = 0.15;
  const [left, top] = [Math.min(...xs) - edge, Math.min(...ys) - edge];
  const [width, height] = [Math.max(...xs) + edge - left, Math.max(...ys) + edge - top];
  $("chart").setAttribute("viewBox", `${left} ${top} ${width} ${height}`);
  sheet.groups.forEach((g, k) => {
    const own = sheet.layout.slice(g.start, g.stop), colour = COLOURS[k % COLOURS.length];
    element(g.closed ? "polygon" : "polyline", {points: own.map(p => p.join()).join(" "), stroke: colour, fill: "none", "stroke-width": 0.015}, $("chart"));
    own.forEach((place, i) => dot(place, g.start + i === chosen ? 0.07 : 0.028, colour, nameOf(g.start + i), $("chart")));
  });
}

function list() {
  const done = sheet.labels.filter(l => l.done).length;
  $("where").textContent = `${sheet.scheme}  ·  ${sheet.folder}`;
  $("count").textContent = `${done} of ${sheet.labels.length} finished`;
  $("after").hidden = done < sheet.labels.length;
  $("command").textContent = sheet.next;
  $("progress").firstElementChild.style.width = `${100 * done / sheet.labels.length}%`;
  $("progress").setAttribute("aria-valuenow", Math.round(100 * done / sheet.labels.length));
  [...$("frames").children].forEach((button, i) => {
    button.classList.toggle("done", sheet.labels[i].done);
    i === now ? button.setAttribute("aria-current", "true") : button.removeAttribute("aria-current");
  });
  $("frames").children[now].scrollIntoView({block: "nearest"});
  document.title = `${label().image} – labels`;
}

function fit() {
  const xs = points.map(p => p[0]), ys = points.map(p => p[1]);
  const wide = 1.3 * Math.max(Math.max(...xs) - Math.min(...xs), 8), high = 1.3 * Math.max(Math.max(...ys) - Math.min(...ys), 8);
  const shape = view.clientWidth / view.clientHeight || 1, width = Math.max(wide, high * shape);
  box = {width, height: width / shape};
  box.x = (Math.max(...xs) + Math.min(...xs) - box.width) / 2; box.y = (Math.max(...ys) + Math.min(...ys) - box.height) / 2;
  draw();
}

function zoom(factor, at = [box.x + box.width / 2, box.y + box.height / 2]) {
  const width = Math.min(Math.max(box.width * factor, 4), 8 * Math.max(picture.width, picture.height)), by = width / box.width;
  box = {x: at[0] - (at[0] - box.x) * by, y: at[1] - (at[1] - box.y) * by, width, height: box.height * by};
  draw();
}

// Changing points

function remember() { past.push(text()); future = []; if (past.length > 200) past.shift(); }
function back(from, to) { if (!from.length) return; to.push(text()); points = JSON.parse(from.pop()); draw(); }
const inPicture = event => {
  const r = view.getBoundingClientRect();
  return [box.x + (event.clientX - r.left) * box.width / r.width, box.y + (event.clientY - r.top) * box.height / r.height];
};
function moved() {  // the indices that a drag of the chosen point moves
  if (mode === "point") return [chosen];
  if (mode === "shape") return points.map((_, i) => i);
  const g = sheet.groups[groupOf(chosen)];
  return Array.from({length: g.stop - g.start}, (_, i) => g.start + i);
}

view.addEventListener("pointerdown", event => {
  if (event.button !== 0) return;
  const hit = event.target.dataset.point, start = inPicture(event), before = points.map(p => [...p]), held = {...box};
  const x = event.clientX, y = event.clientY;
  view.setPointerCapture(event.pointerId); view.classList.add("moving"); view.focus();
  if (hit !== undefined) { chosen = Number(hit); remember(); draw(); }
  const which = hit === undefined ? [] : moved();
  const middle = [0, 1].map(k => before.reduce((sum, p) => sum + p[k], 0) / before.length);
  const drag = e => {
    if (hit === undefined) {
      const r = view.getBoundingClientRect();
      box.x = held.x - (e.clientX - x) * held.width / r.width; box.y = held.y - (e.clientY - y) * held.height / r.height;
    } else {
      const at = inPicture(e);
      const turn = mode === "shape" && e.shiftKey;
      const [ax, ay] = [start[0] - middle[0], start[1] - middle[1]], [bx, by] = [at[0] - middle[0], at[1] - middle[1]];
      const n = ax * ax + ay * ay || 1, c = (ax * bx + ay * by) / n, s = (ax * by - ay * bx) / n;
      for (const i of which) {
        const [px, py] = before[i], [dx, dy] = [px - middle[0], py - middle[1]];
        points[i] = turn ? [middle[0] + c * dx - s * dy, middle[1] + s * dx + c * dy] : [px + at[0] - start[0], py + at[1] - start[1]];
      }
    }
    draw();
  };
  const drop = () => {
    view.classList.remove("moving");
    view.removeEventListener("pointermove", drag); view.removeEventListener("pointerup", drop); view.removeEventListener("pointercancel", drop);
    if (hit !== undefined && past.at(-1) === text()) past.pop();
    draw();
  };
  view.addEventListener("pointermove", drag); view.addEventListener("pointerup", drop); view.addEventListener("pointercancel", drop);
});
view.addEventListener("wheel", event => { event.preventDefault(); zoom(Math.exp(event.deltaY * 0.0015), inPicture(event)); }, {passive: false});

function nudge(dx, dy) {
  if (chosen < 0) return;
  remember();
  for (const i of moved()) points[i] = [points[i][0] + dx, points[i][1] + dy];
  draw();
}

// Frames

async function open(index) {
  const given = await ask(path("points", sheet.labels[index].image));
  now = index; chosen = -1; past = []; future = [];  // at once: what is saved now are this frame's own points
  points = given.points; saved = text(); guessed = !label().moved && !label().done; asked = false;
  say(guessed ? `placed by: ${given.how}` : "");
  const image = new Image(); image.src = path("image", label().image); await image.decode();
  picture = {width: image.naturalWidth, height: image.naturalHeight};
  for (const [key, value] of Object.entries({href: image.src, x: 0, y: 0, ...picture})) $("picture").setAttribute(key, value);
  list(); fit();
}

async function save(done = label().done) {
  if (done && guessed && saved === text() && !asked) {
    asked = true;
    say("These points are still a guess. Are they right? Then finish once more.", true);
    return false;
  }
  await ask(path("points", label().image), {points, done});
  saved = text(); guessed = false; label().done = done; label().moved = true; list(); say(`saved ${label().image}`);
  doubt();
  return true;
}

const go = guarded(async (index, done) => {
  if ((done !== undefined || saved !== text()) && !await save(done)) return;
  if (index >= 0 && index < sheet.labels.length && index !== now) await open(index);
});

async function doubt() {
  const found = (await ask("doubts")).filter(d => d.problem !== "not finished");
  listed($("doubts"), found.map(d => `${d.image}: ${d.problem}`), "nothing so far");
}

const copy = guarded(async () => {
  if (!now) return;
  const before = (await ask(path("points", sheet.labels[now - 1].image))).points;
  remember(); points = before; fit(); say(`points of ${sheet.labels[now - 1].image}`);
});

// The next point that is shown, or the one before it.
function along(step) {
  const shown = points.map((_, i) => i).filter(i => !hidden.has(sheet.groups[groupOf(i)].name)), at = shown.indexOf(chosen);
  if (!shown.length) return;
  chosen = shown[at < 0 ? (step > 0 ? 0 : shown.length - 1) : (at + step + shown.length) % shown.length];
  draw();
}

function setMode(name) {
  mode = name;
  document.querySelectorAll("[data-mode]").forEach(b => { b.setAttribute("role", "radio"); b.setAttribute("aria-checked", b.dataset.mode === mode); });
}

const CLICKS = {
  undo: () => back(past, future), redo: () => back(future, past), copy, fit, in: () => zoom(0.8), out: () => zoom(1.25),
  previous: () => go(now - 1), next: () => go(now + 1), save: guarded(() => save()), finish: () => go(now + 1, true),
};
const KEYS = {z: "undo", y: "redo", c: "copy", f: "fit", "+": "in", "-": "out", p: "previous", n: "next", s: "save", enter: "finish"};
const ALONG = {".": 1, ",": -1};
const ARROWS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
const MODES = {1: "point", 2: "group", 3: "shape"};

addEventListener("keydown", event => {
  if (event.key === "h") view.classList.add("bare");
  if (event.altKey || (event.key === "Enter" && event.target.tagName === "BUTTON")) return;
  const arrow = ARROWS[event.key], action = KEYS[event.key.toLowerCase()];
  if (arrow && chosen >= 0) { event.preventDefault(); const step = event.shiftKey ? 1 : 0.25; nudge(step * arrow[0], step * arrow[1]); }
  else if (ALONG[event.key]) along(ALONG[event.key]);
  else if (MODES[event.key]) setMode(MODES[event.key]);
  else if (action && (!(event.ctrlKey || event.metaKey) || "zy".includes(event.key))) { event.preventDefault(); $(action).click(); }
});
addEventListener("keyup", event => { if (event.key === "h") view.classList.remove("bare"); });
addEventListener("resize", () => { box.height = box.width * view.clientHeight / view.clientWidth; draw(); });
addEventListener("beforeunload", event => { if (saved !== text()) event.preventDefault(); });

guarded(async () => {
  sheet = await ask("labels");
  for (const [id, work] of Object.entries(CLICKS)) $(id).addEventListener("click", work);
  document.querySelectorAll("[data-mode]").forEach(b => b.addEventListener("click", () => setMode(b.dataset.mode)));
  setMode("point");
  sheet.labels.forEach((l, i) => {
    const button = document.createElement("button"), image = new Image(), name = document.createElement("span");
    image.src = path("image", l.image); image.alt = ""; image.loading = "lazy";
    name.textContent = `${l.frame} · ${l.video}`; button.title = `${l.video} ${l.frame}`;
    button.append(image, name); button.addEventListener("click", () => go(i)); $("frames").append(button);
  });
  sheet.groups.forEach((g, k) => {
    const row = document.createElement("li");
    row.innerHTML = `<label><input type="checkbox" checked><i></i><span></span><small>${g.stop - g.start}</small></label>`;
    row.querySelector("i").style.background = COLOURS[k % COLOURS.length];  // the page's policy allows no style in HTML
    row.querySelector("span").textContent = g.name.replaceAll("_", " ");
    row.querySelector("input").addEventListener("change", e => { e.target.checked ? hidden.delete(g.name) : hidden.add(g.name); draw(); });
    $("groups").append(row);
  });
  const first = sheet.labels.findIndex(l => !l.done);
  await open(Math.max(first, 0)); doubt();
})();
