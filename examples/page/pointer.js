// Mouse, pen or finger: on the tissue it leads the instrument, anywhere else it turns the camera. One pointer leads at
// a time.

/** @param {HTMLCanvasElement} canvas, @param {import("./hand.js").Hand} hand, @param {import("./view.js").View} view */
export function listenToPointer(canvas, hand, view) {
    let leading = null;

    // In the capturing phase: before the controls that turn the camera hear of it.
    canvas.addEventListener(
        "pointerdown",
        (event) => {
            if (event.button !== 0 || !hand.begin(event)) return;
            event.stopImmediatePropagation();
            event.preventDefault();
            canvas.setPointerCapture(event.pointerId);
            leading = event.pointerId;
        },
        { capture: true },
    );

    canvas.addEventListener("pointermove", (event) => {
        if (event.pointerId === leading) hand.lead(event);
        else if (event.pointerType === "mouse" && event.buttons === 0)
            canvas.classList.toggle("over", view.pick(event) !== null);
    });

    const end = (event) => {
        if (event.pointerId !== leading) return;
        leading = null;
        hand.release();
    };
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) canvas.addEventListener(name, end);
}
