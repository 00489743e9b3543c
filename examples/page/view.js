// The picture: the surface of the lobe coloured by displacement, the instrument, and a camera that the pointer turns. Drawn by three.js.
// Metres, z is up.

import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

/** Displacement at the end of the scale, m; more has the same colour. */
const SCALE = 0.03;
/** From tissue that stands still to the end of the scale, sRGB, ever lighter. The style sheet has the same for the legend. */
const COLOURS = ["#8a3f45", "#c9603f", "#f0a63c", "#fbe58a"].map((hex) => new THREE.Color(hex));
/** Of a pin; m. */
const PIN = "#3f8fd0";
const PIN_RADIUS = 0.003;
const MIDDLE = new THREE.Vector3(0.01, -0.005, 0.03);
const CAMERA = new THREE.Vector3(0.03, -0.24, 0.17);

export class View {
    /** @param {HTMLCanvasElement} canvas, @param lobe its points at rest, triangles of its boundary, and their groups */
    constructor(canvas, lobe) {
        this.canvas = canvas;
        this.rest = lobe.points;
        this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
        this.scene = new THREE.Scene();
        this.camera = new THREE.PerspectiveCamera(33, 1, 0.01, 2);
        this.camera.up.set(0, 0, 1);
        this.camera.position.copy(MIDDLE).add(CAMERA);
        this.controls = new OrbitControls(this.camera, canvas);
        this.controls.target.copy(MIDDLE);
        this.controls.minDistance = 0.1;
        this.controls.maxDistance = 0.8;
        this.controls.addEventListener("change", () => { this.stale = true; });
        this.controls.update();
        this.#fill(lobe);
        this.pins = [];
        this.raycaster = new THREE.Raycaster();
        new ResizeObserver(() => this.#resize()).observe(canvas.parentElement);
        this.#resize();
        this.show(lobe.points, null, []);
    }

    #fill({ triangles, groups }) {
        // Where groups meet in an edge, each has vertices of its own: light breaks there.
        const places = new Map();
        const corners = Array.from(triangles, (node, corner) => {
            const key = `${node} ${groups[Math.floor(corner / 3)]}`;
            if (!places.has(key)) places.set(key, { place: places.size, node });
            return places.get(key).place;
        });
        this.vertices = Array.from(places.values(), ({ node }) => node);
        const geometry = new THREE.BufferGeometry();
        const attribute = () => new THREE.BufferAttribute(new Float32Array(3 * places.size), 3).setUsage(THREE.DynamicDrawUsage);
        this.positions = attribute();
        this.colours = attribute();
        geometry.setAttribute("position", this.positions);
        geometry.setAttribute("color", this.colours);
        geometry.setIndex(corners);
        // Rays are tested against it; the body stays in it however it is pulled.
        geometry.boundingSphere = new THREE.Sphere(MIDDLE.clone(), 1);
        this.body = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 0.55 }));
        this.body.frustumCulled = false;
        this.ball = new THREE.Mesh(
            new THREE.SphereGeometry(1, 32, 20),
            new THREE.MeshStandardMaterial({ color: "#9fb4c8", metalness: 0.2, roughness: 0.35, transparent: true, opacity: 0.6 }));
        this.ball.visible = false;
        const light = new THREE.DirectionalLight("white", 2.2);
        light.position.set(-0.3, -0.5, 0.8);
        this.scene.add(this.body, this.ball, new THREE.HemisphereLight("white", "#77706a", 1.6), light);
    }

    #resize() {
        const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
        this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
        this.renderer.setSize(width, height, false);
        this.camera.aspect = width / height;
        // The lobe is wider than high: in a narrow picture the camera sees a larger angle.
        this.camera.fov = width < 1.15 * height ? Math.min(60, 33 * 1.15 * height / width) : 33;
        this.camera.updateProjectionMatrix();
        this.stale = true;
    }

    /** Takes the nodes and the instrument of a frame. Gives the largest displacement of the surface, m. */
    show(positions, tool, pins) {
        const { rest, vertices } = this;
        const colour = new THREE.Color();
        let largest = 0;
        vertices.forEach((node, vertex) => {
            const [x, y, z] = positions.subarray(3 * node, 3 * node + 3);
            const moved = Math.hypot(x - rest[3 * node], y - rest[3 * node + 1], z - rest[3 * node + 2]);
            largest = Math.max(largest, moved);
            const share = Math.min(moved / SCALE, 1) * (COLOURS.length - 1);
            const below = Math.min(Math.floor(share), COLOURS.length - 2);
            colour.lerpColors(COLOURS[below], COLOURS[below + 1], share - below).toArray(this.colours.array, 3 * vertex);
            this.positions.setXYZ(vertex, x, y, z);
        });
        this.positions.needsUpdate = true;
        this.colours.needsUpdate = true;
        this.body.geometry.computeVertexNormals();
        this.ball.visible = tool !== null;
        if (tool) {
            this.ball.position.fromArray(tool.position);
            this.ball.scale.setScalar(tool.radius);
        }
        this.#showPins(pins);
        this.stale = true;
        return largest;
    }

    #showPins(pins) {
        while (this.pins.length < pins.length) {
            const pin = new THREE.Mesh(this.ball.geometry, new THREE.MeshStandardMaterial({ color: PIN, roughness: 0.4 }));
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
        const place = new THREE.Vector2((clientX - left) / width * 2 - 1, 1 - (clientY - top) / height * 2);
        this.raycaster.setFromCamera(place, this.camera);
    }

    /** Where a point of the scene is in the page, in its pixels. */
    pixel(point) {
        const { left, top, width, height } = this.canvas.getBoundingClientRect();
        const { x, y } = new THREE.Vector3(...point).project(this.camera);
        return { x: left + (x + 1) / 2 * width, y: top + (1 - y) / 2 * height };
    }
}
