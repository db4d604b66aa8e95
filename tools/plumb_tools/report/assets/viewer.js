"use strict";
// The image viewer: a JPEG with what the filter saw drawn over it as vectors, in pixels of the image as taken.

const LAYERS = [
  { key: "facets", name: "Delaunay facets", colour: "#4cc2ff" },
  { key: "tails", name: "tracks", colour: "#ffd23f" },
  { key: "slam", name: "SLAM features", colour: "#3ddc97" },
  { key: "ranged", name: "ranged facet and beam", colour: "#ff3b42" },
];

function polygons(facets) {
  return facets.map((p) => `M${p[0]} ${p[1]}L${p[2]} ${p[3]}L${p[4]} ${p[5]}Z`).join("");
}

function dots(flat) {
  let path = "";
  for (let i = 0; i < flat.length; i += 2) path += `M${flat[i]} ${flat[i + 1]}h0`;
  return path;
}

function lines(polylines) {
  return polylines
    .map((p) => {
      let path = `M${p[0]} ${p[1]}`;
      for (let i = 2; i < p.length; i += 2) path += `L${p[i]} ${p[i + 1]}`;
      return path;
    })
    .join("");
}

class Viewer {
  constructor(data, onMove) {
    this.data = data;
    this.onMove = onMove;
    this.index = -1;
    this.timer = null;
    this.image = document.getElementById("image");
    this.svg = document.getElementById("overlay");
    this.slider = document.getElementById("slider");
    this.svg.setAttribute("viewBox", `0 0 ${data.width} ${data.height}`);
    this.unit = data.width / 560; // strokes keep their width whatever the camera
    this.slider.max = data.frames.length - 1;
    this.groups = {};
    for (const layer of LAYERS) this.addLayer(layer);
    this.bind();
    this.show(data.first);
  }

  addLayer(layer) {
    const group = document.createElementNS("http://www.w3.org/2000/svg", "g");
    this.svg.appendChild(group);
    this.groups[layer.key] = group;
    if (!this.data.hasFeatures && layer.key !== "ranged") return;
    const label = document.createElement("label");
    label.innerHTML = `<input type="checkbox" checked><i style="background:${layer.colour}"></i>${layer.name}`;
    label.firstChild.addEventListener("change", (event) => {
      group.style.display = event.target.checked ? "" : "none";
    });
    document.getElementById("layers").appendChild(label);
  }

  bind() {
    this.slider.addEventListener("input", () => this.show(Number(this.slider.value)));
    document.getElementById("play").addEventListener("click", () => this.play());
    document.addEventListener("keydown", (event) => {
      if (event.target.tagName === "INPUT" && event.target !== this.slider) return;
      if (event.key === " " && event.target.tagName !== "BUTTON") {
        event.preventDefault();
        this.play();
      } else if (event.target !== this.slider && (event.key === "ArrowRight" || event.key === "ArrowLeft")) {
        this.show(this.index + (event.key === "ArrowRight" ? 1 : -1));
      }
    });
  }

  play() {
    const button = document.getElementById("play");
    if (this.timer !== null) {
      clearInterval(this.timer);
      this.timer = null;
    } else {
      this.timer = setInterval(() => this.show((this.index + 1) % this.data.frames.length), 250);
    }
    button.innerHTML = this.timer === null ? "&#9654;" : "&#10074;&#10074;";
  }

  // Shows the image nearest to a time [s].
  showTime(t) {
    let best = 0;
    this.data.frames.forEach((frame, i) => {
      if (Math.abs(frame.t - t) < Math.abs(this.data.frames[best].t - t)) best = i;
    });
    this.show(best);
  }

  show(index) {
    const last = this.data.frames.length - 1;
    this.index = Math.max(0, Math.min(last, index));
    const frame = this.data.frames[this.index];
    this.slider.value = this.index;
    this.image.src = frame.image;
    document.getElementById("clock").textContent = `${frame.t.toFixed(2)} s`;
    this.draw(frame);
    this.tell(frame);
    this.onMove(frame);
  }

  draw(frame) {
    const u = this.unit;
    const path = (d, colour, width, more = "") =>
      `<path d="${d}" fill="none" stroke="${colour}" stroke-width="${width * u}" stroke-linecap="round" ${more}/>`;
    const dark = "rgba(0,0,0,.55)";
    const [facets, tails, slam, ranged] = LAYERS.map((layer) => layer.colour);
    this.groups.facets.innerHTML = path(polygons(frame.facets), facets, 0.9, 'opacity="0.7" stroke-linejoin="round"');
    this.groups.tails.innerHTML =
      path(lines(frame.tails), tails, 0.9, 'opacity="0.75"') + path(dots(frame.tracks), tails, 3);
    this.groups.slam.innerHTML = path(dots(frame.slam), dark, 7.4) + path(dots(frame.slam), slam, 5.4);
    let red = "";
    if (frame.ranged) {
      const fill = `<path d="${polygons([frame.ranged])}" fill="${ranged}" fill-opacity=".28"/>`;
      red = fill + path(polygons([frame.ranged]), ranged, 2.2, 'stroke-linejoin="round"');
    }
    if (frame.beam) red += path(dots(frame.beam), "#fff", 9.5) + path(dots(frame.beam), ranged, 6.8);
    this.groups.ranged.innerHTML = red;
  }

  tell(frame) {
    const metres = (value) => (value === null ? "–" : `${value.toFixed(2)} m`);
    const kind = frame.gated ? "gated" : frame.outcome === "accepted" ? "accepted" : "";
    const rows = [
      ["time", `${frame.t.toFixed(2)} s`, ""],
      ["mode", frame.mode, ""],
      ["range", frame.outcome, kind],
      ["measured", metres(frame.measured), ""],
      ["predicted", metres(frame.predicted), ""],
    ];
    if (this.data.hasFeatures) {
      rows.push(["SLAM features", frame.slam.length / 2, ""], ["other tracks", frame.tracks.length / 2, ""]);
      rows.push(["facets", frame.facets.length, ""]);
    }
    document.getElementById("facts").innerHTML = rows
      .map(([name, value, style]) => `<dt>${name}</dt><dd class="${style}">${value}</dd>`)
      .join("");
  }
}
