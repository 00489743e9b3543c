// Takes pictures of reports and of the web page in headless Chromium. Run by tools/pictures.sh.
//
//     node tools/pictures.mjs RUNS PICTURES

import { createRequire } from "node:module";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const puppeteer = createRequire(new URL("../examples/page/package.json", import.meta.url))("puppeteer-core");
const [runs, pictures] = process.argv.slice(2);
const browser = await puppeteer.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"] });

async function open(file, width) {
    const page = await browser.newPage();
    await page.setViewport({ width, height: 1000, deviceScaleFactor: 1.5 });
    await page.goto(pathToFileURL(resolve(file)).href);
    return page;
}

/** What the browser has of the first figure whose section begins like this, once all of it is drawn. */
async function figure(page, title, selector, name) {
    const section = await page.evaluateHandle((title) => [...document.querySelectorAll("section")].find((section) => section.querySelector("h2").textContent.startsWith(title)), title);
    const part = await section.$(selector);
    await part.evaluate((element) => scrollTo(0, element.getBoundingClientRect().top + scrollY - 40));
    await page.waitForFunction((element) => [...element.querySelectorAll(".plot")].every((plot) => plot.dataset.drawn), { polling: 50 }, part);
    await part.screenshot({ path: join(pictures, `${name}.png`) });
}

const demo = await open(join(runs, "demo", "report.html"), 1000);
await figure(demo, "A liver", ".panels", "demo");
const lab = await open(join(runs, "lab", "report.html"), 1100);
await figure(lab, "Speed", ".panels", "speed");
await figure(lab, "The paper's bar", ".panels", "bars");

// The page while the liver breathes and a ball presses it.
const page = await open("out/page/index.html", 1100);
await page.waitForFunction(() => window.supple?.latest?.number > 3, { timeout: 60_000, polling: 20 });
await page.click("label:has(input[value=press])");
const dome = await page.evaluate(() => window.supple.pixel([0.0266, -0.0144, 0.0289]));
await page.mouse.move(dome.x, dome.y);
await page.mouse.down();
await page.mouse.move(dome.x + 30, dome.y + 10, { steps: 10 });
await page.evaluate(() => new Promise((done) => setTimeout(done, 2000)));
await page.screenshot({ path: join(pictures, "page.png") });
await browser.close();
