// Mouse, pen or finger: on the tissue it leads the instrument, anywhere else it turns the camera. One pointer leads at a time.

/**
 * @param {import("./view.js").View} view, @param {() => string} kind of the instrument, @param {(message: object) => void} send to the kernel
 */
export function listen(view, kind, send) {
    const { canvas, controls } = view;
    let leading = null;

    // In the capturing phase: before the controls that turn the camera hear of it.
    canvas.addEventListener("pointerdown", (event) => {
        if (leading || event.button !== 0) return;
        const picked = view.pick(event);
        if (!picked) return;
        event.stopImmediatePropagation();
        event.preventDefault();
        canvas.setPointerCapture(event.pointerId);
        controls.enabled = false;
        leading = { id: event.pointerId, from: picked.hit };
        send({ type: "begin", kind: kind(), hit: picked.hit.toArray(), direction: picked.direction.toArray() });
    }, { capture: true });

    canvas.addEventListener("pointermove", (event) => {
        if (event.pointerId === leading?.id) {
            send({ type: "lead", way: view.inPlane(event, leading.from).sub(leading.from).toArray() });
        } else if (event.pointerType === "mouse" && event.buttons === 0) {
            canvas.classList.toggle("over", view.pick(event) !== null);
        }
    });

    const end = (event) => {
        if (event.pointerId !== leading?.id) return;
        leading = null;
        controls.enabled = true;
        send({ type: "release" });
    };
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) canvas.addEventListener(name, end);
}
