// Keys, while the picture has the focus: arrows move a cross, Enter takes hold of what is under it, arrows lead that,
// Enter or Escape lets go. With Shift arrows turn the view (three.js), plus and minus come nearer and go away.

const STEP = 6; // pixels of the page
const WAYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const ZOOM = 1.1;

/**
 * @param {HTMLCanvasElement} canvas, @param {HTMLElement} cross, @param {import("./hand.js").Hand} hand,
 * @param {import("./view.js").View} view, @param {(text: string | null) => void} say
 */
export function listenToKeys(canvas, cross, hand, view, say) {
    /** In the picture, pixels. */
    let at = null;
    let leads = false;

    const inPage = () => {
        const { left, top } = canvas.getBoundingClientRect();
        return { clientX: left + at[0], clientY: top + at[1] };
    };
    function moveTo(place) {
        at = [canvas.clientWidth, canvas.clientHeight].map((most, axis) => Math.min(Math.max(place[axis], 0), most));
        cross.style.transform = `translate(${at[0]}px, ${at[1]}px)`;
    }
    function letGo() {
        if (leads) hand.release();
        leads = false;
    }
    function take() {
        leads = hand.begin(inPage());
        say(leads ? null : "There is no tissue under the cross.");
    }
    const keys = {
        "Enter": () => (leads ? letGo() : take()),
        " ": () => keys.Enter(),
        "Escape": letGo,
        "+": () => view.zoom(1 / ZOOM),
        "-": () => view.zoom(ZOOM),
    };

    canvas.addEventListener("focus", () => {
        if (at === null) {
            const { x, y } = view.pixel(view.middle());
            const { left, top } = canvas.getBoundingClientRect();
            moveTo([x - left, y - top]);
        }
    });
    canvas.addEventListener("blur", letGo);
    // In the capturing phase: before the controls that turn the camera hear of it.
    canvas.addEventListener(
        "keydown",
        (event) => {
            const way = event.shiftKey ? null : WAYS[event.key];
            if (way) {
                moveTo(at.map((pixel, axis) => pixel + STEP * way[axis]));
                if (leads) hand.lead(inPage());
            } else if (keys[event.key]) {
                if (!event.repeat || event.key === "+" || event.key === "-") keys[event.key]();
            } else {
                return;
            }
            event.stopImmediatePropagation();
            event.preventDefault();
        },
        { capture: true },
    );
}
