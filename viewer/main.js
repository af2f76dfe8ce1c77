// The player around the stage: list of scenes, timeline, keyboard.
import { readBody, readScene } from "./data.js";
import { Stage } from "./stage.js";

/** This many motions are shown side by side: the one that was chosen and those below it in the list. */
const MOST_BESIDE = 4;
const SPEEDS = [0.1, 0.25, 0.5, 1, 2];
const byId = (id) => document.getElementById(id);
const data = JSON.parse(byId("data").textContent);

function element(tag, className, text) {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text !== undefined) made.textContent = text;
  return made;
}

class Player {
  constructor() {
    this.scenes = data.scenes;
    this.stage = new Stage(byId("canvas"), data.bodies.map(readBody));
    this.playing = true;
    this.speed = 1;
    this.beside = false;
    this.time = 0;
    this.preference = window.matchMedia("(prefers-color-scheme: dark)");
    this.setTheme(this.preference.matches ? "dark" : "light");
    this.list();
    this.buttons();
    this.scrubbing();
    this.keyboard();
    const resize = () => this.stage.resize(byId("view").clientWidth, byId("view").clientHeight);
    resize();
    this.select(0);
    new ResizeObserver(() => {
      resize();
      // A resized canvas is empty, and this frame's turn to draw is over.
      this.stage.draw(this.time);
    }).observe(byId("view"));
    let last = performance.now();
    const tick = (now) => {
      // The first frame's time stamp may lie before `last`.
      this.advance(Math.max(0, Math.min((now - last) / 1000, 0.25)));
      last = now;
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  setTheme(name) {
    this.themeName = name;
    document.documentElement.dataset.theme = name;
    this.stage.theme(name);
  }

  list() {
    byId("count").textContent = this.scenes.length > 1 ? `${this.scenes.length} motions` : "";
    this.items = this.scenes.map((scene, index) => {
      const item = element("button", "item");
      item.type = "button";
      item.append(element("span", "name", scene.title));
      const texts = [...new Set(scene.labels.map((label) => label[2]))].join(", ");
      item.append(element("span", "detail", `${(scene.frames / scene.fps).toFixed(1)} s${texts ? " · " + texts : ""}`));
      item.addEventListener("click", () => this.select(index));
      byId("list").append(item);
      return item;
    });
    document.body.classList.toggle("single", this.scenes.length === 1);
  }

  select(index) {
    this.index = (index + this.scenes.length) % this.scenes.length;
    this.scene = readScene(this.scenes[this.index]);
    this.items.forEach((item, other) => item.setAttribute("aria-current", String(other === this.index)));
    this.items[this.index].scrollIntoView({ block: "nearest" });
    const others = this.beside ? this.scenes.slice(this.index + 1, this.index + MOST_BESIDE) : [];
    byId("title").textContent = this.scene.title;
    this.stage.show(this.scene, others.map(readScene));
    byId("ghost").disabled = this.scene.initial_frames === 0;
    byId("path").disabled = !this.scene.trajectory;
    byId("beside").hidden = this.scenes.length === 1;
    this.time = 0;
    this.track();
  }

  /** The timeline's colored segments. */
  track() {
    const { frames, labels, initial_frames: given, colors } = this.scene;
    const segments = byId("segments");
    segments.replaceChildren();
    const add = (start, stop, text, color, row, className) => {
      const segment = element("div", className, text);
      segment.title = text;
      segment.style.left = `${(100 * start) / frames}%`;
      segment.style.width = `${(100 * (stop - start)) / frames}%`;
      segment.style.top = `${row * 22}px`;
      segment.style.setProperty("--color", color);
      segments.append(segment);
    };
    // Labels that overlap go to further rows.
    const ends = [];
    if (given) add(0, given, "", "var(--given)", 0, "segment given");
    for (const [start, stop, text] of labels) {
      let row = ends.findIndex((end) => end <= start);
      if (row < 0) row = ends.push(0) - 1;
      ends[row] = stop;
      const shown = row === 0 ? Math.max(start, given) : start;
      if (stop > shown) add(shown, stop, text, colors[text], row, "segment");
    }
    byId("timeline").style.height = `${Math.max(ends.length, 1) * 22}px`;
  }

  advance(seconds) {
    const last = this.scene.frames - 1;
    if (this.playing && last > 0) {
      this.time += seconds * this.scene.fps * this.speed;
      if (this.time > last) this.time = this.time - last < 8 ? this.time % last : 0;
    }
    this.stage.draw(this.time);
    this.readout();
  }

  readout() {
    const { frames, fps, labels, initial_frames: given, colors } = this.scene;
    const frame = Math.min(Math.floor(this.time + 1e-6), frames - 1);
    const now = labels.filter(([start, stop]) => start <= frame && frame < stop).map((label) => label[2]);
    const initial = frame < given;
    byId("action").textContent = initial ? "initial motion" : now.join(" + ");
    byId("action").style.setProperty("--color", initial || !now.length ? "var(--given)" : colors[now[0]]);
    byId("action").hidden = !initial && !now.length;
    byId("clock").textContent = `${(this.time / fps).toFixed(2)} / ${((frames - 1) / fps).toFixed(2)} s`;
    byId("frame").textContent = `frame ${frame}`;
    byId("head").style.left = `${(100 * (this.time + 0.5)) / frames}%`;
    const bar = byId("timeline");
    bar.setAttribute("aria-valuemax", frames - 1);
    bar.setAttribute("aria-valuenow", frame);
  }

  play(on) {
    this.playing = on;
    byId("play").dataset.playing = String(on);
    byId("play").setAttribute("aria-label", on ? "Pause" : "Play");
  }

  seek(time) {
    this.time = Math.max(0, Math.min(this.scene.frames - 1, time));
  }

  step(frames) {
    this.play(false);
    this.seek(Math.round(this.time) + frames);
  }

  buttons() {
    byId("play").addEventListener("click", () => this.play(!this.playing));
    for (const speed of SPEEDS) {
      const option = element("option", "", `${speed}×`);
      option.value = speed;
      option.selected = speed === 1;
      byId("speed").append(option);
    }
    byId("speed").addEventListener("change", (event) => (this.speed = Number(event.target.value)));
    const toggle = (id, get, set) => {
      const button = byId(id);
      const show = () => button.setAttribute("aria-pressed", String(get()));
      button.addEventListener("click", () => {
        set(!get());
        show();
      });
      show();
    };
    const { options } = this.stage;
    toggle("ghost", () => options.ghost, (on) => (options.ghost = on));
    toggle("path", () => options.path, (on) => (options.path = on));
    toggle("beside", () => this.beside, (on) => {
      this.beside = on;
      const { time } = this;
      this.select(this.index);
      this.seek(time);
    });
    toggle("follow", () => this.stage.follow, (on) => (this.stage.follow = on));
    byId("reset").addEventListener("click", () => this.stage.frame());
    byId("theme").addEventListener("click", () => this.setTheme(this.themeName === "dark" ? "light" : "dark"));
    this.preference.addEventListener("change", (event) => this.setTheme(event.matches ? "dark" : "light"));
  }

  scrubbing() {
    const bar = byId("timeline");
    const to = (event) => {
      const box = bar.getBoundingClientRect();
      this.seek(Math.floor(((event.clientX - box.left) / box.width) * this.scene.frames));
    };
    let resume = false;
    bar.addEventListener("pointerdown", (event) => {
      bar.setPointerCapture(event.pointerId);
      resume = this.playing;
      this.play(false);
      to(event);
    });
    bar.addEventListener("pointermove", (event) => bar.hasPointerCapture(event.pointerId) && to(event));
    bar.addEventListener("pointerup", () => this.play(resume));
    bar.addEventListener("pointercancel", () => this.play(resume));
  }

  keyboard() {
    const keys = {
      " ": () => this.play(!this.playing),
      ArrowLeft: (event) => this.step(event.shiftKey ? -10 : -1),
      ArrowRight: (event) => this.step(event.shiftKey ? 10 : 1),
      ArrowUp: () => this.select(this.index - 1),
      ArrowDown: () => this.select(this.index + 1),
      Home: () => this.seek(0),
      End: () => this.seek(Infinity),
      b: () => byId("beside").click(),
      f: () => byId("follow").click(),
      r: () => byId("reset").click(),
    };
    window.addEventListener("keydown", (event) => {
      const action = keys[event.key];
      if (!action || event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === "SELECT") return;
      event.preventDefault();
      action(event);
    });
  }
}

try {
  window.player = new Player();
} catch (error) {
  const message = element("p", "failure", `This page needs WebGL, which this browser did not give: ${error.message}`);
  byId("view").replaceChildren(message);
}
