// A measurement as it goes: server-sent events into numbers, buttons and one figure.
import {ask, by, draw, line} from "/static/page.js";

const run = by("run"), words = run.dataset;
const clock = seconds => {
  const s = Math.max(0, Math.round(seconds)), two = n => String(n).padStart(2, "0");
  return `${Math.floor(s / 3600)}:${two(Math.floor(s / 60) % 60)}:${two(s % 60)}`;
};

function status(told) {
  words.state = told.state;
  document.querySelectorAll("[data-when]").forEach(one => { one.hidden = !one.dataset.when.split(" ").includes(told.state); });
  const some = told.done > 0 || Boolean(+by("done").textContent);
  document.querySelectorAll("[data-some]").forEach(one => { one.hidden = !some || (one.dataset.when && !one.dataset.when.split(" ").includes(told.state)); });
  document.querySelectorAll("[data-none]").forEach(one => { one.hidden = some; });
  by("error").hidden = !told.error || told.state !== "failed";
  by("error").textContent = told.error || "";
  if (told.total) {
    by("bar").max = told.total;
    by("bar").value = told.done;
    by("done").textContent = told.done;
    by("total").textContent = told.total;
  }
  const known = told.left_s !== undefined && ["running", "paused"].includes(told.state);
  by("left").textContent = known ? clock(told.left_s) : "–";
  by("ends").textContent = known && told.state === "running" ? new Date(Date.now() + 1000 * told.left_s).toLocaleTimeString(document.documentElement.lang) : "–";
}

function errors(told) {
  const f = told.faces, odd = f.face.map((n, i) => i).filter(i => f.face[i] % 2), even = f.face.map((n, i) => i).filter(i => f.face[i] % 2 === 0);
  const own = (rows, y, s, name, color, symbol) => ({x: rows.map(i => f.nominal_mm[i]), y: rows.map(i => f[y][i]), name, mode: "lines+markers",
    error_y: {type: "data", array: rows.map(i => 2 * (f[s][i] || 0)), thickness: 1, width: 2}, line: {color, width: 1.4}, marker: {symbol, size: 7, color},
    customdata: rows.map(i => f.face[i]), hovertemplate: "%{customdata}: %{x:.1f} mm<br>" + name + " %{y:.2f} µm<extra></extra>"});
  const p = told.points;
  return draw(by("errors"), {data: [
    {x: p.nominal_mm, y: p.error_um, name: words.points, mode: "markers", marker: {size: 4, color: line(3), opacity: .55}, hoverinfo: "skip"},
    own(odd, "xf_um", "sf_um", words.forward, line(1), "triangle-right"), own(even, "xb_um", "sb_um", words.backward, line(2), "triangle-left"),
    {x: f.nominal_mm, y: f.xm_um, name: words.mean, mode: "lines", line: {color: line(4), width: 2}, hoverinfo: "skip"},
  ], layout: {xaxis: {title: {text: words.x}}, yaxis: {title: {text: words.y}}, margin: {l: 60, r: 12, t: 30, b: 46}, legend: {orientation: "h", y: 1.02, yanchor: "bottom", x: 0}, uirevision: "same"}});
}

if (words.events) {
  const source = new EventSource(words.events);
  source.addEventListener("status", event => {
    const told = JSON.parse(event.data);
    status(told);
    if (["done", "failed", "stopped"].includes(told.state)) source.close();
  });
  source.addEventListener("errors", event => errors(JSON.parse(event.data)));
  source.onerror = () => { if (source.readyState === EventSource.CLOSED && !["done", "failed", "stopped"].includes(words.state)) location.reload(); };
}
document.querySelectorAll("form[data-steers]").forEach(form => form.addEventListener("submit", event => {
  event.preventDefault();
  ask(form.action, {method: "POST", body: new FormData(form), redirect: "manual"}).catch(() => {});
}));
