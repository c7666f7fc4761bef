// Widgets of the lessons: plain canvas, no library, nothing from the network. A page includes one by
//   <div class="widget" data-widget="sums"></div>
// MAP (map.js) holds 257 × 257 heights of a bundled map as bytes, 0 to 255.
"use strict";

const N = MAP.n;
const heights = Uint8Array.from(atob(MAP.base64), (c) => c.charCodeAt(0));
const height = (x, y) => heights[y * N + x];

// --- Parts that all use -----------------------------------------------------------------------------------------------

function element(parent, name, text = "") {
    const found = document.createElement(name);
    found.textContent = text;
    parent.append(found);
    return found;
}

function canvas(parent, width, tall) {
    const found = element(parent, "canvas");
    found.width = width;
    found.height = tall;
    return found;
}

// The map lit from the north-west, twice its size, drawn once.
const picture = (() => {
    const small = document.createElement("canvas");
    small.width = small.height = N;
    const context = small.getContext("2d");
    const pixels = context.createImageData(N, N);
    for (let y = 0; y < N; y++)
        for (let x = 0; x < N; x++) {
            const dx = height(Math.min(x + 1, N - 1), y) - height(Math.max(x - 1, 0), y);
            const dy = height(x, Math.min(y + 1, N - 1)) - height(x, Math.max(y - 1, 0));
            const light = 165 + 5 * (dx + dy);
            pixels.data.set([light, light, light, 255], 4 * (y * N + x));
        }
    context.putImageData(pixels, 0, 0);
    return small;
})();

function land(context, x, y, size) {
    context.imageSmoothingEnabled = true;
    context.drawImage(picture, x, y, size, size);
}

function place(event, target) {
    const box = target.getBoundingClientRect();
    return [((event.clientX - box.left) * target.width) / box.width, ((event.clientY - box.top) * target.height) / box.height];
}

function slider(parent, label, low, high, value, changed) {
    const row = element(parent, "label", label + " ");
    const input = element(row, "input");
    Object.assign(input, { type: "range", min: low, max: high, step: "any", value });
    input.addEventListener("input", () => changed(Number(input.value)));
    return input;
}

// --- Lesson 3: drag a box over a summed-area table --------------------------------------------------------------------

function sums(parent) {
    const exact = new Uint32Array((N + 1) * (N + 1)), whole = new Float64Array((N + 1) * (N + 1));
    const before = 5e11; // the sum of what lies above and to the left, as large as in a map of 4096 × 4096 posts
    for (let y = 1; y <= N; y++)
        for (let x = 1; x <= N; x++) {
            const at = y * (N + 1) + x, up = at - N - 1, value = height(x - 1, y - 1) * 257;
            exact[at] = exact[at - 1] + exact[up] - exact[up - 1] + value; // wraps
            whole[at] = whole[at - 1] + whole[up] - whole[up - 1] + value;
        }
    const rough = Float32Array.from(whole, (sum) => before + sum);
    const target = canvas(parent, 514, 514), told = element(parent, "pre");
    let from = [60, 60], to = [180, 140];
    function draw() {
        const context = target.getContext("2d");
        land(context, 0, 0, 514);
        const [x0, x1] = [from[0], to[0]].sort((a, b) => a - b), [y0, y1] = [from[1], to[1]].sort((a, b) => a - b);
        context.fillStyle = "rgba(30, 120, 220, 0.3)";
        context.fillRect(2 * x0, 2 * y0, 2 * (x1 - x0), 2 * (y1 - y0));
        for (const [x, y, sign] of [[x1, y1, "+"], [x1, y0, "−"], [x0, y1, "−"], [x0, y0, "+"]]) {
            context.fillStyle = "#c22";
            context.fillRect(2 * x - 3, 2 * y - 3, 6, 6);
            context.font = "bold 16px sans-serif";
            context.fillText(sign, 2 * x + 6, 2 * y - 6);
        }
        const count = (x1 - x0) * (y1 - y0), four = (t) => [[x1, y1], [x1, y0], [x0, y1], [x0, y0]].map(([x, y]) => t[y * (N + 1) + x]);
        const [a, b, c, d] = four(exact), [e, f, g, h] = four(rough), sum = (a - b - c + d) >>> 0;
        const float = Math.fround(Math.fround(Math.fround(e - f) - g) + h);
        told.textContent = count
            ? `box of ${x1 - x0} × ${y1 - y0} posts\n${a} − ${b} − ${c} + ${d} = ${sum} (modulo 2^32)\nmean ${(sum / count).toFixed(3)}, in float32, far from a large map's corner, ${(float / count).toFixed(3)}, off by ${Math.abs((float - sum) / count).toFixed(3)}`
            : "drag a box over the map";
        parent.dataset.sum = sum;
    }
    const post = (event) => place(event, target).map((v) => Math.max(0, Math.min(N, Math.round(v / 2))));
    target.addEventListener("pointerdown", (event) => {
        target.setPointerCapture(event.pointerId);
        from = to = post(event);
        draw();
    });
    target.addEventListener("pointermove", (event) => {
        if (event.buttons) [to] = [post(event)], draw();
    });
    draw();
}

