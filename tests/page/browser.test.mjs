// The page in headless Chromium: it is pulled and pressed with mouse, finger and keys, by every method, comes back,
// shows the error at the tumour, and says what it refuses. Run by tools/page.sh, which sets SUPPLE_PAGE, the page's
// file. Screenshots and figures go next to it.

import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { after, before, test } from "node:test";
import { setTimeout as pause } from "node:timers/promises";
import { pathToFileURL } from "node:url";

const puppeteer = createRequire(new URL("../../examples/page/package.json", import.meta.url))("puppeteer-core");

const file = process.env.SUPPLE_PAGE;
const nextToPage = (name) => join(dirname(file), name);
const DOME = [0.0266, -0.0144, 0.0289]; // a point of the tissue as it hangs, above the tumour, that the camera sees, m
const METHODS = ["exact", "long", "auto"];
const WIDE = { width: 1280, height: 900 };
const NARROW = { width: 390, height: 844, hasTouch: true, isMobile: true };
let browser;
let server;
let address;

before(async () => {
    // Without a graphics processor Chromium paints on the processor.
    browser = await puppeteer.launch({
        executablePath: "/usr/bin/chromium",
        args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
    });
    server = createServer((request, response) => {
        response.setHeader("Content-Type", "text/html");
        response.end(readFileSync(file));
    }).listen(0, "127.0.0.1");
    await new Promise((done) => server.once("listening", done));
    address = `http://127.0.0.1:${server.address().port}/`;
});
after(async () => {
    await browser?.close();
    server?.close();
});

/**
 * The page, running; the test fails if it complains. `tamper` runs in it before its own script. Unless it breathes it
 * stands still.
 */
async function open(context, { viewport = WIDE, scheme = "light", url = address, breathes = false, tamper } = {}) {
    const page = await browser.newPage();
    const complaints = [];
    page.on("console", (message) => {
        // What Chromium says of painting on the processor is not about the page.
        if (["error", "warn"].includes(message.type()) && !/GPU stall|software/i.test(message.text()))
            complaints.push(message.text());
    });
    page.on("pageerror", (error) => complaints.push(String(error)));
    context.after(async () => {
        await page.close();
        assert.deepEqual(complaints, []);
    });
    await page.setViewport(viewport);
    await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
    if (tamper) await page.evaluateOnNewDocument(tamper);
    await page.goto(url);
    await page.waitForFunction(() => window.supple?.latest?.number > 3, { timeout: 60_000, polling: 20 });
    if (!breathes) {
        await page.$eval("#breathes", (box) => box.click());
        await simulate(page, 0.5);
    }
    return page;
}

/** In millimetres, for people. */
const mm = (metres, digits = 1) => `${(1e3 * metres).toFixed(digits)} mm`;
const look = (page) =>
    page.evaluate(() => ({
        ...window.supple.latest,
        positions: Array.from(window.supple.latest.positions),
        pace: window.supple.pace,
    }));
const text = (page, id) => page.$eval(`#${id}`, (element) => element.textContent);

/** Until the simulation has gone on by so many seconds, of its own time. */
async function simulate(page, seconds) {
    const end = await page.evaluate((more) => window.supple.latest.time + more, seconds);
    await page.waitForFunction((time) => window.supple.latest.time >= time, { timeout: 60_000, polling: 20 }, end);
}

/** How far the node moved, m, that is nearest to a point at the start. */
const movedAt = (page, point) =>
    page.evaluate((at) => {
        const {
            start,
            latest: { positions },
        } = window.supple;
        const apart = (values, node, other) => Math.hypot(...other.map((x, axis) => values[3 * node + axis] - x));
        let nearest = 0;
        for (let node = 1; node < start.length / 3; node++)
            if (apart(start, node, at) < apart(start, nearest, at)) nearest = node;
        return apart(positions, nearest, Array.from(start.subarray(3 * nearest, 3 * nearest + 3)));
    }, point);

const hand = {
    mouse: (page) => ({
        down: () => page.mouse.down(),
        move: (x, y) => page.mouse.move(x, y),
        up: () => page.mouse.up(),
    }),
    finger: (page) => {
        let at;
        let touch;
        return {
            async move(x, y) {
                at = [x, y];
                if (touch) await touch.move(x, y);
            },
            async down() {
                touch = await page.touchscreen.touchStart(...at);
            },
            up: () => touch.end(),
        };
    },
};

