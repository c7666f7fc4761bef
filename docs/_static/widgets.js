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

// A canvas that keys reach; `label` says what is there and which keys it knows.
function canvas(parent, width, tall, label) {
    const found = element(parent, "canvas");
    Object.assign(found, { width, height: tall, tabIndex: 0, title: label });
    found.setAttribute("role", "application");
    found.setAttribute("aria-label", label);
    return found;
}

// What a widget says, to readers of screens as well.
function telling(parent) {
    const found = element(parent, "pre");
    found.setAttribute("role", "status");
    return found;
}

// Call `move` with the direction of an arrow key, and with how far: Shift goes far.
function arrows(target, near, far, move) {
    const ways = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    target.addEventListener("keydown", (event) => {
        const way = ways[event.key];
        if (!way) return;
        event.preventDefault();
        move(...way.map((v) => v * (event.shiftKey ? far : near)), event);
    });
}

const clamp = (value, low, high) => Math.max(low, Math.min(high, value));

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
    const row = element(parent, "label", label + " "), input = element(row, "input"), shown = element(row, "output");
    Object.assign(input, { type: "range", min: low, max: high, step: "any", value });
    input.addEventListener("input", () => changed(Number(input.value)));
    return { row, input, shown };
}

function choice(parent, type, label, changed, name = "") {
    const row = element(parent, "label"), input = element(row, "input");
    Object.assign(input, { type, name });
    row.append(` ${label}`);
    input.addEventListener("change", changed);
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
    const target = canvas(parent, 514, 514, "a box over the map: arrow keys move it, Control and arrow keys change its size, Shift goes far");
    const told = telling(parent);
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
        Object.assign(parent.dataset, { sum, box: [x0, y0, x1, y1] });
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
    arrows(target, 1, 16, (x, y, event) => {
        const fits = [x, y].map((v, i) => clamp(v, -Math.min(from[i], to[i]), N - Math.max(from[i], to[i])));
        if (event.ctrlKey) to = to.map((v, i) => clamp(v + [x, y][i], 0, N));
        else [from, to] = [from, to].map((at) => at.map((v, i) => v + fits[i]));
        draw();
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

// The quadtree within `allowed(side, x, y)`, restricted: leaves with a common edge are within one level.
function balanced(allowed) {
    const splits = levels.map(({ nodes }) => new Uint8Array(nodes * nodes));
    (function refine(k, i, j) {
        const { side, nodes } = levels[k], at = j * nodes + i;
        if (k === 0 || bounds[k][at] <= allowed(side, i * side, j * side)) return;
        splits[k][at] = 1;
        for (const [v, u] of [[0, 0], [0, 1], [1, 0], [1, 1]]) refine(k - 1, 2 * i + u, 2 * j + v);
    })(levels.length - 1, 0, 0);
    for (let k = 1; k + 1 < levels.length; k++) {
        const { nodes } = levels[k];
        for (let j = 0; j < nodes; j++)
            for (let i = 0; i < nodes; i++)
                if (splits[k][j * nodes + i])
                    for (const [v, u] of [[0, 0], [0, 1], [1, 0], [0, -1], [-1, 0]])
                        if (j + v >= 0 && i + u >= 0 && j + v < nodes && i + u < nodes) splits[k + 1][((j + v) >> 1) * (nodes / 2) + ((i + u) >> 1)] = 1;
    }
    return leaves((k, i, j) => splits[k][j * levels[k].nodes + i]);
}

// For each level: the largest error of a node and of all nodes inside it, so that a part of a good node is good.
const bounds = levels.reduce((found, { nodes, largest }) => {
    const below = found.at(-1);
    found.push(below ? largest.map((own, at) => {
        const first = 4 * nodes * Math.floor(at / nodes) + 2 * (at % nodes);
        return Math.max(own, below[first], below[first + 1], below[first + 2 * nodes], below[first + 2 * nodes + 1]);
    }) : largest);
    return found;
}, []);

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
    const controls = element(parent, "div"), told = telling(parent);
    const target = canvas(parent, 900, 514, "the mesh, and the error over triangles of both ways; the sliders choose"), context = target.getContext("2d");
    target.tabIndex = -1; // it has no keys of its own
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
    // Triangles of a curve at an error, between its points by logarithms.
    function needed(all, error) {
        const at = all.findIndex(([, e], i) => i > 0 && Math.min(e, all[i - 1][1]) <= error && error <= Math.max(e, all[i - 1][1]));
        if (at < 0 || !(error > 0)) return NaN;
        const [[n, e], [m, f]] = [all[at - 1], all[at]].map((each) => each.map(Math.log));
        return e === f ? Math.exp(Math.min(n, m)) : Math.exp(n + ((m - n) * (Math.log(error) - e)) / (f - e));
    }
    function mark(n, e, colour) {
        context.fillStyle = colour;
        context.fillRect(across(n) - 4, down(e) - 4, 8, 8);
    }
    // `other` is the way that is not active: it is shown at the same error.
    function draw(found, other, name) {
        context.clearRect(0, 0, 900, 514);
        axes();
        land(context, 0, 0, 514);
        outline(context, found, 0, 2);
        context.lineWidth = 2;
        line(points, "#1f77b4");
        line(tolerances, "#ff7f0e");
        const n = 2 * found.length, e = rms(found), same = needed(other.curve, e);
        mark(n, e, "#c22");
        if (same) mark(same, e, "#777");
        context.fillStyle = "#777";
        context.font = "14px sans-serif";
        context.fillText("rms error in steps of height, over triangles", 560, 507);
        context.fillStyle = "#1f77b4";
        context.fillText("by a price", 760, 65);
        context.fillStyle = "#ff7f0e";
        context.fillText("by a tolerance", 760, 85);
        told.textContent = `${name}: ${n} triangles, rms error ${e.toFixed(3)} steps of height\n` +
            `at this error ${other.name} needs ${same ? Math.round(same) : "unknown"} triangles`;
        Object.assign(parent.dataset, { triangles: n, same: Math.round(same) || 0 });
    }
    const byPrice = { name: "a price", curve: points }, byTolerance = { name: "a tolerance", curve: tolerances };
    // One slider is active; the other shows nothing until it is moved.
    function activate(own, other, value) {
        for (const [each, active] of [[own, true], [other, false]]) {
            each.row.classList.toggle("active", active);
            each.row.classList.toggle("idle", !active);
            each.shown.textContent = active ? ` ${value}, active` : " not active";
        }
        parent.dataset.active = own.row.firstChild.textContent.trim();
    }
    function setTolerance(v) {
        activate(tolerance, most, (2 ** v).toFixed(2));
        draw(within(2 ** v), byPrice, `tolerance ${(2 ** v).toFixed(2)}`);
    }
    function setBudget(v) {
        let low = -40, high = 40;
        for (let step = 0; step < 30; step++) {
            const middle = 0.5 * (low + high);
            if (2 * pruned(2 ** middle).length > 2 ** v) low = middle;
            else high = middle;
        }
        activate(most, tolerance, Math.floor(2 ** v));
        draw(pruned(2 ** high), byTolerance, `at most ${Math.floor(2 ** v)} triangles`);
    }
    const tolerance = slider(controls, "tolerance", -1, 6, 2, setTolerance), most = slider(controls, "budget", 3, 15, 9, setBudget);
    setTolerance(2);
}

// --- Lesson 6: a frozen eye, rings and a quadtree within one tolerance, from above and in 3-D -------------------------

// Squares [level, column, row] of rings around an eye, `cells` a side.
function rings(eye, cells) {
    const found = [];
    let hole = [0, 0, 0];
    for (let level = 0; level < levels.length; level++) {
        const side = 2 ** level, step = 2 * side, origin = eye.map((at) => step * Math.floor((at - (cells * side) / 2) / step + 0.5));
        for (let y = Math.max(origin[1], 0); y < Math.min(origin[1] + cells * side, N - 1); y += side)
            for (let x = Math.max(origin[0], 0); x < Math.min(origin[0] + cells * side, N - 1); x += side) {
                const covered = x >= hole[0] && x < hole[0] + hole[2] && y >= hole[1] && y < hole[1] + hole[2];
                if (!covered) found.push([level, x, y]);
            }
        hole = [...origin, cells * side];
        if (origin.every((at) => at <= 0 && at + cells * side >= N - 1)) break;
    }
    return found;
}

// How many times its tolerance the worst square is off.
function worst(squares, allowed) {
    return Math.max(...squares.map(([k, x, y]) => levels[k].largest[(y >> k) * levels[k].nodes + (x >> k)] / allowed(1 << k, x, y)));
}

// The smallest rings that keep the tolerance: they look at the distance alone, so one rough place makes them all larger.
function ringsWithin(eye, allowed) {
    for (let cells = 8; ; cells += 4) {
        const found = rings(eye, cells);
        if (cells >= 2 * N || found.every((square) => worst([square], allowed) <= 1)) return { cells, found };
    }
}

function frozen(parent) {
    const controls = element(parent, "div"), told = telling(parent);
    const target = canvas(parent, 1048, 514, "rings and quadtree: arrow keys move the eye, in 3-D they turn the land; Shift goes far");
    const context = target.getContext("2d"), halves = [0, 534];
    let eye = [130, 120], chosen = eye, factor = 0.25, turn = 0.6, tilt = 0.6;
    const share = slider(controls, "tolerance", -2.25, 0, Math.log2(factor), (v) => ((factor = 2 ** v), draw()));
    const freeze = choice(controls, "checkbox", "freeze the eye", draw);
    const above = choice(controls, "radio", "from above", draw, "view"), solid = choice(controls, "radio", "in 3-D", draw, "view");
    above.checked = true;
    function allowed(side, x, y) {
        const away = [x, y].map((v, axis) => Math.max(v - chosen[axis], chosen[axis] - v - side, 0));
        return factor * (8 + Math.hypot(...away));
    }
    // The place of a point of the land in a half of the canvas, and its depth; the land turns, the viewer stands.
    function seen(x, y, z) {
        const [s, c, up, flat] = [Math.sin(turn), Math.cos(turn), Math.sin(tilt), Math.cos(tilt)], [p, q] = [x - N / 2, N / 2 - y];
        const u = p * c + q * s, v = q * c - p * s, w = z / 4 - 20, depth = 420 + v * flat - w * up;
        return [257 + (780 * u) / depth, 267 - (780 * (v * up + w * flat)) / depth, depth];
    }
    function relief(squares, left) {
        context.save();
        context.beginPath();
        context.rect(left, 0, 514, 514);
        context.clip();
        context.translate(left, 0);
        context.lineWidth = 0.5;
        context.strokeStyle = "rgba(160, 20, 20, 0.8)";
        const drawn = squares.map(([k, x, y]) => {
            const s = 1 << k, at = [[x, y], [x + s, y], [x + s, y + s], [x, y + s]], h = at.map(([c, r]) => height(c, r));
            const light = clamp(165 + (5 * (h[1] + h[2] - h[0] - h[3] + h[2] + h[3] - h[0] - h[1])) / s, 0, 255);
            const corners = at.map(([c, r], i) => seen(c, r, h[i]));
            return { corners, light, depth: corners[0][2] + corners[2][2] };
        });
        for (const { corners, light } of drawn.sort((one, other) => other.depth - one.depth)) {
            context.fillStyle = `rgb(${light}, ${light}, ${light})`;
            context.beginPath();
            corners.forEach(([x, y], i) => context[i ? "lineTo" : "moveTo"](x, y));
            context.closePath();
            context.fill();
            context.stroke();
        }
        const ground = height(...chosen.map(Math.round)), [x, y] = seen(...chosen, ground), [, top] = seen(...chosen, ground + 160);
        context.fillStyle = "#06c";
        context.fillRect(x - 1.5, top, 3, y - top);
        context.fillRect(x - 6, top - 6, 12, 12);
        context.restore();
    }
    function map(squares, left) {
        land(context, left, 0, 514);
        context.strokeStyle = "rgba(160, 20, 20, 0.8)";
        context.lineWidth = 0.7;
        context.beginPath();
        for (const [k, x, y] of squares) context.rect(left + 2 * x, 2 * y, 2 << k, 2 << k);
        context.stroke();
        context.fillStyle = "#06c";
        context.fillRect(left + 2 * eye[0] - 9, 2 * eye[1] - 1.5, 18, 3);
        context.fillRect(left + 2 * eye[0] - 1.5, 2 * eye[1] - 9, 3, 18);
    }
    function draw() {
        if (!freeze.checked) chosen = eye;
        const { cells, found } = ringsWithin(chosen, allowed), tree = balanced(allowed).map(([k, i, j]) => [k, i << k, j << k]);
        context.clearRect(0, 0, 1048, 514);
        [found, tree].forEach((squares, i) => (solid.checked ? relief : map)(squares, halves[i]));
        share.shown.textContent = ` ${factor.toFixed(3)} × distance`;
        told.textContent = `left, the smallest rings by distance: ${2 * found.length} triangles, ${cells} squares a side\n` +
            `right, a balanced quadtree by errors: ${2 * tree.length} triangles`;
        Object.assign(parent.dataset, { leaves: tree.length, rings: found.length, eye: eye.map(Math.round), turn: [turn, tilt] });
        parent.dataset.worst = [found, tree].map((squares) => worst(squares, allowed));
    }
    function turned(x, y) {
        [turn, tilt] = [turn + x, clamp(tilt + y, 0.2, 1.4)];
        draw();
    }
    function moved(x, y) {
        eye = [clamp(x, 0, N - 1), clamp(y, 0, N - 1)];
        draw();
    }
    let last = [0, 0];
    const move = (event) => {
        if (!event.buttons && event.type === "pointermove") return;
        const [x, y] = place(event, target), before = last;
        last = [x, y];
        if (!solid.checked) moved((x > 524 ? x - 534 : x) / 2, y / 2);
        else if (event.type === "pointermove") turned((x - before[0]) / 200, (y - before[1]) / 200);
    };
    target.addEventListener("pointerdown", move);
    target.addEventListener("pointermove", move);
    arrows(target, 1, 16, (x, y) => (solid.checked ? turned(x / 12, y / 12) : moved(eye[0] + x, eye[1] + y)));
    draw();
}

const widgets = { sums, budget, frozen };
for (const parent of document.querySelectorAll(".widget[data-widget]")) widgets[parent.dataset.widget](parent);
