// What the page says in words and numbers. People see millimetres; all that comes in is SI.

const element = (id) => document.getElementById(id);
const millimetres = (metres, digits = 2) => `${(1e3 * metres).toFixed(digits)} mm`;
const milliseconds = (time) => `${time.toFixed(time < 10 ? 2 : 1)} ms`;

/** The tolerance slider counts in powers of ten of a metre: 0.05 to 5 mm. */
const tolerance = () => 10 ** Number(element("tolerance").value);

export class Panel {
    /** @param {(message: object) => void} send to the kernel */
    constructor(send) {
        this.send = send;
        this.means = new Map();
        const choose = () => {
            this.means.clear();
            this.#showTolerance();
            this.#sendMethod();
        };
        element("method").addEventListener("change", choose);
        element("tolerance").addEventListener("change", choose);
        element("tolerance").addEventListener("input", () => this.#showTolerance());
        element("breathes").addEventListener("change", () => this.#sendBreath());
        element("compares").addEventListener("change", () => this.#sendCompares());
        element("reset").addEventListener("click", () => {
            this.say(null);
            send({ type: "reset" });
        });
        this.#showTolerance();
    }

    /**
     * Says how large the liver is, and tells the kernel what is chosen: a browser may keep that when a page is loaded
     * again.
     */
    begin({ points, tetrahedra }) {
        element("size").textContent =
            `${(points.length / 3).toLocaleString("en")} nodes and ${tetrahedra.toLocaleString("en")} tetrahedra`;
        this.#sendMethod();
        this.#sendBreath();
        this.#sendCompares();
    }

    #sendMethod() {
        this.send({ type: "method", method: element("method").value, tolerance: tolerance() });
    }

    #sendBreath() {
        this.send({ type: "breathe", goes: element("breathes").checked });
    }

    #sendCompares() {
        this.send({ type: "compare", goes: element("compares").checked });
    }

    kind() {
        return document.querySelector("input[name=tool]:checked").value;
    }

    /** Simulated over real time that is asked for. */
    wantedPace() {
        return Number(element("wanted-pace").value);
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

    /** @param frame of the kernel */
    show(frame) {
        const set = (id, text) => {
            element(id).textContent = text;
        };
        const { estimate, exact } = frame;
        set("error", exact ? millimetres(exact.error, 3) : "–");
        set("error-is", target(frame));
        set("moved", millimetres(frame.moved, 1));
        const most = Math.max(0, frame.tool?.force ?? 0, ...frame.pins.map(({ force }) => force));
        set("force", `${most.toFixed(2)} N`);
        set("contacts", contacts(frame));
        if (frame.steps > 0) {
            set("frame", milliseconds(this.#mean("frame", frame.milliseconds)));
            const each = milliseconds(this.#mean("step", frame.milliseconds / frame.steps));
            set("step", `${frame.steps} ${frame.steps === 1 ? "step" : "steps"} of ${each}`);
        }
        set("exact", exact ? milliseconds(this.#mean("exact", exact.milliseconds)) : "–");
        set("estimate", estimate ? millimetres(estimate.mean, 3) : "–");
        if (frame.name) {
            set("status", frame.name.replace("SUPPLE_", "").replace("E_", "").replaceAll("_", " ").toLowerCase());
            element("status").title = frame.text;
            element("status").classList.toggle("warn", frame.name !== "SUPPLE_OK");
        }
        if (frame.halted)
            this.say(`The kernel: ${frame.refusal.text}. The simulation stands still: reset it to go on.`, true);
        else if (frame.slipped) this.say("The forceps slipped: they hold no more than 5 N.");
        else if (frame.refusal)
            this.say(
                frame.refusal.name
                    ? `The kernel: ${frame.refusal.text}. The instrument was taken away.`
                    : frame.refusal.text,
            );
    }

    /** Pictures a second, and seconds simulated in a second. */
    pace({ pictures, realTime }) {
        element("pictures").textContent = `${pictures.toFixed(0)} a second`;
        element("pace").textContent = `${realTime.toFixed(2)} × real time`;
    }
}

function target({ exact, worst, refused, method }) {
    if (refused) return `unknown until a reset, as exact steps stand still: ${refused.text}`;
    if (!exact) return "unknown: exact steps do not go along";
    return method === "exact" ? "these are exact steps" : `at most ${millimetres(worst, 3)} so far`;
}

function contacts({ tool, pins }) {
    const pinned = pins.length === 1 ? "1 pin" : `${pins.length} pins`;
    if (!tool) return pins.length > 0 ? pinned : "none";
    if (tool.held > 0) return `holds ${tool.held} nodes`;
    return tool.contacts > 0 ? `touches ${tool.contacts} nodes` : "touches nothing";
}
