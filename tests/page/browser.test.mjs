// The page in headless Chromium: it is pulled and pressed with mouse and finger, by every method, comes back, and says what it refuses.
// Run by tools/page.sh, which sets SUPPLE_PAGE, the page's file. Screenshots and figures go next to it.

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
const DOME = [-0.01, 0.004, 0.0605]; // a point of the tissue that the camera sees, m
const METHODS = ["exact", "long", "auto"];
const WIDE = { width: 1280, height: 900 };
const NARROW = { width: 400, height: 860, hasTouch: true, isMobile: true };
let browser;
let server;
let address;

before(async () => {
    // Without a graphics processor Chromium paints on the processor.
    browser = await puppeteer.launch({
        executablePath: "/usr/bin/chromium", args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"] });
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

/** The page, running; the test fails if it complains. `tamper` runs in it before its own script. */
async function open(context, { viewport = WIDE, scheme = "light", url = address, tamper } = {}) {
    const page = await browser.newPage();
    const complaints = [];
    page.on("console", (message) => {
        // What Chromium says of painting on the processor is not about the page.
        if (["error", "warn"].includes(message.type()) && !/GPU stall|software/i.test(message.text())) complaints.push(message.text());
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
    return page;
}

const look = (page) => page.evaluate(() => ({ ...window.supple.latest, positions: Array.from(window.supple.latest.positions), pace: window.supple.pace }));
const text = (page, id) => page.$eval(`#${id}`, (element) => element.textContent);

/** Until the simulation has gone on by so many seconds, of its own time. */
async function simulate(page, seconds) {
    const end = await page.evaluate((more) => window.supple.latest.time + more, seconds);
    await page.waitForFunction((time) => window.supple.latest.time >= time, { timeout: 60_000, polling: 20 }, end);
}

/** How far the node moved, m, that is nearest to a point at rest. */
const movedAt = (page, point) => page.evaluate((at) => {
    const { rest, latest: { positions } } = window.supple;
    const apart = (values, node, other) => Math.hypot(...other.map((x, axis) => values[3 * node + axis] - x));
    let nearest = 0;
    for (let node = 1; node < rest.length / 3; node++) if (apart(rest, node, at) < apart(rest, nearest, at)) nearest = node;
    return apart(positions, nearest, Array.from(rest.subarray(3 * nearest, 3 * nearest + 3)));
}, point);

const hand = {
    mouse: (page) => ({ down: () => page.mouse.down(), move: (x, y) => page.mouse.move(x, y), up: () => page.mouse.up() }),
    finger: (page) => {
        let at;
        let touch;
        return {
            async move(x, y) {
                at = [x, y];
                if (touch) await touch.move(x, y);
            },
            async down() { touch = await page.touchscreen.touchStart(...at); },
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
        await pointer.move(from.x + x * part / 10, from.y + y * part / 10);
        await pause(20);
    }
    await simulate(page, 0.7);
    const held = { ...await look(page), moved: await movedAt(page, DOME) };
    // The panel and the numbers of one frame.
    Object.assign(held, await page.evaluate(() => ({ force: document.getElementById("force").textContent, tool: window.supple.latest.tool })));
    await pointer.up();
    await simulate(page, 2);
    return { held, free: { ...await look(page), moved: await movedAt(page, DOME) } };
}

function movedAndCameBack({ held, free }) {
    assert.ok(held.moved > 0.001, `moved by ${held.moved} m only`);
    assert.ok(held.tool.force > 0.05 && held.tool.force < 50, `a force of ${held.tool.force} N`);
    assert.equal(free.tool.force, 0);
    assert.ok(free.moved < 0.0005, `${free.moved} m from rest two seconds after it was let go`);
    assert.equal(held.refusal, null);
}

for (const method of METHODS) {
    test(`${method}: pulled and pressed, it moves; let go, it comes back`, async (context) => {
        const page = await open(context);
        await page.select("#method", method);
        for (const kind of ["pull", "press"]) {
            await page.click(`label:has(input[value=${kind}])`);
            const seen = await drag(page, "mouse", kind === "pull" ? [20, -60] : [25, 0]);
            movedAndCameBack(seen);
            assert.equal(seen.held.method, method);
            assert.equal(seen.held.force, `${seen.held.tool.force.toFixed(2)} N`);
            assert.equal(await text(page, "force"), "0.00 N");
            context.diagnostic(`${kind}: ${(1e3 * seen.held.moved).toFixed(1)} mm, ${seen.held.force}, ${(1e3 * seen.free.moved).toFixed(3)} mm left`);
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
    assert.ok(pins.length === 0 && await movedAt(page, DOME) < 0.0005);
    context.diagnostic(`pin: ${(1e3 * free.moved).toFixed(1)} mm, ${free.pins[0].force.toFixed(2)} N`);
});

/** Tissue held and moved about for some seconds: times of the frames, ms, sorted, and frames in a second. */
async function shake(page, method) {
    await page.select("#method", method);
    const from = await page.evaluate((point) => window.supple.pixel(point), DOME);
    await page.mouse.move(from.x, from.y);
    await page.mouse.down();
    await simulate(page, 0.5);
    const measured = page.evaluate(() => new Promise((done) => {
        const { latest } = window.supple;
        const begin = performance.now();
        const times = [];
        const steps = [];
        let number = latest.number;
        const look = () => {
            const { latest: now } = window.supple;
            if (now.number > number) {
                number = now.number;
                times.push(now.milliseconds);
                steps.push(now.milliseconds / now.steps);
            }
            const seconds = (performance.now() - begin) / 1000;
            if (seconds < 4) setTimeout(look, 1);
            else done({ times, steps, frames: 60 * (now.time - latest.time) / seconds, pictures: window.supple.pace?.pictures ?? 0 });
        };
        look();
    }));
    for (let part = 0; part < 100; part++) {
        await page.mouse.move(from.x + 30 * Math.sin(part / 12), from.y - 30 + 30 * Math.cos(part / 12));
        await pause(35);
    }
    const { times, steps, ...rates } = await measured;
    await page.mouse.up();
    const sorted = (values) => values.sort((a, b) => a - b);
    const at = (values, share) => values[Math.floor(share * (values.length - 1))];
    return { step: at(sorted(steps), 0.5), frame: at(sorted(times), 0.5), slow: at(times, 0.95), ...rates };
}

const figures = {};
for (const painting of [true, false]) {
    test(`time of a step and frames a second, ${painting ? "painted without a graphics processor" : "not painted"}`, async (context) => {
        // Without it nothing is drawn, as if painting took no time of the processor.
        const tamper = painting ? undefined : () => { window.requestAnimationFrame = () => 0; };
        const page = await open(context, { tamper });
        await simulate(page, 1.5); // Until all is compiled.
        for (const method of METHODS) {
            const seen = await shake(page, method);
            figures[`${method}, ${painting ? "painted" : "not painted"}`] = seen;
            context.diagnostic(`${method}: ${seen.step.toFixed(3)} ms a step; frame ${seen.frame.toFixed(1)} ms, of 20 the slowest ${seen.slow.toFixed(1)} ms; `
                + `${seen.frames.toFixed(0)} frames and ${seen.pictures.toFixed(0)} pictures a second`);
            assert.ok(seen.step > 0.005 && seen.step < 50, `${seen.step} ms a step`);
            assert.ok(seen.frames > 2 && seen.frames < 62, `${seen.frames} frames a second`);
            await simulate(page, 1);
        }
    });
}

test("time of painting", async (context) => {
    for (const [name, viewport] of [["1280", WIDE], ["400", NARROW]]) {
        const page = await open(context, { viewport });
        const times = await page.evaluate(() => Array.from({ length: 20 }, () => window.supple.paint()));
        const middle = times.sort((a, b) => a - b)[10];
        figures[`painting, ${name} wide, ms`] = middle;
        context.diagnostic(`${name} wide: ${middle.toFixed(1)} ms`);
        assert.ok(middle > 0.05 && middle < 1000);
    }
});

test("a finger pulls and presses in a narrow page, from a file without a server", async (context) => {
    const page = await open(context, { viewport: NARROW, url: pathToFileURL(file).href });
    movedAndCameBack(await drag(page, "finger", [10, -40]));
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
    const seen = await drag(page, "mouse", [20, -60]);
    assert.equal(seen.held.largest, 0);
    assert.throws(() => movedAndCameBack(seen), /moved by 0 m only/);
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
    assert.equal((await look(page)).largest, 0);
});

test("what the kernel refuses is said in its words, and a reset helps", async (context) => {
    const page = await open(context);
    await page.evaluate(() => window.supple.send({ type: "begin", kind: "press", hit: [NaN, 0, 0], direction: [0, 0, -1] }));
    await simulate(page, 0.1);
    assert.match(await text(page, "message"), /^The kernel: .*instrument/);
    movedAndCameBack(await drag(page, "mouse", [20, -60]));
    assert.equal(await text(page, "message"), "");
    await page.evaluate(() => window.supple.send({ type: "method", method: "auto", tolerance: NaN }));
    await page.waitForFunction(() => window.supple.latest.halted);
    assert.match(await text(page, "message"), /^The kernel: .*stands still: reset it/);
    assert.ok(await page.$eval("#reset", (button) => button.classList.contains("asked")));
    await page.select("#method", "exact");
    await page.click("#reset");
    await page.waitForFunction(() => !window.supple.latest.halted);
    movedAndCameBack(await drag(page, "mouse", [20, -60]));
    await page.evaluate(() => window.supple.send({ type: "method", method: "none", tolerance: 1 }));
    await page.waitForFunction(() => /cannot go on: .*no method none/.test(document.getElementById("message").textContent));
});

test("a browser without WebGL is told so", async (context) => {
    const page = await browser.newPage();
    context.after(() => page.close());
    await page.evaluateOnNewDocument(() => { HTMLCanvasElement.prototype.getContext = () => null; });
    await page.goto(address);
    await page.waitForFunction(() => /cannot go on: .*WebGL/.test(document.getElementById("message").textContent), { timeout: 30_000 });
});

/** Different colours in a part of a screenshot, counted in the browser. */
const colours = (page, png) => page.evaluate(async (base64) => {
    const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
    const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
    const context = canvas.getContext("2d");
    context.drawImage(bitmap, 0, 0);
    return new Set(new Uint32Array(context.getImageData(0, 0, bitmap.width, bitmap.height).data.buffer)).size;
}, png);

for (const scheme of ["light", "dark"]) {
    for (const [name, viewport] of [["1280", WIDE], ["400", NARROW]]) {
        test(`${scheme}, ${name} wide: the picture is not blank and nothing is cut off`, async (context) => {
            const page = await open(context, { viewport, scheme });
            // Without the legend at its lower edge.
            const box = await page.$eval("#canvas", (canvas) => canvas.getBoundingClientRect().toJSON());
            const clip = { x: box.x + 4, y: box.y + 4, width: box.width - 8, height: box.height - 80 };
            const count = async () => colours(page, await page.screenshot({ clip, encoding: "base64" }));
            if (scheme === "dark") await page.click("label:has(input[value=press])");
            const from = await page.evaluate((point) => window.supple.pixel(point), DOME);
            await page.mouse.move(from.x, from.y);
            await page.mouse.down();
            await page.mouse.move(from.x + (scheme === "dark" ? 15 : 10), from.y - (scheme === "dark" ? 0 : 40), { steps: 5 });
            await simulate(page, 0.6);
            const seen = await count();
            await page.screenshot({ path: nextToPage(`page-${name}-${scheme}.png`), fullPage: true });
            context.diagnostic(`${seen} colours`);
            assert.ok(seen > 1000, `${seen} colours`);
            await page.$eval("#canvas", (canvas) => { canvas.style.visibility = "hidden"; });
            assert.equal(await count(), 1, "a picture without the lobe passes as one");
            const [content, width] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
            assert.ok(content <= width, `${content} pixels in ${width}`);
            await page.mouse.up();
        });
    }
}

after(() => writeFileSync(nextToPage("figures.json"), JSON.stringify(figures, null, 1)));
