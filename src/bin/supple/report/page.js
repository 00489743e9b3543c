// Draws the figures of a report with Plotly when they come into view, in the colours of the page. A browser has room for some 16 WebGL
// contexts, so of bodies that leave the view a still picture is kept.
"use strict";

const dark = matchMedia("(prefers-color-scheme: dark)");
const narrow = matchMedia("(max-width: 640px)");
const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function axis() {
    return { exponentformat: "power", gridcolor: style("--line"), zerolinecolor: style("--line"), linecolor: style("--faint"), ticks: "outside", tickcolor: style("--line"), automargin: true };
}

/** What depends on the page and not on the data. */
function theme() {
    return {
        layout: {
            paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: style("--ink"), family: "system-ui, DejaVu Sans, sans-serif", size: 12 },
            xaxis: axis(), yaxis: axis(), hoverlabel: { bgcolor: style("--card"), bordercolor: style("--line"), font: { color: style("--ink") } },
            legend: { bgcolor: "rgba(0,0,0,0)" },
        },
    };
}

function layoutOf(panel) {
    const layout = { ...panel.plot.layout, template: theme(), autosize: true };
    if (layout.scene) {
        return { ...layout, margin: { l: 0, r: 0, t: 0, b: 0 } };
    }
    // On a narrow page the legend goes below the plot.
    return narrow.matches
        ? { ...layout, margin: { l: 8, r: 8, t: 8, b: 8 }, legend: { orientation: "h", y: -0.25, font: { size: 10 } } }
        : { ...layout, margin: { l: 8, r: 8, t: 8, b: 8 } };
}

const shown = new Map(); // panels that are drawn, by their elements
const MOST_BODIES = 12;
const isBody = (panel) => "scene" in panel.plot.layout;

async function draw(element) {
    const panel = element.panel();
    const isNew = !shown.delete(element);
    shown.set(element, panel); // as the latest
    await Plotly.react(element, panel.plot.data, layoutOf(panel), { responsive: true, displayModeBar: false });
    element.style.backgroundImage = "";
    element.dataset.drawn = panel.name;
    if (isNew && element.siblings) turnTogether(element);
    const bodies = [...shown].filter(([, panel]) => isBody(panel));
    if (bodies.length > MOST_BODIES) freeze(bodies[0][0]);
}

/** Leaves a still picture of a body, and gives its WebGL context back, which else waits for the garbage collector. */
function freeze(element) {
    const scene = element._fullLayout.scene._scene;
    const { gl } = scene.glplot;
    element.style.backgroundImage = `url(${scene.toImage("png")})`;
    shown.delete(element);
    Plotly.purge(element);
    gl.getExtension("WEBGL_lose_context")?.loseContext();
}

/** The other bodies of its figure turn with the one that the mouse turns. */
function turnTogether(element) {
    const { siblings } = element;
    const follow = async (change) => {
        if (!change["scene.camera"] || siblings.leader !== element) return;
        siblings.camera = change["scene.camera"];
        if (siblings.turning) return;
        siblings.turning = true;
        while (siblings.camera) {
            const camera = siblings.camera;
            siblings.camera = null;
            const others = siblings.filter((other) => other !== element && shown.has(other));
            await Promise.all(others.map((other) => Plotly.relayout(other, { "scene.camera": camera })));
        }
        siblings.turning = false;
    };
    element.on("plotly_relayouting", follow);
    element.on("plotly_relayout", follow);
}

// One plot is drawn after the other, in the order in which they come into view.
let work = Promise.resolve();
function attend(element) {
    work = work.then(async () => {
        if (element.inView && !shown.has(element)) await draw(element);
        if (!element.inView && shown.has(element) && isBody(element.panel())) freeze(element);
    });
}

const observer = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
        target.inView = isIntersecting;
        attend(target);
    }
}, { rootMargin: "60px" });

function element(parent, tag, properties = {}) {
    const made = Object.assign(document.createElement(tag), properties);
    parent.append(made);
    return made;
}

/** One plot, and above it what it may show. */
function choice(parent, panels) {
    const chosen = panels.length > 1 ? element(parent, "select", { ariaLabel: "which to show" }) : null;
    for (const { name } of panels) if (chosen) element(chosen, "option", { textContent: name });
    const plot = element(parent, "div", { className: "plot", panel: () => panels[chosen?.selectedIndex ?? 0] });
    chosen?.addEventListener("change", () => { work = work.then(() => draw(plot)); });
    observer.observe(plot);
}

