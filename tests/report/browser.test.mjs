// Reports in headless Chromium, from a file and without a network: every figure is drawn and not blank, wide and narrow, light and dark,
// bodies turn together, choices choose. Run by tools/report.sh, which sets SUPPLE_REPORTS, the files. Screenshots go next to each.

import assert from "node:assert/strict";
import { createRequire } from "node:module";
import { basename, dirname, join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";

const puppeteer = createRequire(new URL("../../examples/page/package.json", import.meta.url))("puppeteer-core");

const files = process.env.SUPPLE_REPORTS.split(" ");
const WIDE = { width: 1280, height: 900 };
const NARROW = { width: 400, height: 860, hasTouch: true, isMobile: true };
let browser;

before(async () => {
    // Without a graphics processor Chromium paints on the processor.
    browser = await puppeteer.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"] });
});
after(() => browser?.close());

/** A report; the test fails if it complains or asks for anything but itself. */
async function open(context, file, viewport, scheme) {
    const page = await browser.newPage();
    const address = pathToFileURL(file).href;
    const complaints = [];
    page.on("console", (message) => {
        // What Chromium says of painting on the processor, and its advice on a canvas of Plotly's, are not about the page.
        if (["error", "warn"].includes(message.type()) && !/GPU stall|software|willReadFrequently/i.test(message.text())) complaints.push(message.text());
    });
    page.on("pageerror", (error) => complaints.push(String(error)));
    page.on("request", (request) => {
        if (request.url() !== address && !/^(data|blob):/.test(request.url())) complaints.push(`asks for ${request.url()}`);
    });
    context.after(async () => {
        await page.close();
        assert.deepEqual(complaints, []);
    });
    await page.setViewport(viewport);
    await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
    await page.goto(address);
    return page;
}

/** Scrolls to a plot and waits until it is drawn. */
async function show(plot) {
    await plot.evaluate((element) => scrollTo(0, element.getBoundingClientRect().top + scrollY - innerHeight / 3));
    await plot.page.waitForFunction((element) => element.dataset.drawn, { timeout: 30_000, polling: 50 }, plot.handle);
}

async function plots(page, within = page) {
    const handles = await within.$$(".plot");
    return handles.map((handle) => ({ page, handle, evaluate: (...rest) => handle.evaluate(...rest) }));
}

/** Colours in a picture of a plot, and the share of the most frequent one. */
async function colours(page, handle) {
    const picture = await handle.screenshot({ encoding: "base64" });
    return page.evaluate(async (base64) => {
        const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
        const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
        const context = canvas.getContext("2d");
        context.drawImage(bitmap, 0, 0);
        const counts = new Map();
        for (const pixel of new Uint32Array(context.getImageData(0, 0, bitmap.width, bitmap.height).data.buffer)) {
            counts.set(pixel, (counts.get(pixel) ?? 0) + 1);
        }
        return { colours: counts.size, most: Math.max(...counts.values()) / (bitmap.width * bitmap.height) };
    }, picture);
}

const VIEWS = [["wide, light", WIDE, "light"], ["narrow, dark", NARROW, "dark"], ["wide, dark", WIDE, "dark"], ["narrow, light", NARROW, "light"]];
for (const [index, file] of files.entries()) {
    const name = basename(dirname(file));
    // All views of the first, of the others those that differ in both.
    for (const [words, viewport, scheme] of VIEWS.slice(0, index === 0 ? 4 : 2)) {
        test(`${name}, ${words}: all figures are drawn, nothing overflows, nothing is asked for`, async (context) => {
            const page = await open(context, file, viewport, scheme);
            const all = await plots(page);
            assert.ok(all.length > 0);
            for (const [index, plot] of all.entries()) {
                await show(plot);
                const seen = await colours(page, plot.handle);
                const drawn = await plot.evaluate((element) => element.dataset.drawn);
                // A curve is thin; a body covers more.
                assert.ok(seen.colours > 20 && seen.most < 0.995, `figure ${index}, ${drawn}: ${seen.colours} colours, ${seen.most} of it alike`);
            }
            // A telephone shrinks what is too wide, and tells another width of its own.
            const wanted = await page.evaluate(() => document.documentElement.scrollWidth);
            assert.ok(wanted <= viewport.width, `${wanted} pixels on a screen of ${viewport.width}`);
            const [ink, paper] = await page.evaluate(() => [getComputedStyle(document.body).color, getComputedStyle(document.body).backgroundColor].map((colour) => Number(colour.match(/\d+/)[0])));
            assert.ok(scheme === "dark" ? ink > 200 && paper < 50 : ink < 50 && paper > 200, `ink ${ink} on paper ${paper}`);
            await page.screenshot({ path: join(dirname(file), `report-${viewport.width}-${scheme}.png`), fullPage: true });
            context.diagnostic(`${all.length} figures, ${await page.evaluate(() => document.documentElement.scrollHeight)} pixels high`);
        });
    }
}

test("bodies of a figure turn together under the mouse", async (context) => {
    const page = await open(context, files[0], WIDE, "light");
    const cells = await plots(page, await page.$(".grid"));
    for (const cell of cells) await show(cell);
    const eyes = () => Promise.all(cells.map((cell) => cell.evaluate((element) => element._fullLayout.scene._scene.getCamera().eye)));
    const before = await eyes();
    const box = await cells[0].handle.boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 2 + 80, box.y + box.height / 2 + 20, { steps: 8 });
    await page.mouse.up();
    await new Promise((done) => setTimeout(done, 500));
    const after = await eyes();
    const apart = (a, b) => Math.hypot(a.x - b.x, a.y - b.y, a.z - b.z);
    for (const [index, eye] of after.entries()) {
        assert.ok(apart(eye, before[index]) > 0.1, `body ${index} did not turn`);
        assert.ok(apart(eye, after[0]) < 0.05, `body ${index} turned otherwise`);
    }
});

test("bodies in motion follow the slider and the button", async (context) => {
    const page = await open(context, files.find((file) => /demo/.test(file)) ?? files[0], WIDE, "light");
    const cells = await plots(page, await page.$(".grid"));
    for (const cell of cells) await show(cell);
    const low = () => Promise.all(cells.map((cell) => cell.evaluate((element) => Math.min(...element.data[0].z))));
    const end = await low();
    await page.$eval(".player input", (slider) => { slider.value = 0; slider.dispatchEvent(new Event("input")); });
    await page.waitForFunction(() => document.querySelector(".player output").textContent === "0.00 s", { timeout: 20_000, polling: 50 });
    await page.waitForFunction((z) => Math.abs(Math.min(...document.querySelector(".grid .plot").data[0].z) - z) > 1, { timeout: 20_000, polling: 50 }, end[0]);
    await page.click(".player button");
    await page.waitForFunction(() => document.querySelector(".player button").textContent === "Play", { timeout: 120_000, polling: 100 });
    const after = await low();
    for (const [index, z] of after.entries()) assert.ok(Math.abs(z - end[index]) < 0.02, `body ${index}: ${z} mm, ${end[index]} at the end`);
});

test("a choice shows what it names", async (context) => {
    const page = await open(context, files.find((file) => /lab/.test(file)) ?? files[0], WIDE, "light");
    const select = await page.$("select");
    const [, second] = await select.evaluate((element) => Array.from(element.options, (option) => option.text));
    await select.select(second);
    const plot = await select.evaluateHandle((element) => element.parentElement.querySelector(".plot"));
    await page.waitForFunction((element, name) => element.dataset.drawn === name, { timeout: 10_000, polling: 50 }, plot, second);
});
