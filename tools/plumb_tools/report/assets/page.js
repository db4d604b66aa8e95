// Figures: drawn when they come near the window, in the colours of the page, with a cursor at the viewer's time.

const data = JSON.parse(document.getElementById("data").textContent);
const root = document.documentElement;
const plots = [...document.querySelectorAll(".plot")];
const CONFIG = { displaylogo: false, responsive: true, displayModeBar: "hover", modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };
const CURSOR = "cursor";
let now = null; // the frame in the viewer

function colour(name) {
  return getComputedStyle(root).getPropertyValue(name).trim();
}

function isAxis(key) {
  return /^[xy]axis\d*$/.test(key);
}

// The colours of a figure as a change of its layout.
function themed(layout) {
  const text = colour("--text");
  const soft = colour("--soft");
  const lines = colour("--grid");
  const change = {
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    "font.color": text,
    "font.family": getComputedStyle(document.body).fontFamily,
    "hoverlabel.bgcolor": colour("--panel"),
    "hoverlabel.bordercolor": colour("--line"),
    "hoverlabel.font.color": text,
    "legend.bgcolor": "rgba(0,0,0,0)",
    "modebar.bgcolor": "rgba(0,0,0,0)",
    "modebar.color": soft,
    "modebar.activecolor": text,
  };
  const axes = Object.keys(layout).filter(isAxis);
  const scene = layout.scene ? ["scene.xaxis", "scene.yaxis", "scene.zaxis"] : [];
  for (const axis of [...axes, ...scene]) {
    change[`${axis}.gridcolor`] = lines;
    change[`${axis}.zerolinecolor`] = colour("--line");
    change[`${axis}.linecolor`] = lines;
    change[`${axis}.tickfont.color`] = soft;
    change[`${axis}.title.font.color`] = soft;
    if (!axis.startsWith("scene")) {
      change[`${axis}.showline`] = true;
      change[`${axis}.automargin`] = true;
    } else {
      change[`${axis}.backgroundcolor`] = colour("--page");
      change[`${axis}.showbackground`] = true;
    }
  }
  return change;
}

function assign(layout, change) {
  for (const [path, value] of Object.entries(change)) {
    const keys = path.split(".");
    const last = keys.pop();
    let here = layout;
    for (const key of keys) here = here[key] ??= {};
    here[last] = value;
  }
}

function cursorShapes(div) {
  const figure = data.figures[div.dataset.key];
  const others = (figure.layout.shapes || []).filter((shape) => shape.name !== CURSOR);
  if (!now || !figure.overTime) return others;
  const line = { color: colour("--alert"), width: 1.2, dash: "dot" };
  const place = { x0: now.t, x1: now.t, y0: 0, y1: 1, xref: "x", yref: "paper" };
  const columns = Object.keys(figure.layout).filter((key) => /^xaxis\d*$/.test(key));
  const drawn = new Set();
  for (const axis of columns) {
    const domain = figure.layout[axis].domain || [0, 1];
    if (drawn.has(domain[0])) continue;
    drawn.add(domain[0]);
    others.push({ type: "line", name: CURSOR, ...place, xref: axis.replace("axis", ""), line });
  }
  return others;
}

const drawn = new Map();

// Draws a figure once; resolves when it stands.
function draw(div) {
  if (!drawn.has(div)) drawn.set(div, drawNow(div));
  return drawn.get(div);
}

async function drawNow(div) {
  const figure = data.figures[div.dataset.key];
  assign(figure.layout, themed(figure.layout));
  const layout = { ...figure.layout, shapes: cursorShapes(div) };
  await Plotly.newPlot(div, figure.data, layout, CONFIG);
  if (figure.overTime) div.on("plotly_click", (event) => viewer.showTime(event.points[0].x));
  if (div.dataset.key === "plan") moveMarker(div);
}

async function moveMarker(div) {
  if (!now || div.dataset.marked === "busy") return;
  const [x, y] = now.position;
  const marker = { size: 13, color: "rgba(0,0,0,0)", line: { color: colour("--alert"), width: 3 } };
  const trace = { x: [x], y: [y], mode: "markers", marker, name: "image viewer", showlegend: false };
  if (div.dataset.marked) {
    await Plotly.restyle(div, { x: [[x]], y: [[y]] }, [div.data.length - 1]);
  } else {
    div.dataset.marked = "busy";
    await Plotly.addTraces(div, trace);
    div.dataset.marked = "yes";
  }
}

const near = new Set();
const watcher = new IntersectionObserver(
  (entries) => {
    for (const entry of entries) {
      if (entry.isIntersecting) {
        near.add(entry.target);
        draw(entry.target).then(() => follow(entry.target));
      } else {
        near.delete(entry.target);
      }
    }
  },
  { rootMargin: "500px" }
);

function follow(div) {
  if (!div.data || !now) return;
  if (data.figures[div.dataset.key].overTime) Plotly.relayout(div, { shapes: cursorShapes(div) });
  else if (div.dataset.key === "plan") moveMarker(div);
}

let pending = false;
function moved(frame) {
  now = frame;
  if (pending) return;
  pending = true;
  requestAnimationFrame(() => {
    pending = false;
    near.forEach(follow);
  });
}

function setTheme(name) {
  root.dataset.theme = name;
  for (const div of plots) {
    if (div.data) Plotly.relayout(div, { ...themed(data.figures[div.dataset.key].layout), shapes: cursorShapes(div) });
  }
}

// Between one scale for the replays side by side and one for each.
function release(button) {
  const div = button.closest("figure").querySelector(".plot");
  const figure = data.figures[div.dataset.key];
  const free = button.classList.toggle("free");
  button.textContent = free ? "one scale" : "own scales";
  const change = {};
  for (const [axis, range] of Object.entries(free ? figure.own : figure.common)) change[`${axis}.range`] = range;
  draw(div).then(() => Plotly.relayout(div, change));
}

root.dataset.theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
const viewer = new Viewer(data.viewer, moved);
plots.forEach((div) => watcher.observe(div));
document.getElementById("theme").addEventListener("click", () => {
  setTheme(root.dataset.theme === "dark" ? "light" : "dark");
});
document.querySelectorAll(".release").forEach((button) => button.addEventListener("click", () => release(button)));
document.querySelectorAll("a[data-time]").forEach((link) => {
  link.addEventListener("click", () => viewer.showTime(Number(link.dataset.time)));
});
addEventListener("beforeprint", () => plots.forEach(draw));
