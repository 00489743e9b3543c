// The picture: the liver, through which tumour and vessels are seen, where the tumour was at the start, instrument and
// pins, and a camera that the pointer turns. Drawn by three.js. Metres, z is up.

import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

/** sRGB. The style sheet has the same for the legend. */
const COLOURS = { liver: "#c98f78", tumour: "#e0202a", vessel: "#2f6fd0", probe: "#9fb4c8", pin: "#12a06a" };
const OPACITY = 0.38; // of the liver seen from above; where it is seen along its surface more
const PIN_RADIUS = 0.003; // m
const CAMERA = new THREE.Vector3(0.055, -0.25, 0.12); // from what it looks at
const LOWER = 0.005; // m: it looks below the middle of the body, which is higher than in the mean of a breath
const ANGLE = 33; // degrees, of what the camera sees from top to bottom

export class View {
    /**
     * @param {HTMLCanvasElement} canvas, @param liver as it hangs: points, triangles of its boundary, surfaces inside,
     * the target
     */
    constructor(canvas, liver) {
        this.canvas = canvas;
        this.renderer = new THREE.WebGLRenderer({ canvas, antialias: !paintsOnProcessor(), alpha: true });
        this.scene = new THREE.Scene();
        this.camera = new THREE.PerspectiveCamera(ANGLE, 1, 0.01, 2);
        this.camera.up.set(0, 0, 1);
        this.#fill(liver);
        this.controls = new OrbitControls(this.camera, canvas);
        this.box.getCenter(this.controls.target).z -= LOWER;
        this.camera.position.copy(this.controls.target).add(CAMERA);
        this.controls.minDistance = 0.1;
        this.controls.maxDistance = 0.8;
        this.controls.keyRotateSpeed = 12;
        this.controls.listenToKeyEvents(canvas);
        this.controls.addEventListener("change", () => {
            this.stale = true;
        });
        this.controls.update();
        this.pins = [];
        this.raycaster = new THREE.Raycaster();
        new ResizeObserver(() => this.#resize()).observe(canvas.parentElement);
        this.#resize();
        this.show({ positions: liver.points, inside: liver.inside, tool: null, pins: [] });
    }

    #fill({ points, triangles, surfaces, target, radius }) {
        this.body = surface(points.length / 3, triangles, translucent());
        this.box = new THREE.Box3().setFromArray(points);
        // Rays are tested against it; the body stays in it however it is pulled.
        this.body.geometry.boundingSphere = new THREE.Sphere(this.box.getCenter(new THREE.Vector3()), 1);
        this.inside = surfaces.map(({ name, first, count, triangles: of }) => {
            const mesh = surface(
                count,
                of,
                new THREE.MeshLambertMaterial({ color: COLOURS[name], side: THREE.DoubleSide }),
            );
            return { mesh, first };
        });
        this.start = circles(radius, getComputedStyle(this.canvas).color);
        this.start.position.fromArray(target);
        this.ball = new THREE.Mesh(
            new THREE.SphereGeometry(1, 24, 16),
            new THREE.MeshLambertMaterial({ color: COLOURS.probe, transparent: true, opacity: 0.6 }),
        );
        this.ball.visible = false;
        const light = new THREE.DirectionalLight("white", 2.2);
        light.position.set(-0.3, -0.5, 0.8);
        this.scene.add(
            this.body,
            ...this.inside.map(({ mesh }) => mesh),
            this.start,
            this.ball,
            new THREE.HemisphereLight("white", "#77706a", 1.6),
            light,
        );
    }