// --- Quadtrees for the two others -------------------------------------------------------------------------------------

// For each level: the nodes' largest error and squared error when drawn as two triangles (both diagonals).
const levels = (() => {
    const found = [];
    for (let side = 1; side < N; side *= 2) {
        const nodes = (N - 1) / side, largest = new Float64Array(nodes * nodes), squares = new Float64Array(nodes * nodes);
        for (let j = 0; j < nodes; j++)
            for (let i = 0; i < nodes; i++) {
                const x = i * side, y = j * side, a = height(x, y), b = height(x + side, y), c = height(x, y + side), d = height(x + side, y + side);
                let most = 0, sum = 0;
                for (let v = 0; v <= side; v++)
                    for (let u = 0; u <= side; u++) {
                        const s = v / side, t = u / side, h = height(x + u, y + v);
                        const falling = t >= s ? a + (b - a) * t + (d - b) * s : a + (c - a) * s + (d - c) * t;
                        const rising = s + t <= 1 ? a + (b - a) * t + (c - a) * s : d + (c - d) * (1 - t) + (b - d) * (1 - s);
                        const error = Math.max(Math.abs(falling - h), Math.abs(rising - h));
                        most = Math.max(most, error);
                        if (u < side && v < side) sum += error * error;
                    }
                largest[j * nodes + i] = most;
                squares[j * nodes + i] = sum;
            }
        found.push({ side, nodes, largest, squares });
    }
    return found;
})();

// Leaves from the root down; `split(level, i, j)` decides.
function leaves(split) {
    const found = [], todo = [[levels.length - 1, 0, 0]];
    while (todo.length) {
        const [k, i, j] = todo.pop();
        if (k > 0 && split(k, i, j)) for (const [v, u] of [[0, 0], [0, 1], [1, 0], [1, 1]]) todo.push([k - 1, 2 * i + u, 2 * j + v]);
        else found.push([k, i, j]);
    }
    return found;
}

// For each level: whether a node is split at a price, because the best choice for its parts costs less.
function pruned(price) {
    let best = levels[0].squares.map((e) => e + 2 * price);
    const splits = [null];
    for (const { nodes, squares } of levels.slice(1)) {
        const split = new Uint8Array(nodes * nodes), next = new Float64Array(nodes * nodes);
        for (let j = 0; j < nodes; j++)
            for (let i = 0; i < nodes; i++) {
                const at = j * nodes + i, below = 4 * j * nodes + 2 * i;
                const parts = best[below] + best[below + 1] + best[below + 2 * nodes] + best[below + 2 * nodes + 1], own = squares[at] + 2 * price;
                split[at] = parts < own;
                next[at] = Math.min(parts, own);
            }
        splits.push(split);
        best = next;
    }
    return leaves((k, i, j) => splits[k][j * levels[k].nodes + i]);
}

const rms = (found) => Math.sqrt(found.reduce((sum, [k, i, j]) => sum + levels[k].squares[j * levels[k].nodes + i], 0) / (N - 1) ** 2);

function outline(context, found, x, zoom) {
    context.strokeStyle = "rgba(160, 20, 20, 0.8)";
    context.lineWidth = 0.7;
    context.beginPath();
    for (const [k, i, j] of found) context.rect(x + zoom * i * levels[k].side, zoom * j * levels[k].side, zoom * levels[k].side, zoom * levels[k].side);
    context.stroke();
}

// --- Lesson 9: a tolerance, a budget, the mesh and the curve ----------------------------------------------------------