/** Drags from a point of the tissue by so many pixels, holds still, lets go; what was seen. */
async function drag(page, device, [x, y]) {
    const pointer = hand[device](page);
    const from = await page.evaluate((point) => window.supple.pixel(point), DOME);
    await pointer.move(from.x, from.y);
    await pointer.down();
    for (let part = 1; part <= 10; part++) {
        await pointer.move(from.x + (x * part) / 10, from.y + (y * part) / 10);
        await pause(20);
    }
    await simulate(page, 0.7);
    const held = { ...(await look(page)), moved: await movedAt(page, DOME) };
    // The panel and the numbers of one frame.
    Object.assign(
        held,
        await page.evaluate(() => ({
            force: document.getElementById("force").textContent,
            tool: window.supple.latest.tool,
        })),
    );
    await pointer.up();
    await simulate(page, 2);
    return { held, free: { ...(await look(page)), moved: await movedAt(page, DOME) } };
}

function movedAndCameBack({ held, free }) {
    assert.ok(held.moved > 0.001, `moved by ${held.moved} m only`);
    assert.ok(held.tool.force > 0.05 && held.tool.force < 50, `a force of ${held.tool.force} N`);
    assert.equal(free.tool.force, 0);
    assert.ok(free.moved < 0.0005, `${free.moved} m from rest two seconds after it was let go`);
    assert.equal(held.refusal, null);
}

/** What the panel says of the tumour is what the kernel computed, for the frame that it shows. */
async function shownAtTheTumour(page, method) {
    const { error, errorIs, moved, latest } = await page.evaluate(() => ({
        error: document.getElementById("error").textContent,
        errorIs: document.getElementById("error-is").textContent,
        moved: document.getElementById("moved").textContent,
        latest: { ...window.supple.latest, positions: null, inside: null },
    }));
    assert.equal(error, `${(1e3 * latest.exact.error).toFixed(3)} mm`);
    assert.equal(moved, `${(1e3 * latest.moved).toFixed(1)} mm`);
    if (method === "exact") assert.equal(errorIs, "these are exact steps");
    else assert.equal(errorIs, `at most ${(1e3 * latest.worst).toFixed(3)} mm so far`);
    // Longer steps are off by something while they are pulled, and by little.
    if (method !== "exact") assert.ok(latest.worst > 1e-6 && latest.worst < 0.005, `${latest.worst} m`);
}

for (const method of METHODS) {
    test(`${method}: pulled and pressed, it moves; let go, it comes back`, async (context) => {
        const page = await open(context);
        await page.select("#method", method);
        for (const kind of ["pull", "press"]) {
            await page.click(`label:has(input[value=${kind}])`);
            const seen = await drag(page, "mouse", kind === "pull" ? [10, -25] : [25, 0]);
            movedAndCameBack(seen);
            assert.equal(seen.held.method, method);
            assert.equal(seen.held.force, `${seen.held.tool.force.toFixed(2)} N`);
            assert.equal(await text(page, "force"), "0.00 N");
            await shownAtTheTumour(page, method);
            context.diagnostic(`${kind}: ${mm(seen.held.moved)}, ${seen.held.force}, ${mm(seen.free.moved, 3)} left`);
        }
    });
}

test("a pin stays where it was dragged, and goes when it is touched again", async (context) => {
    const page = await open(context);
    await page.click("label:has(input[value=pin])");
    const { held, free } = await drag(page, "mouse", [0, -60]);
    assert.equal(free.pins.length, 1);
    assert.ok(held.moved > 0.002 && free.moved > 0.002, `${held.moved} m and ${free.moved} m`);
    assert.ok(free.pins[0].force > 0.01 && free.pins[0].force < 5, `a force of ${free.pins[0].force} N`);
    assert.equal(await text(page, "contacts"), "1 pin");
    await page.screenshot({ path: nextToPage("pin.png") });
    const at = await page.evaluate(() => window.supple.pixel(window.supple.latest.pins[0].position));
    await page.mouse.click(at.x, at.y);
    await simulate(page, 2);
    const { pins } = await look(page);
    assert.ok(pins.length === 0 && (await movedAt(page, DOME)) < 0.0005);
    context.diagnostic(`pin: ${(1e3 * free.moved).toFixed(1)} mm, ${free.pins[0].force.toFixed(2)} N`);
});

