// Residuals of a diagnosis: findings that are switched off give their share back, and the figure and its rms follow.
import {by, draw, fail, line, move} from "/static/page.js";

const place = by("diagnosis"), words = place?.dataset;
const MOST = 1500;  // readings in the figure: more are not told apart by eye
let scene;

const off = () => [...document.querySelectorAll("[data-finding]")].filter(one => !one.checked).map(one => scene.findings[+one.dataset.finding]).filter(one => one?.share);
const rms = values => Math.sqrt(values.reduce((sum, one) => sum + one * one, 0) / Math.max(values.length, 1));
const digits = value => value.toLocaleString(document.documentElement.lang, {minimumFractionDigits: 2, maximumFractionDigits: 2}).replace("-", "−");

function told() {
  const rows = scene.rows, chosen = by("placement").value, shares = off().map(one => one.share);
  const some = rows.row.map((_, i) => i).filter(i => chosen === "" || rows.placement[i] === +chosen);
  const now = some.map(i => shares.reduce((sum, share) => sum + share[i], rows.after[i])), before = some.map(i => rows.before[i]);
  const used = some.map((i, k) => rows.used[i] ? k : -1).filter(k => k >= 0);
  by("now").textContent = digits(rms(used.map(k => now[k])));
  by("before").textContent = digits(rms(used.map(k => before[k])));
  by("noise").textContent = digits(scene.noise);
  // Marks are drawn as SVG: plotly's faster way makes programs out of text, which the page's policy forbids.
  const step = Math.ceil(some.length / MOST), drawn = some.map((_, k) => k).filter(k => k % step === 0);
  by("thinned").hidden = step === 1;
  return {rows, some, now, before, drawn};
}

function show() {
  const {rows, some, now, before, drawn} = told();
  const against = scene.against[+by("against").value], x = some.map(i => against.values[i]);
  const label = drawn.map(k => some[k]).map(i => `${rows.label[i]}, cycle ${rows.cycle[i]}`);
  const points = (y, name, color, size) => ({x: drawn.map(k => x[k]), y: drawn.map(k => y[k]), name, text: label, mode: "markers",
    marker: {size, color, opacity: .75, symbol: drawn.map(k => rows.used[some[k]] ? "circle" : "x")}, hovertemplate: `%{text}<br>%{y:.3f}<extra>${name}</extra>`});
  const level = y => ({type: "line", xref: "paper", x0: 0, x1: 1, y0: y, y1: y, line: {color: line(3), width: 1, dash: "dash"}});
  return draw(by("residuals"), {data: [points(before, words.without, line(2), 5), points(now, words.with, line(1), 6)],
    layout: {xaxis: {title: {text: against.name.replaceAll("<", "&lt;")}}, yaxis: {title: {text: `${words.residual} (${scene.unit})`}}, hovermode: "closest",
      shapes: [level(2 * scene.noise), level(-2 * scene.noise)], margin: {l: 62, r: 12, t: 30, b: 46}, legend: {orientation: "h", y: 1.02, yanchor: "bottom", x: 0}}});
}

function switched() {
  const {now, drawn} = told();
  return move(by("residuals"), drawn.map(k => now[k]), 1);
}

const option = (text, value) => { const made = document.createElement("option"); made.textContent = text; made.value = value; return made; };

async function begin() {
  const answer = await fetch(words.scene, {headers: {"X-Part": "1"}});
  if (!(answer.headers.get("content-type") || "").includes("json")) throw new Error((new DOMParser().parseFromString(await answer.text(), "text/html")).body.textContent.trim());
  scene = await answer.json();
  by("against").replaceChildren(...scene.against.map((one, i) => option(one.name, i)));
  scene.placements.forEach(one => by("placement").append(option(one.name || one.placement, one.placement)));
  by("placement").parentElement.hidden = scene.placements.length < 2;
  by("against").onchange = by("placement").onchange = show;
  document.querySelectorAll("[data-finding]").forEach(one => {
    one.disabled = !scene.findings[+one.dataset.finding]?.share;
    one.addEventListener("change", switched);
  });
  await show();
}
if (place) begin().catch(error => fail(by("residuals"), error));