function grid(parent, panels) {
    const siblings = panels.map((panel) => {
        const cell = element(parent, "div");
        element(cell, "h3", { textContent: panel.name });
        return element(cell, "div", { className: "plot", panel: () => panel });
    });
    for (const sibling of siblings) {
        sibling.siblings = siblings;
        for (const kind of ["pointerdown", "wheel"]) {
            sibling.addEventListener(kind, () => { siblings.leader = sibling; }, { capture: true, passive: true });
        }
        observer.observe(sibling);
    }
    // Those of which there is only a picture.
    parent.addEventListener("pointerenter", () => siblings.forEach(attend));
}

/** Places of points in mm, by axis. */
function places(base64) {
    const numbers = new Int16Array(Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0)).buffer);
    return [0, 1, 2].map((axis) => Float32Array.from({ length: numbers.length / 3 }, (_, point) => numbers[3 * point + axis] / 100));
}

/** How far each point has moved, less what all have in the mean. */
function fromMean(now, first) {
    const moved = now.map((along, axis) => along.map((at, point) => at - first[axis][point]));
    const mean = moved.map((along) => along.reduce((sum, one) => sum + one, 0) / along.length);
    return moved[0].map((_, point) => Math.hypot(...moved.map((along, axis) => along[point] - mean[axis])));
}

/** Moves a body to a frame; colours that stand for its way are those of the frame. */
async function show(plot, frame) {
    const { data, motion } = plot.panel().plot;
    const change = { x: [], y: [], z: [], intensity: [] };
    for (const [trace, frames] of motion.points) {
        const [x, y, z] = places(frames[frame]);
        change.x.push(x); change.y.push(y); change.z.push(z);
        change.intensity.push(data[trace].intensity ? fromMean([x, y, z], (frames.first ??= places(frames[0]))) : undefined);
    }
    await Plotly.restyle(plot, change, motion.points.map(([trace]) => trace));
}

/** A button and a slider for bodies in motion; all of a figure move together. */
function player(after, plots, times) {
    const bar = document.createElement("div");
    bar.className = "player";
    after.after(bar);
    const button = element(bar, "button", { textContent: "Play", type: "button" });
    const slider = element(bar, "input", { type: "range", min: 0, max: times.length - 1, value: times.length - 1, ariaLabel: "time" });
    const label = element(bar, "output");
    let playing = false;
    const go = async (frame) => {
        slider.value = frame;
        label.textContent = `${times[frame].toFixed(2)} s`;
        await Promise.all(plots.filter((plot) => shown.has(plot)).map((plot) => show(plot, frame)));
    };
    label.textContent = `${times[times.length - 1].toFixed(2)} s`;
    slider.addEventListener("input", () => { playing = false; button.textContent = "Play"; work = work.then(() => go(+slider.value)); });
    button.addEventListener("click", async () => {
        playing = !playing;
        button.textContent = playing ? "Pause" : "Play";
        let frame = +slider.value === times.length - 1 ? 0 : +slider.value;
        while (playing && frame < times.length) {
            const begin = performance.now();
            await go(frame);
            frame += 1;
            await new Promise((next) => setTimeout(next, Math.max(0, 40 - (performance.now() - begin))));
        }
        playing = false;
        button.textContent = "Play";
    });
}

for (const source of document.querySelectorAll("figure > script")) {
    const { panels, columns, scale } = JSON.parse(source.textContent);
    const parent = document.createElement("div");
    parent.className = columns ? "panels grid" : "panels";
    parent.style.setProperty("--columns", columns ?? 1);
    source.after(parent);
    if (scale) {
        const bar = element(source.parentElement, "div", { className: "scale" });
        bar.append("0", document.createElement("i"), `${scale.most} ${scale.unit}`);
        parent.after(bar);
    }
    (columns ? grid : choice)(parent, panels);
    const motion = panels[0]?.plot.motion;
    if (motion) player(parent, [...parent.querySelectorAll(".plot")], motion.times);
}

for (const time of document.querySelectorAll("time")) {
    const date = new Date(1000 * time.dataset.seconds);
    time.dateTime = date.toISOString();
    time.textContent = date.toLocaleString();
}

for (const query of [dark, narrow]) {
    query.addEventListener("change", () => {
        for (const element of shown.keys()) work = work.then(() => draw(element));
    });
}
