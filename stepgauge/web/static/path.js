// <path-player data-src="/plan/scene.json?..">: the path in 3D; the probe goes along it with the slider, by itself, or
// to a conflict (buttons with data-piece on the page).
import {draw, fail} from "/static/page.js";

class PathPlayer extends HTMLElement {
  async connectedCallback() {
    const find = name => this.querySelector(name);
    [this.place, this.slider, this.said, this.button, this.faster] =
      [".plot", "[data-time]", "[data-said]", "[data-play]", "[data-faster]"].map(find);
    try {
      const answer = await fetch(this.dataset.src, {headers: {"X-Part": "1"}});
      if (!(answer.headers.get("content-type") || "").includes("json")) return this.place.replaceChildren();
      Object.assign(this, await answer.json());
      this.slider.max = this.steps.time_s.at(-1);
      await draw(this.place, this.figure);
      this.say(0);
    } catch (error) { return fail(this.place, error); }
    this.slider.addEventListener("input", () => { this.stop(); this.show(+this.slider.value); });
    this.button.addEventListener("click", () => this.frame ? this.stop() : this.play());
    this.buttons = [...document.querySelectorAll("button[data-piece]")];
    this.buttons.forEach(one => one.addEventListener("click", () => this.goto(+one.dataset.piece)));
  }
  disconnectedCallback() { this.stop(); if (this.figure) window.Plotly.purge(this.place); }

  // The piece under way at a time, and where the tip is.
  at(time) {
    const ends = this.steps.time_s;
    let low = 0, high = ends.length - 2;
    while (low < high) { const middle = (low + high) >> 1; if (ends[middle + 1] < time) low = middle + 1; else high = middle; }
    const took = ends[low + 1] - ends[low], share = took > 0 ? Math.min(Math.max((time - ends[low]) / took, 0), 1) : 1;
    return [low, ...["x", "y", "z"].map(axis => this.steps[axis][low] + share * (this.steps[axis][low + 1] - this.steps[axis][low]))];
  }
  say(time) {
    const [piece, ...place] = this.at(time), digits = {minimumFractionDigits: 1, maximumFractionDigits: 1};
    const text = value => value.toLocaleString(document.documentElement.lang, digits);
    const name = this.steps.measuring[piece] ? `${this.said.dataset.measuring} ${this.steps.name[piece]}` : this.steps.name[piece];
    this.said.textContent = `${text(time)} s · x ${text(place[0])}  y ${text(place[1])}  z ${text(place[2])} mm · ${name}`;
    return place;
  }
  async show(time) {
    this.wanted = time;
    const place = this.say(time);
    if (this.drawing) return;
    this.drawing = true;
    const moved = ["x", "y", "z"].map((axis, i) => this.tool[axis].map(value => value + place[i]));
    await window.Plotly.restyle(this.place, {x: [moved[0]], y: [moved[1]], z: [moved[2]]}, [this.tool.trace]);
    this.drawing = false;
    if (this.wanted !== time && this.isConnected) this.show(this.wanted);
  }
  goto(piece) {
    this.stop();
    this.slider.value = (this.steps.time_s[piece] + this.steps.time_s[piece + 1]) / 2;
    this.show(+this.slider.value);
    this.look(this.at(+this.slider.value).slice(1));
    this.place.scrollIntoView({block: "nearest"});
  }
  look(place) {  // from near; plotly counts the camera from the middle of the scene, in shares of its aspect
    const scene = this.place._fullLayout.scene, away = {x: 0.25, y: 0.2, z: 0.15};
    const center = Object.fromEntries(["x", "y", "z"].map((axis, i) => {
      const [low, high] = scene[`${axis}axis`].range;
      return [axis, (place[i] - (low + high) / 2) / (high - low) * scene.aspectratio[axis]];
    }));
    const eye = Object.fromEntries(Object.keys(away).map(axis => [axis, center[axis] + away[axis]]));
    window.Plotly.relayout(this.place, {"scene.camera": {center, eye}});
  }
  play() {
    this.button.setAttribute("aria-pressed", "true");
    if (+this.slider.value >= +this.slider.max) this.slider.value = 0;
    let before = performance.now();
    const step = now => {
      const time = Math.min(+this.slider.value + +this.faster.value * (now - before) / 1000, +this.slider.max);
      if (time - +this.slider.value >= +this.slider.step) { this.slider.value = time; before = now; this.show(time); }
      if (time < +this.slider.max) this.frame = requestAnimationFrame(step); else this.stop();
    };
    this.frame = requestAnimationFrame(step);
  }
  stop() { cancelAnimationFrame(this.frame); this.frame = 0; this.button?.setAttribute("aria-pressed", "false"); }
}
customElements.define("path-player", PathPlayer);