function budget(parent) {
    const target = canvas(parent, 900, 514), context = target.getContext("2d"), told = element(parent, "pre");
    const within = (tolerance) => leaves((k, i, j) => levels[k].largest[j * levels[k].nodes + i] > tolerance);
    const points = [...Array(28).keys()].map((p) => pruned(2 ** (p - 6))).map((found) => [2 * found.length, rms(found)]);
    const tolerances = [...Array(24).keys()].map((k) => within(0.6 * 1.28 ** k)).map((found) => [2 * found.length, rms(found)]);
    const across = (n) => 560 + (320 * Math.log(n / 2)) / Math.log(131072 / 2), down = (e) => 470 - (430 * Math.log(Math.max(e, 0.02) / 0.02)) / Math.log(80 / 0.02);
    function line(all, colour) {
        context.strokeStyle = colour;
        context.beginPath();
        all.forEach(([n, e], i) => context[i ? "lineTo" : "moveTo"](across(n), down(e)));
        context.stroke();
    }
    function axes() {
        context.fillStyle = context.strokeStyle = "#777";
        context.lineWidth = 1;
        context.font = "12px sans-serif";
        context.strokeRect(across(2), down(80), across(131072) - across(2), down(0.02) - down(80));
        for (const [value, text] of [[10, "10"], [100, "100"], [1e3, "1,000"], [1e4, "10,000"], [1e5, "100,000"]]) {
            context.fillRect(across(value), 464, 1, 6);
            context.fillText(text, across(value) - 3 * text.length, 485);
        }
        for (const value of [0.1, 1, 10]) {
            context.fillRect(560, down(value), 6, 1);
            context.fillText(value, 538, down(value) + 4);
        }
    }
    function draw(found, name) {
        context.clearRect(0, 0, 900, 514);
        axes();
        land(context, 0, 0, 514);
        outline(context, found, 0, 2);
        context.lineWidth = 2;
        line(points, "#1f77b4");
        line(tolerances, "#ff7f0e");
        const n = 2 * found.length, e = rms(found);
        context.fillStyle = "#c22";
        context.fillRect(across(n) - 4, down(e) - 4, 8, 8);
        context.fillStyle = "#777";
        context.font = "14px sans-serif";
        context.fillText("rms error in steps of height, over triangles", 560, 507);
        context.fillStyle = "#1f77b4";
        context.fillText("by a price", 760, 65);
        context.fillStyle = "#ff7f0e";
        context.fillText("by a tolerance", 760, 85);
        told.textContent = `${name}: ${n} triangles, rms error ${e.toFixed(3)} steps of height`;
        parent.dataset.triangles = n;
    }
    slider(parent, "tolerance", -1, 6, 2, (v) => draw(within(2 ** v), `tolerance ${(2 ** v).toFixed(2)}`));
    slider(parent, "budget", 3, 15, 9, (v) => {
        let low = -40, high = 40;
        for (let step = 0; step < 30; step++) {
            const middle = 0.5 * (low + high);
            if (2 * pruned(2 ** middle).length > 2 ** v) low = middle;
            else high = middle;
        }
        draw(pruned(2 ** high), `at most ${Math.floor(2 ** v)} triangles`);
    });
    draw(within(4), "tolerance 4.00");
}

// --- Lesson 6: a frozen eye, clipmap and quadtree ---------------------------------------------------------------------

function rings(eye, cells, count) {
    const found = [];
    let hole = [0, 0, 0];
    for (let level = 0; level < count; level++) {
        const side = 2 ** level, step = 2 * side, origin = eye.map((at) => step * Math.floor((at - (cells * side) / 2) / step + 0.5));
        for (let y = origin[1]; y < origin[1] + cells * side; y += side)
            for (let x = origin[0]; x < origin[0] + cells * side; x += side) {
                const covered = x >= hole[0] && x < hole[0] + hole[2] && y >= hole[1] && y < hole[1] + hole[2];
                if (!covered && x >= 0 && y >= 0 && x < N - 1 && y < N - 1) found.push([level, x, y]);
            }
        hole = [...origin, cells * side];
    }
    return found;
}

function frozen(parent) {
    const target = canvas(parent, 1048, 514), context = target.getContext("2d");
    const row = element(parent, "label"), box = element(row, "input"), told = element(parent, "pre");
    box.type = "checkbox";
    row.append(" freeze the eye: the levels stay, the cross moves");
    let eye = [130, 120], chosen = eye;
    function draw() {
        if (!box.checked) chosen = eye;
        context.clearRect(0, 0, 1048, 514);
        land(context, 0, 0, 514);
        land(context, 534, 0, 514);
        const clipmap = rings(chosen, 24, 5);
        context.strokeStyle = "rgba(160, 20, 20, 0.8)";
        context.lineWidth = 0.7;
        context.beginPath();
        for (const [level, x, y] of clipmap) context.rect(2 * x, 2 * y, 2 ** (level + 1), 2 ** (level + 1));
        context.stroke();
        const tree = leaves((k, i, j) => {
            const { side, nodes, largest } = levels[k];
            const away = [i, j].map((v, axis) => Math.max(v * side - chosen[axis], chosen[axis] - (v + 1) * side, 0));
            return largest[j * nodes + i] > 0.06 * (8 + Math.hypot(...away));
        });
        outline(context, tree, 534, 2);
        context.fillStyle = "#06c";
        for (const x of [0, 534]) {
            context.fillRect(x + 2 * eye[0] - 9, 2 * eye[1] - 1.5, 18, 3);
            context.fillRect(x + 2 * eye[0] - 1.5, 2 * eye[1] - 9, 3, 18);
        }
        told.textContent = `left, a clipmap by distance alone: ${clipmap.length} squares; right, a quadtree by error over distance: ${tree.length} leaves`;
        parent.dataset.leaves = tree.length;
        parent.dataset.eye = eye.map(Math.round);
    }
    const move = (event) => {
        if (!event.buttons && event.type === "pointermove") return;
        const [x, y] = place(event, target);
        eye = [Math.max(0, Math.min(N - 1, (x > 524 ? x - 534 : x) / 2)), Math.max(0, Math.min(N - 1, y / 2))];
        draw();
    };
    target.addEventListener("pointerdown", move);
    target.addEventListener("pointermove", move);
    box.addEventListener("change", draw);
    draw();
}

const widgets = { sums, budget, frozen };
for (const parent of document.querySelectorAll(".widget[data-widget]")) widgets[parent.dataset.widget](parent);
