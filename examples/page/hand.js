// What leads an instrument or a pin: a place in the page that takes hold of the tissue, goes on, and lets go. Pointer
// and keys both have it, one at a time.

export class Hand {
    /**
     * @param {import("./view.js").View} view, @param {() => string} kind of the instrument, @param {(message: object)
     * => void} send to the kernel
     */
    constructor(view, kind, send) {
        Object.assign(this, { view, kind, send, from: null });
    }

    holds() {
        return this.from !== null;
    }

    /** Takes hold at a place of the page, { clientX, clientY }; whether there is tissue. */
    begin(at) {
        const picked = this.holds() ? null : this.view.pick(at);
        if (!picked) return false;
        this.from = picked.hit;
        this.view.controls.enabled = false;
        this.send({
            type: "begin",
            kind: this.kind(),
            hit: picked.hit.toArray(),
            direction: picked.direction.toArray(),
        });
        return true;
    }

    lead(at) {
        this.send({ type: "lead", way: this.view.inPlane(at, this.from).sub(this.from).toArray() });
    }

    release() {
        if (!this.holds()) return;
        this.from = null;
        this.view.controls.enabled = true;
        this.send({ type: "release" });
    }
}