/** Tissue held and moved about for some seconds: times of the frames, ms, sorted, and frames in a second. */
async function shake(page, method) {
    await page.select("#method", method);
    const from = await page.evaluate((point) => window.supple.pixel(point), DOME);
    await page.mouse.move(from.x, from.y);
    await page.mouse.down();
    await simulate(page, 0.5);
    const measured = page.evaluate(
        () =>
            new Promise((done) => {
                const { latest } = window.supple;
                const begin = performance.now();
                const times = [];
                const steps = [];
                const exact = [];
                let number = latest.number;
                const look = () => {
                    const { latest: now } = window.supple;
                    if (now.number > number) {
                        number = now.number;
                        times.push(now.milliseconds);
                        steps.push(now.milliseconds / now.steps);
                        if (now.exact) exact.push(now.exact.milliseconds);
                    }
                    const seconds = (performance.now() - begin) / 1000;
                    if (seconds < 2) setTimeout(look, 1);
                    else
                        done({
                            times,
                            steps,
                            exact,
                            held: now.tool.held,
                            frames: (60 * (now.time - latest.time)) / seconds,
                            pictures: window.supple.pace.pictures,
                        });
                };
                look();
            }),
    );
    for (let part = 0; part < 50; part++) {
        await page.mouse.move(from.x + 12 * Math.sin(part / 12), from.y - 12 + 12 * Math.cos(part / 12));
        await pause(35);
    }
    const { times, steps, exact, held, ...rates } = await measured;
    await page.mouse.up();
    assert.ok(held > 0, "the forceps slipped");
    const at = (values, share) => values.sort((a, b) => a - b)[Math.floor(share * (values.length - 1))];
    return { step: at(steps, 0.5), frame: at(times, 0.5), slow: at(times, 0.95), exact: at(exact, 0.5), ...rates };
}

const figures = {};
for (const compares of [true, false]) {
    test(`time of a step and frames a second, ${compares ? "exact steps go along" : "alone"}`, async (context) => {
        const page = await open(context);
        if (!compares) await page.$eval("#compares", (box) => box.click());
        await simulate(page, 1.5); // Until all is compiled.
        for (const method of METHODS) {
            const seen = await shake(page, method);
            figures[`${method}, ${compares ? "compared" : "alone"}`] = seen;
            context.diagnostic(
                `${method}: ${seen.step.toFixed(3)} ms a step; frame ${seen.frame.toFixed(1)} ms, ` +
                    `of 20 the slowest ${seen.slow.toFixed(1)} ms; exact ${seen.exact?.toFixed(1) ?? "none"} ms; ` +
                    `${seen.frames.toFixed(0)} frames and ${seen.pictures.toFixed(0)} pictures a second`,
            );
            assert.ok(seen.step > 0.005 && seen.step < 50, `${seen.step} ms a step`);
            assert.ok(seen.frames > 2 && seen.frames < 62, `${seen.frames} frames a second`);
            assert.equal(seen.exact === undefined, !compares);
            await simulate(page, 1);
        }
    });
}

test("the pace is the one that is asked for, or what the processor can do", async (context) => {
    const page = await open(context);
    await page.select("#wanted-pace", "0.25");
    await simulate(page, 0.7);
    const { pace } = await look(page);
    assert.ok(pace.realTime > 0.05 && pace.realTime < 0.3, `${pace.realTime} times real time`);
    assert.equal(await text(page, "pace"), `${pace.realTime.toFixed(2)} × real time`);
});

test("time of the start and of painting", async (context) => {
    for (const [name, viewport] of [
        ["1280", WIDE],
        ["390", NARROW],
    ]) {
        const page = await open(context, { viewport });
        const times = await page.evaluate(() => Array.from({ length: 20 }, () => window.supple.paint()));
        const middle = times.sort((a, b) => a - b)[10];
        figures[`painting, ${name} wide, ms`] = middle;
        const start = await page.evaluate(() => window.supple.startMilliseconds);
        figures[`start, ${name} wide, ms`] = start;
        context.diagnostic(`${name} wide: painting ${middle.toFixed(1)} ms, start ${start.toFixed(0)} ms`);
        assert.ok(middle > 0.05 && middle < 1000);
    }
});

test("a finger pulls and presses in a narrow page, from a file without a server", async (context) => {
    const page = await open(context, { viewport: NARROW, url: pathToFileURL(file).href });
    movedAndCameBack(await drag(page, "finger", [5, -20]));
    await page.tap("label:has(input[value=press])");
    movedAndCameBack(await drag(page, "finger", [8, 0]));
});

