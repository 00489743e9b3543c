// The page: asks the kernel for a frame, shows it, hands it what pointer and keys do. A frame of the kernel is a
// sixtieth of a second; where it takes longer than that, time goes slower, and the page says so.

import source from "built:worker.txt";

import { Hand } from "./hand.js";
import { listenToKeys } from "./keys.js";
import { Panel } from "./panel.js";
import { listenToPointer } from "./pointer.js";
import { View } from "./view.js";

const FRAME = 1000 / 60; // ms
const worker = new Worker(URL.createObjectURL(new Blob([source], { type: "text/javascript" })));
const send = (message) => worker.postMessage(message);
const panel = new Panel(send);
let view = null;
let stopped = false;
let due = 0; // when the next frame is, ms
const counts = { since: 0, drawn: 0, simulated: 0 };
/** For tests and for the console. */
const supple = { latest: null, pace: null, send, pixel: (point) => view.pixel(point), paint: () => view.paint() };
window.supple = supple;

const answers = {
    ready({ liver, milliseconds }) {
        const canvas = document.getElementById("canvas");
        view = new View(canvas, liver);
        const hand = new Hand(
            view,
            () => panel.kind(),
            (message) => {
                if (message.type === "begin") panel.say(null);
                send(message);
            },
        );
        listenToPointer(canvas, hand, view);
        listenToKeys(canvas, document.getElementById("cross"), hand, view, (text) => panel.say(text));
        panel.begin(liver);
        document.body.classList.add("ready");
        supple.start = liver.points;
        supple.startMilliseconds = milliseconds;
        counts.since = performance.now();
        requestAnimationFrame(tick);
        ask();
    },
    frame({ frame }) {
        view.show(frame);
        supple.latest = { ...frame, number: (supple.latest?.number ?? 0) + 1 };
        panel.show(frame);
        counts.simulated += frame.seconds ?? 0;
        ask();
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

/** Asks for the next frame when it is due: not by what is painted, which may be slower. */
function ask() {
    if (stopped) return;
    if (document.hidden) {
        document.addEventListener("visibilitychange", ask, { once: true });
        return;
    }
    const now = performance.now();
    const each = FRAME / panel.wantedPace();
    // What is missed by more than a few frames is not made up for.
    due = Math.max(due + each, now - 3 * each);
    setTimeout(() => send({ type: "frame" }), Math.max(0, due - now));
}

function tick(now) {
    if (stopped) return;
    requestAnimationFrame(tick);
    if (view.draw()) counts.drawn += 1;
    const seconds = (now - counts.since) / 1000;
    if (seconds >= 1) {
        supple.pace = { pictures: counts.drawn / seconds, realTime: counts.simulated / seconds };
        panel.pace(supple.pace);
        Object.assign(counts, { since: now, drawn: 0, simulated: 0 });
    }
}
