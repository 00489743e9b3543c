// What the page says in words and numbers. People see millimetres; all that comes in is SI.

const element = (id) => document.getElementById(id);
const millimetres = (metres, digits = 2) => `${(1e3 * metres).toFixed(digits)} mm`;

/** The tolerance slider counts in powers of ten of a metre: 0.05 to 5 mm. */
const tolerance = () => 10 ** Number(element("tolerance").value);

export class Panel {
    /** @param {(message: object) => void} send to the kernel */
    constructor(send) {
        this.means = new Map();
        const choose = () => {
            this.means.clear();
            this.#showTolerance();
            send({ type: "method", method: element("method").value, tolerance: tolerance() });
        };
        element("method").addEventListener("change", choose);
        element("tolerance").addEventListener("change", choose);
        element("tolerance").addEventListener("input", () => this.#showTolerance());
        element("reset").addEventListener("click", () => {
            this.say(null);
            send({ type: "reset" });
        });
        this.#showTolerance();
    }

    kind() {
        return document.querySelector("input[name=tool]:checked").value;
    }

    #showTolerance() {
        element("tolerance-value").textContent = millimetres(tolerance());
        // Exact steps have no error to judge.
        element("tolerance").disabled = element("method").value === "exact";
    }

    /** A message that stays until the next; null: none. `stopped` asks for a reset. */
    say(text, stopped = false) {
        element("message").textContent = text ?? "";
        element("message").classList.toggle("stopped", stopped);
        element("reset").classList.toggle("asked", stopped);
    }

    /** A mean that forgets, over about ten frames: single times jump. */
    #mean(key, value) {
        const mean = this.means.has(key) ? 0.9 * this.means.get(key) + 0.1 * value : value;
        this.means.set(key, mean);
        return mean;
    }

    /** @param frame of the kernel, @param {number} largest displacement, m */
    show(frame, largest) {
        const set = (id, text) => { element(id).textContent = text; };
        const most = Math.max(0, frame.tool?.force ?? 0, ...frame.pins.map(({ force }) => force));
        set("force", `${most.toFixed(2)} N`);
        set("contacts", contacts(frame));
        set("largest", millimetres(largest, 1));
        if (frame.steps > 0) {
            set("step", `${this.#mean("step", frame.milliseconds / frame.steps).toFixed(2)} ms`);
            set("frame", `${frame.steps} steps a frame: ${this.#mean("frame", frame.milliseconds).toFixed(1)} ms`);
        }
        const { estimate } = frame;
        set("estimate", estimate ? millimetres(estimate.mean) : "–");
        set("guard", guard(frame));
        element("guard").classList.toggle("warn", frame.name === "SUPPLE_INEXACT");
        if (frame.name) {
            set("status", frame.name.replace("SUPPLE_", "").replace("E_", "").replaceAll("_", " ").toLowerCase());
            element("status").title = frame.text;
        }
        if (frame.halted) this.say(`The kernel: ${frame.refusal.text}. The simulation stands still: reset it to go on.`, true);
        else if (frame.refusal) this.say(frame.refusal.name ? `The kernel: ${frame.refusal.text}. The instrument was taken away.` : frame.refusal.text);
    }

    /** Pictures a second, and seconds simulated in a second. */
    pace({ pictures, realTime }) {
        element("pictures").textContent = `${pictures.toFixed(0)} a second`;
        element("pace").textContent = `${realTime.toFixed(2)} × real time`;
    }
}

function contacts({ tool, pins }) {
    const pinned = pins.length === 1 ? "1 pin" : `${pins.length} pins`;
    if (!tool) return pins.length > 0 ? pinned : "none";
    if (tool.held > 0) return `holds ${tool.held} nodes`;
    return tool.contacts > 0 ? `touches ${tool.contacts} nodes` : "touches nothing";
}

function guard({ method, name, estimate }) {
    if (method === "exact") return "none: exact steps are the reference";
    if (!estimate) return "no estimate yet";
    return name === "SUPPLE_INEXACT" ? "inexact: above the tolerance" : "within the tolerance";
}