test("a body that does not move fails", async (context) => {
    const page = await open(context, {
        tamper: () => {
            const post = Worker.prototype.postMessage;
            Worker.prototype.postMessage = function (message, ...rest) {
                if (message.type !== "begin") post.call(this, message, ...rest);
            };
        },
    });
    const seen = await drag(page, "mouse", [10, -25]);
    assert.throws(() => movedAndCameBack(seen), /moved by .* m only/);
});

test("a drag of the background turns the view and leaves the tissue", async (context) => {
    const page = await open(context);
    const pixel = () => page.evaluate((point) => window.supple.pixel(point), DOME);
    const before = await pixel();
    const { x, y } = await page.$eval("#canvas", (canvas) => canvas.getBoundingClientRect().toJSON());
    await page.mouse.move(x + 40, y + 40);
    await page.mouse.down();
    await page.mouse.move(x + 160, y + 60, { steps: 5 });
    await page.mouse.up();
    const turned = await pixel();
    assert.ok(Math.hypot(turned.x - before.x, turned.y - before.y) > 10);
    const { tool, moved } = await look(page);
    assert.ok(tool === null && moved < 1e-5, `${moved} m`);
});

test("keys do what a pointer does: take hold, lead, let go, turn, come nearer", async (context) => {
    const page = await open(context);
    await page.keyboard.press("Tab");
    assert.equal(await page.evaluate(() => document.activeElement.id), "canvas");
    assert.equal(await page.$eval("#cross", (cross) => getComputedStyle(cross).visibility), "visible");
    const press = async (key, times = 1) => {
        for (let time = 0; time < times; time++) await page.keyboard.press(key);
    };
    await press("Enter");
    await press("ArrowUp", 4);
    await simulate(page, 0.7);
    const held = await look(page);
    assert.ok(
        held.tool.held > 0 && held.tool.force > 0.05 && held.moved > 0.0005,
        JSON.stringify([held.tool, held.moved]),
    );
    await page.screenshot({ path: nextToPage("keys.png") });
    await press("Escape");
    await simulate(page, 2);
    const free = await look(page);
    assert.ok(free.tool.force === 0 && free.moved < 0.0005, `${free.moved} m`);
    // A pin, chosen by keys as well, stays where it is led and goes when it is taken twice.
    await press("Tab");
    await press("ArrowRight", 2);
    assert.equal(await page.$eval("input[name=tool]:checked", (input) => input.value), "pin");
    await page.keyboard.down("Shift");
    await press("Tab");
    await page.keyboard.up("Shift");
    await press(" ");
    await press("ArrowUp", 3);
    await press(" ");
    await simulate(page, 0.5);
    assert.equal((await look(page)).pins.length, 1);
    await press("Enter", 2);
    await simulate(page, 0.2);
    assert.equal((await look(page)).pins.length, 0);
    await press("ArrowLeft", 200);
    await press("Enter");
    assert.match(await text(page, "message"), /no tissue under the cross/);
    const pixel = () => page.evaluate((point) => window.supple.pixel(point), DOME);
    const before = await pixel();
    await page.keyboard.down("Shift");
    await press("ArrowLeft", 3);
    await page.keyboard.up("Shift");
    const turned = await pixel();
    assert.ok(Math.hypot(turned.x - before.x, turned.y - before.y) > 10);
    await press("+", 3);
    const nearer = await pixel();
    assert.ok(Math.hypot(nearer.x - turned.x, nearer.y - turned.y) > 5);
});

test("each choice has a name and is large enough for a finger", async (context) => {
    const page = await open(context, { viewport: NARROW });
    const choices = await page.$$eval("button, select, input", (all) =>
        all.map((one) => {
            // A finger hits the label as well.
            const { width, height } = (one.closest("label") ?? one).getBoundingClientRect();
            return {
                id: one.id || one.value,
                name: one.labels?.[0]?.textContent.trim() ?? one.textContent.trim(),
                width,
                height,
            };
        }),
    );
    assert.ok(choices.length > 8);
    for (const { id, name, width, height } of choices)
        assert.ok(
            name && width >= 44 && height >= (id === "tolerance" ? 28 : 44),
            `${id}: ${name}, ${width} x ${height}`,
        );
});

