// <chart-view data-src="/address.json">: a chart whose colours are variables of the style sheet. A click on a point
// fetches data-click + its customdata into data-into, or goes there where no data-into says otherwise.
import {ask, draw, fail, put} from "/static/page.js";

const style = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
function coloured(value) {
  if (Array.isArray(value)) return value.map(coloured);
  if (value && typeof value === "object") return Object.fromEntries(Object.entries(value).map(([key, one]) => [key, coloured(one)]));
  if (typeof value !== "string" || !value.startsWith("--")) return value;
  const [name, opacity] = value.split("/"), color = style(name);
  return opacity ? (color.length === 4 ? color.replace(/[^#]/g, "$&$&") : color) + opacity : color;
}

class ChartView extends HTMLElement {
  async connectedCallback() {
    try {
      const answer = await fetch(this.dataset.src, {headers: {"X-Part": "1"}});
      if (!this.isConnected) return;
      if (!(answer.headers.get("content-type") || "").includes("json"))
        return fail(this, new DOMParser().parseFromString(await answer.text(), "text/html").body.textContent.trim());
      const place = document.createElement("div");
      place.className = this.dataset.size ? `plot ${this.dataset.size}` : "plot";
      place.setAttribute("role", "figure");
      place.setAttribute("aria-label", this.dataset.label);
      this.replaceChildren(place);
      await draw(place, coloured(await answer.json()));
      if (this.dataset.click !== undefined) place.on("plotly_click", event => this.go(event.points[0].customdata));
    } catch (error) { fail(this, error); }
  }
  async go(what) {
    if (what === undefined || what === null) return;
    const address = this.dataset.click + encodeURIComponent(what);
    if (!this.dataset.into) return location.assign(address);
    const into = document.querySelector(this.dataset.into);
    try { put(into, await ask(address)); into.scrollIntoView({block: "nearest"}); } catch (error) { fail(into, error); }
  }
}
customElements.define("chart-view", ChartView);

// A slider says its value beside it, in the language of the page.
document.addEventListener("input", event => {
  const said = event.target.type === "range" && event.target.parentElement.querySelector("output");
  if (said) said.textContent = (+event.target.value).toLocaleString(document.documentElement.lang) + " " + said.dataset.unit;
});
