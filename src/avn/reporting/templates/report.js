"use strict";
(() => {
  const read = (id) => JSON.parse(document.getElementById(id).textContent);
  const at = (id) => document.getElementById(id);
  const data = read("data");
  const ACTIONS = ["forward", "backward", "turn left", "turn right", "Stop"];
  const HEADINGS = ["north", "east", "south", "west"];
  let views = null; // read when the first episode is opened
  let shown = null;

  // Enter on a heading sorts by it, as a click does; cells and episodes have buttons.
  document.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    if (event.target.matches("th[tabindex]")) {
      event.preventDefault();
      event.target.click();
    }
  });

  document.querySelectorAll("input[name=by]").forEach((choice) =>
    choice.addEventListener("change", () =>
      at("results").querySelectorAll("td.cell").forEach((cell) => {
        cell.dataset.sort = cell.dataset[choice.value];
      })));

  at("results").addEventListener("click", (event) => {
    const cell = event.target.closest("td.cell");
    if (cell) list(cell);
  });

  function list(cell) {
    document.querySelectorAll("td.chosen").forEach((other) => other.classList.remove("chosen"));
    cell.classList.add("chosen");
    const { run, sound, scene } = cell.dataset;
    const own = data.runs[run];
    const rows = own.episodes.filter((row) =>
      (scene === data.average || row[0] === scene) && (sound === data.all || row[1] === sound));
    rows.sort((one, other) => (one[9] === null) - (other[9] === null)); // playable ones first
    at("episodes-title").textContent =
      `${own.name}, ${sound}, ${scene.replaceAll("_", " ")}: ${rows.length} episodes`;
    const body = at("episode-list").tBodies[0];
    body.replaceChildren(...rows.map((row) => line(row, own)));
    at("episode-list").dataset.run = run;
    at("episode-list").querySelectorAll("th").forEach((th) => th.removeAttribute("aria-sort"));
    at("episodes").hidden = false;
    at("episodes").scrollIntoView({ block: "start" });
  }

  function line(row, run) {
    const [scene, sound, number, metres, sight, doors, outcome, spl, actions, media, place] = row;
    const opens = media !== null || run.paths;
    const mark = media !== null ? "\u266B" : opens ? "\u219D" : "";
    const tr = document.createElement("tr");
    const texts = ["", scene.replaceAll("_", " "), sound, number,
      metres.toFixed(1), sight ? "in sight" : "out of sight", doors,
      outcome.replaceAll("_", " "), spl.toFixed(2), actions];
    texts.forEach((text, index) => {
      const td = document.createElement("td");
      td.textContent = text;
      if (![0, 1, 2, 5, 7].includes(index)) td.className = "number";
      if (index === 0) td.dataset.sort = media === null ? 1 : 0;
      tr.append(td);
    });
    tr.className = opens ? "open" : "closed";
    if (opens) {
      tr.firstChild.append(opener(mark, `open episode ${number} of ${texts[1]}, ${sound}`));
      Object.assign(tr.dataset, { media, place });
    }
    return tr;
  }

  // A button of a row; a click on the row does the same.
  function opener(mark, label) {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "opener";
    button.textContent = mark;
    button.setAttribute("aria-label", label);
    return button;
  }

  at("episode-list").addEventListener("click", (event) => {
    const row = event.target.closest("tr.open");
    if (row) {
      const { media, place } = row.dataset;
      if (media === "null") open(path_only(Number(at("episode-list").dataset.run), Number(place)));
      else open(embedded(Number(media)));
      reveal();
    }
  });

  function reveal() {
    at("episode").scrollIntoView({ block: "start" });
    at("player").focus({ preventScroll: true });
  }

  // Two runs over the episodes that both have.
  let pairs = [];

  function compare() {
    const [one, other] = [Number(at("run-a").value), Number(at("run-b").value)];
    const found = new Map(data.runs[other].episodes.map((row) => [row[13], row]));
    pairs = data.runs[one].episodes.filter((row) => found.has(row[13]))
      .map((row) => [row, found.get(row[13])]);
    // first those that one of them won, and of these the ones with trajectory, views and sound
    const rank = ([a, b]) => 2 * (a[12] === b[12]) + (a[9] === null && b[9] === null);
    pairs.sort((one_pair, other_pair) => rank(one_pair) - rank(other_pair));
    const count = (a, b) => pairs.filter(([x, y]) => x[12] === a && y[12] === b).length;
    const mean = (index) => pairs.reduce((sum, pair) => sum + pair[index][7], 0) / pairs.length;
    const less = 100 * (mean(0) - mean(1));
    at("compared").textContent = pairs.length
      ? `${pairs.length} common episodes. Only A succeeds: ${count(1, 0)}. Only B: ${count(0, 1)}. `
        + `Both: ${count(1, 1)}. Neither: ${count(0, 0)}. Mean SPL of A less that of B over the `
        + `episodes: ${less < 0 ? "\u2212" : "+"}${Math.abs(less).toFixed(1)} points.`
      : "These runs have no episode in common: other apartments, sounds, seeds or starts.";
    at("tested").textContent = data.comparisons[`${one}-${other}`] ?? "";
    show_pairs();
  }

  function show_pairs() {
    const who = at("who").value;
    const shown_pairs = pairs.map((pair, index) => [pair, index])
      .filter(([[a, b]]) => !who || who === `${a[12]}${b[12]}`);
    at("pairs").tBodies[0].replaceChildren(...shown_pairs.map(([pair, index]) => pair_line(pair, index)));
    at("pairs").querySelectorAll("th").forEach((th) => th.removeAttribute("aria-sort"));
  }

  function pair_line([a, b], index) {
    const tr = document.createElement("tr");
    const words = (row) => row[6].replaceAll("_", " ");
    const less = a[7] - b[7];
    const texts = ["", a[0].replaceAll("_", " "), a[1], a[13].split(":").at(-5), a[2], a[3].toFixed(1),
      a[4] ? "in sight" : "out of sight", words(a), words(b), a[7].toFixed(2), b[7].toFixed(2),
      `${less < 0 ? "\u2212" : less > 0 ? "+" : ""}${Math.abs(less).toFixed(2)}`];
    texts.forEach((text, place) => {
      const td = document.createElement("td");
      td.textContent = text;
      if (![0, 1, 2, 6, 7, 8].includes(place)) td.className = "number";
      if (place === 11) td.dataset.sort = less;
      tr.append(td);
    });
    tr.children[7].classList.toggle("won", a[12] > b[12]);
    tr.children[8].classList.toggle("won", b[12] > a[12]);
    const runs = [at("run-a").value, at("run-b").value];
    const opens = [a, b].some((row, place) => row[9] !== null || data.runs[runs[place]].paths);
    tr.firstChild.dataset.sort = opens ? 0 : 1;
    tr.className = opens ? "open" : "closed";
    tr.dataset.pair = index;
    if (opens) {
      const mark = a[9] !== null || b[9] !== null ? "\u266B" : "\u219D";
      tr.firstChild.append(opener(mark, `open episode ${a[2]} of ${texts[1]}, ${a[1]}`));
    }
    return tr;
  }

  function open_pair([a, b]) {
    const runs = [Number(at("run-a").value), Number(at("run-b").value)];
    const own = [a, b].map((row, place) => {
      if (row[9] !== null) return embedded(row[9]);
      return data.runs[runs[place]].paths ? path_only(runs[place], row[10]) : null;
    });
    const [first, second] = own[0] ? own : [own[1], null];
    if (second) {
      // each is the other's companion, whether embedded or a path alone
      first.companions = [first, second];
      second.companions = first.companions;
    }
    open(first);
    reveal();
  }

  if (at("pairs")) {
    at("run-b").value = at("run-b").options.length > 1 ? 1 : 0;
    ["run-a", "run-b"].forEach((id) => at(id).addEventListener("change", compare));
    at("who").addEventListener("change", show_pairs);
    at("pairs").addEventListener("click", (event) => {
      const row = event.target.closest("tr.open");
      if (row) open_pair(pairs[Number(row.dataset.pair)]);
    });
    compare();
  }

  at("player").addEventListener("keydown", (event) => {
    if (event.target.matches("input, audio, select") || !shown) return;
    const last = shown.own.path.length - 1;
    const to = { ArrowLeft: shown.step - 1, ArrowRight: shown.step + 1, Home: 0, End: last }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    go(to);
  });

  const embedded = (media) => ({ media, ...read(`episode-${media}`) });

  // An episode of which only the path is embedded.
  function path_only(run, place) {
    const { plan, states } = read(`paths-${run}`)[place];
    const [scene, sound, number, metres, , , outcome, spl, actions] = data.runs[run].episodes[place];
    const cells = data.plans[plan].cells;
    const goals = [cells[data.runs[run].episodes[place][11]]];
    const path = states.map((state) => [...cells[state >> 2], state & 3]);
    const end = `${outcome.replaceAll("_", " ")}, SPL ${spl.toFixed(2)}, ${actions} actions`;
    const title = `${scene}, ${sound}, episode ${number}: source ${metres.toFixed(1)} m away`;
    return { run, plan, title, goals, path, outcome: end, source_estimates: null, belief: null, memory: null,
      twins: [], media: null };
  }

  function open(own) {
    views = views ?? read("views");
    const plan = data.plans[own.plan];
    const others = own.companions ? own.companions.filter((other) => other !== own)
      : own.twins.filter((twin) => twin !== own.media).map(embedded);
    shown = { own, plan, ghosts: others };
    at("senses").classList.toggle("silent", !own.sound);
    at("episode").hidden = false;
    at("episode-title").textContent = own.title;
    const all = own.companions
      ?? own.twins.map((twin) => (twin === own.media ? own : others[own.twins.filter((t) => t !== own.media).indexOf(twin)]));
    at("twins").replaceChildren(...all.map(choose));
    at("plan-image").src = plan.image;
    at("plan-image").alt = `floor plan with the source and the path of ${data.runs[own.run].name}: ${own.title}`;
    at("drawing").setAttribute("viewBox", `0 0 ${plan.width} ${plan.height}`);
    at("belief-choice").hidden = !own.belief;
    shown.belief = own.belief &&
      Uint8Array.from(atob(own.belief.free), (letter) => letter.charCodeAt(0));
    at("step").max = own.path.length - 1;
    if (own.sound) at("sound").src = own.sound;
    else at("sound").removeAttribute("src");
    step(0);
  }

  function choose(own) {
    const button = document.createElement("button");
    const swatch = document.createElement("i");
    swatch.className = "swatch";
    swatch.style.background = data.runs[own.run].colour;
    button.append(swatch, `${data.runs[own.run].name}: ${own.outcome}`);
    button.setAttribute("aria-pressed", String(own === shown.own));
    button.addEventListener("click", () => open(own));
    return button;
  }

  // Convert east and north in metres to units of the drawing, south at the bottom.
  const spot = ([x, y]) => [x - shown.plan.left, shown.plan.top - y];

  function svg(tag, attributes) {
    const node = document.createElementNS("http://www.w3.org/2000/svg", tag);
    Object.entries(attributes).forEach(([key, value]) => node.setAttribute(key, value));
    return node;
  }

  function polyline(path, colour, width) {
    const points = path.map((place) => spot(place).join(",")).join(" ");
    return svg("polyline", { points, fill: "none", stroke: colour, "stroke-width": width,
      "stroke-linejoin": "round", "stroke-linecap": "round" });
  }

  function step(index) {
    const { own } = shown;
    shown.step = index;
    at("step").value = index;
    const [x, y, heading] = own.path[index];
    if (own.views) {
      at("view").src = views[own.views[index]];
      at("view").alt = `view of the agent at step ${index}, facing ${HEADINGS[heading]}`;
    }
    const last = own.path.length - 1;
    const bump = own.collided?.[index] ? ", collision" : "";
    const next = own.action && index < last ? `; next: ${ACTIONS[own.action[index]]}` : "";
    const end = index === last ? `; ${own.outcome}` : "";
    at("caption").textContent =
      `step ${index} of ${last}, facing ${HEADINGS[heading]}${bump}${next}${end}`;
    const colour = data.runs[own.run].colour;
    const marks = shown.ghosts.map((ghost) => polyline(ghost.path, data.runs[ghost.run].colour, 0.03));
    if (own.memory) marks.unshift(...recalled(index));
    marks.push(polyline(own.path, colour, 0.03), polyline(own.path.slice(0, index + 1), colour, 0.09));
    const [ax, ay] = spot([x, y]);
    if (own.source_estimates) {
      const [hx, hy] = spot(own.source_estimates[index]);
      marks.push(svg("line", { x1: ax, y1: ay, x2: hx, y2: hy, stroke: "#101820",
        "stroke-width": 0.03, "stroke-dasharray": "0.08 0.08" }));
      marks.push(svg("path", { d: "M-.2 0H.2M0-.2V.2", stroke: "#101820", "stroke-width": 0.11,
        transform: `translate(${hx} ${hy})`, id: "source-estimate" }));
    }
    const [gx, gy] = spot(own.goals[Math.min(index, own.goals.length - 1)]);
    const star = [...Array(10).keys()].map((corner) => {
      const angle = Math.PI * corner / 5;
      const far = corner % 2 ? 0.1 : 0.25;
      return `${gx + far * Math.sin(angle)},${gy - far * Math.cos(angle)}`;
    });
    marks.push(svg("polygon", { points: star.join(" "), fill: "#ffb000", stroke: "black",
      "stroke-width": 0.02 }));
    marks.push(svg("polygon", { points: "0,-.27 .2,.2 -.2,.2", fill: "white", stroke: colour,
      "stroke-width": 0.07, transform: `translate(${ax} ${ay}) rotate(${90 * heading})`,
      id: "agent" }));
    at("drawing").replaceChildren(...marks);
    believe(index);
  }

  // Draw the exploration walk in memory, and the entries most similar to the current view.
  function recalled(index) {
    const entries = own().entries[Math.min(index, own().entries.length - 1)];
    const dots = entries.map((entry, rank) => {
      const [cx, cy] = spot(entry);
      return svg("circle", { cx, cy, r: rank ? 0.08 : 0.15, fill: "#7b3294", class: "entry" });
    });
    return [polyline(own().walk, "#7a7a7a", 0.025), ...dots];
  }
  const own = () => shown.own.memory;

  function believe(index) {
    const { own, plan, belief } = shown;
    const canvas = at("belief");
    canvas.hidden = !belief || !at("show-belief").checked;
    at("plan").classList.toggle("believed", !canvas.hidden);
    if (canvas.hidden) return;
    const { width, height, left, top } = own.belief;
    const size = width * height;
    const from = Math.min(index, own.action.length - 1) * size;
    [canvas.width, canvas.height] = [width, height];
    const image = new ImageData(width, height);
    for (let row = 0; row < height; row += 1) {
      for (let column = 0; column < width; column += 1) {
        const free = belief[from + (height - 1 - row) * width + column] / 255 - 0.5;
        const [r, g, b] = free > 0 ? [0, 121, 107] : [140, 81, 10];
        image.data.set([r, g, b, Math.min(255, Math.abs(free) * 510)], 4 * (row * width + column));
      }
    }
    canvas.getContext("2d").putImageData(image, 0, 0);
    Object.assign(canvas.style, {
      left: `${100 * (left - plan.left) / plan.width}%`,
      top: `${100 * (plan.top - top) / plan.height}%`,
      width: `${50 * width / plan.width}%`, // squares of half a metre
      height: `${50 * height / plan.height}%`,
    });
  }

  const within = (index) => Math.max(0, Math.min(index, shown.own.path.length - 1));
  function go(index) {
    step(within(index));
    if (shown.own.sound) at("sound").currentTime = within(index) + 0.001;
  }
  at("step").addEventListener("input", () => go(Number(at("step").value)));
  at("back").addEventListener("click", () => go(shown.step - 1));
  at("on").addEventListener("click", () => go(shown.step + 1));
  at("show-belief").addEventListener("change", () => believe(shown.step));
  function follow() {
    if (!shown?.own.sound) return;
    const now = within(Math.floor(at("sound").currentTime));
    if (now !== shown.step) step(now);
    if (!at("sound").paused) requestAnimationFrame(follow);
  }
  at("sound").addEventListener("play", follow);
  at("sound").addEventListener("seeked", follow);
})();