test("what the kernel refuses is said in its words, and a reset helps", async (context) => {
    const page = await open(context);
    await page.evaluate(() =>
        window.supple.send({ type: "begin", kind: "press", hit: [NaN, 0, 0], direction: [0, 0, -1] }),
    );
    await simulate(page, 0.1);
    assert.match(await text(page, "message"), /^The kernel: .*instrument/);
    movedAndCameBack(await drag(page, "mouse", [10, -25]));
    assert.equal(await text(page, "message"), "");
    await page.evaluate(() => window.supple.send({ type: "method", method: "auto", tolerance: NaN }));
    await page.waitForFunction(() => window.supple.latest.halted);
    assert.match(await text(page, "message"), /^The kernel: .*stands still: reset it/);
    assert.ok(await page.$eval("#reset", (button) => button.classList.contains("asked")));
    await page.select("#method", "exact");
    await page.click("#reset");
    await page.waitForFunction(() => !window.supple.latest.halted);
    movedAndCameBack(await drag(page, "mouse", [10, -25]));
    await page.evaluate(() => window.supple.send({ type: "method", method: "none", tolerance: 1 }));
    await page.waitForFunction(() =>
        /cannot go on: .*no method none/.test(document.getElementById("message").textContent),
    );
});

test("a browser without WebGL is told so", async (context) => {
    const page = await browser.newPage();
    context.after(() => page.close());
    await page.evaluateOnNewDocument(() => {
        HTMLCanvasElement.prototype.getContext = () => null;
    });
    await page.goto(address);
    await page.waitForFunction(() => /cannot go on: .*WebGL/.test(document.getElementById("message").textContent), {
        timeout: 30_000,
    });
});

/**
 * Of a part of a screenshot: how many colours, and how many pixels, and where in the mean, of the tumour (red) and of
 * the vessels (blue).
 */
const seenIn = (page, png) =>
    page.evaluate(async (base64) => {
        const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
        const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
        const context = canvas.getContext("2d");
        context.drawImage(bitmap, 0, 0);
        const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
        const tumour = { pixels: 0, height: 0 };
        let vessels = 0;
        for (let at = 0; at < data.length; at += 4) {
            const [red, green, blue] = data.subarray(at, at + 3);
            if (red > 1.8 * green && red > 1.8 * blue && red > 90) {
                tumour.pixels += 1;
                tumour.height -= Math.floor(at / 4 / bitmap.width);
            }
            if (blue > 1.25 * red && blue > 70) vessels += 1;
        }
        return {
            colours: new Set(new Uint32Array(data.buffer)).size,
            tumour: tumour.pixels,
            height: tumour.height / tumour.pixels,
            vessels,
        };
    }, png);

for (const scheme of ["light", "dark"]) {
    for (const [name, viewport] of [
        ["1280", WIDE],
        ["390", NARROW],
    ]) {
        test(`${scheme}, ${name} wide: tumour and vessels go with the tissue, nothing is cut off`, async (context) => {
            const page = await open(context, { viewport, scheme });
            // Without the legend at its lower edge.
            const box = await page.$eval("#canvas", (canvas) => canvas.getBoundingClientRect().toJSON());
            const clip = { x: box.x + 4, y: box.y + 4, width: box.width - 8, height: box.height - 80 };
            const seen = async () => seenIn(page, await page.screenshot({ clip, encoding: "base64" }));
            const before = await seen();
            if (scheme === "dark") await page.click("label:has(input[value=press])");
            const from = await page.evaluate((point) => window.supple.pixel(point), DOME);
            await page.mouse.move(from.x, from.y);
            await page.mouse.down();
            await page.mouse.move(from.x + (scheme === "dark" ? 15 : 5), from.y - (scheme === "dark" ? 0 : 25), {
                steps: 5,
            });
            await simulate(page, 0.6);
            const after = await seen();
            await page.screenshot({ path: nextToPage(`page-${name}-${scheme}.png`), fullPage: true });
            context.diagnostic(JSON.stringify([before, after]));
            assert.ok(after.colours > 300 && after.tumour > 60 && after.vessels > 60, JSON.stringify(after));
            if (scheme === "light") assert.ok(after.height > before.height + 2, `${before.height} and ${after.height}`);
            await page.$eval("#canvas", (canvas) => {
                canvas.style.visibility = "hidden";
            });
            const { colours, tumour, vessels } = await seen();
            assert.deepEqual([colours, tumour, vessels], [1, 0, 0], "a picture without the liver passes as one");
            const [content, width] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
            assert.ok(content <= width, `${content} pixels in ${width}`);
            await page.mouse.up();
        });
    }
}

after(() => writeFileSync(nextToPage("figures.json"), JSON.stringify(figures, null, 1)));