    #resize() {
        const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
        this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
        this.renderer.setSize(width, height, false);
        this.camera.aspect = width / height;
        // The liver is wider than high: in a narrow picture the camera sees a larger angle.
        this.camera.fov = width < 1.15 * height ? Math.min(60, (ANGLE * 1.15 * height) / width) : ANGLE;
        this.camera.updateProjectionMatrix();
        this.stale = true;
    }

    /** Takes nodes, points inside, instrument and pins of a frame. */
    show({ positions, inside, tool, pins }) {
        place(this.body, positions);
        for (const { mesh, first } of this.inside)
            place(mesh, inside.subarray(3 * first, 3 * first + mesh.geometry.attributes.position.array.length));
        this.ball.visible = tool !== null;
        if (tool) {
            this.ball.position.fromArray(tool.position);
            this.ball.scale.setScalar(tool.radius);
        }
        this.#showPins(pins);
        this.stale = true;
    }

    #showPins(pins) {
        while (this.pins.length < pins.length) {
            const pin = new THREE.Mesh(this.ball.geometry, new THREE.MeshLambertMaterial({ color: COLOURS.pin }));
            pin.scale.setScalar(PIN_RADIUS);
            this.scene.add(pin);
            this.pins.push(pin);
        }
        this.pins.forEach((pin, index) => {
            pin.visible = index < pins.length;
            if (pin.visible) pin.position.fromArray(pins[index].position);
        });
    }

    /** Draws if anything has changed since the last time. */
    draw() {
        if (!this.stale) return false;
        this.stale = false;
        this.renderer.render(this.scene, this.camera);
        return true;
    }

    /** Draws and waits until it is drawn; gives how long that took, ms. */
    paint() {
        const gl = this.renderer.getContext();
        const begin = performance.now();
        this.renderer.render(this.scene, this.camera);
        // What is read back has been drawn.
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
        return performance.now() - begin;
    }

    /** Farther away by this factor. */
    zoom(factor) {
        this.camera.position.sub(this.controls.target).multiplyScalar(factor).add(this.controls.target);
        this.controls.update();
    }

    /** Of the body at the start. */
    middle() {
        return this.box.getCenter(new THREE.Vector3()).toArray();
    }

    /** Where a pointer meets the tissue or a pin, and along which direction the camera sees it; null if it does not. */
    pick(event) {
        this.#aim(event);
        const [first] = this.raycaster.intersectObjects([this.body, ...this.pins.filter((pin) => pin.visible)]);
        return first ? { hit: first.point, direction: this.raycaster.ray.direction.clone() } : null;
    }

    /** Where a pointer meets the plane through `point` that faces the camera. */
    inPlane(event, point) {
        this.#aim(event);
        const facing = this.camera.getWorldDirection(new THREE.Vector3());
        const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(facing, point);
        return this.raycaster.ray.intersectPlane(plane, new THREE.Vector3()) ?? point.clone();
    }

    #aim({ clientX, clientY }) {
        const { left, top, width, height } = this.canvas.getBoundingClientRect();
        const at = new THREE.Vector2(((clientX - left) / width) * 2 - 1, 1 - ((clientY - top) / height) * 2);
        this.raycaster.setFromCamera(at, this.camera);
    }

    /** Where a point of the scene is in the page, in its pixels. */
    pixel(point) {
        const { left, top, width, height } = this.canvas.getBoundingClientRect();
        const { x, y } = new THREE.Vector3(...point).project(this.camera);
        return { x: left + ((x + 1) / 2) * width, y: top + ((1 - y) / 2) * height };
    }
}

/** Without a graphics processor smooth edges take most of the time of a picture: there they are left out. */
function paintsOnProcessor() {
    const gl = document.createElement("canvas").getContext("webgl2");
    const facts = gl?.getExtension("WEBGL_debug_renderer_info");
    return Boolean(facts) && /SwiftShader|llvmpipe|Basic Render/.test(gl.getParameter(facts.UNMASKED_RENDERER_WEBGL));
}

/** A ball that hides nothing and is not hidden: one circle in each plane. */
function circles(radius, color) {
    const material = new THREE.LineBasicMaterial({ color, transparent: true, opacity: 0.7, depthTest: false });
    const round = new THREE.EllipseCurve(0, 0, radius, radius).getPoints(48);
    const planes = [(a, b) => [a, b, 0], (a, b) => [a, 0, b], (a, b) => [0, a, b]];
    const lines = planes.map((put) => {
        const points = round.map(({ x, y }) => new THREE.Vector3(...put(x, y)));
        return new THREE.Line(new THREE.BufferGeometry().setFromPoints(points), material);
    });
    return new THREE.Group().add(...lines);
}

/** Triangles whose points move. */
function surface(points, triangles, material) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute(
        "position",
        new THREE.BufferAttribute(new Float32Array(3 * points), 3).setUsage(THREE.DynamicDrawUsage),
    );
    geometry.setIndex(Array.from(triangles));
    const mesh = new THREE.Mesh(geometry, material);
    mesh.frustumCulled = false;
    return mesh;
}

function place({ geometry }, positions) {
    geometry.attributes.position.array.set(positions);
    geometry.attributes.position.needsUpdate = true;
    geometry.computeVertexNormals();
}

/** Tissue that is seen through, less where its surface turns away: so its form stays to be seen. */
function translucent() {
    const material = new THREE.MeshLambertMaterial({
        color: COLOURS.liver,
        transparent: true,
        opacity: OPACITY,
        depthWrite: false,
    });
    material.onBeforeCompile = (shader) => {
        shader.fragmentShader = shader.fragmentShader.replace(
            "#include <opaque_fragment>",
            "diffuseColor.a = mix(diffuseColor.a, 1.0, pow(1.0 - abs(dot(normal, normalize(vViewPosition))), 2.0));\n" +
                "#include <opaque_fragment>",
        );
    };
    return material;
}
