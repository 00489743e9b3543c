// The page: asks the kernel for a frame, shows it, hands it what the pointer does. A frame of the kernel is a sixtieth of a second; where
// it takes longer than that, time goes slower, and the page says so.

import source from "built:worker.txt";

import { Panel } from "./panel.js";
import { listen } from "./pointer.js";
import { View } from "./view.js";

const FRAME = 1000 / 60; // ms
const worker = new Worker(URL.createObjectURL(new Blob([source], { type: "text/javascript" })));
const send = (message) => worker.postMessage(message);
const panel = new Panel(send);
let view = null;
let stopped = false;
let asked = null; // when the frame was asked for that has not come yet, ms
let due = 0; // when the next one is, ms
const counts = { since: performance.now(), frames: 0, drawn: 0, simulated: 0, painting: 0 };
/** For tests and for the console. */
const supple = { latest: null, pace: null, send, pixel: (point) => view.pixel(point) };
window.supple = supple;

const answers = {
    ready({ points, triangles, milliseconds }) {
        view = new View(document.getElementById("canvas"), points, triangles);
        listen(view, () => panel.kind(), (message) => {
            if (message.type === "begin") panel.say(null);
            send(message);
        });
        document.body.classList.add("ready");
        supple.rest = points;
        supple.startMilliseconds = milliseconds;
        requestAnimationFrame(tick);
    },
    frame({ frame }) {
        asked = null;
        const largest = view.show(frame.positions, frame.tool);
        supple.latest = { ...frame, largest, number: (supple.latest?.number ?? 0) + 1 };
        panel.show(frame, largest);
        counts.frames += 1;
        counts.simulated += frame.seconds ?? 0;
        // Nothing goes on after it: every other refusal has taken the instrument away and left the body as it was.
        const halted = Boolean(frame.refusal) && frame.steps === undefined;
        if (halted) panel.say(`The kernel: ${frame.refusal.text}. The simulation stands still; reset it to go on.`, true);
    },
    failed({ text }) {
        stopped = true;
        panel.say(`The page cannot go on: ${text}. Load it again.`, true);
    },
};
worker.addEventListener("message", ({ data }) => {
    try {
        answers[data.type](data);
    } catch (error) {
        answers.failed({ text: error.message });
        throw error;
    }
});
worker.addEventListener("error", ({ message }) => answers.failed({ text: message }));

function tick(now) {
    if (stopped) return;
    requestAnimationFrame(tick);
    // Half a screen's frame early rather than late, and never more than one frame behind.
    if (asked === null && now >= due - FRAME / 4) {
        due = Math.max(due + FRAME, now);
        asked = now;
        send({ type: "frame" });
    }
    const begin = performance.now();
    if (view.draw()) {
        counts.drawn += 1;
        counts.painting += performance.now() - begin;
    }
    const seconds = (now - counts.since) / 1000;
    if (seconds >= 1) {
        supple.pace = {
            frames: counts.frames / seconds, realTime: counts.simulated / seconds, painting: counts.painting / Math.max(counts.drawn, 1) };
        panel.pace(supple.pace);
        Object.assign(counts, { since: now, frames: 0, drawn: 0, simulated: 0, painting: 0 });
    }
}
