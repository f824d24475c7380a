// What all pages share: parts of a page that are fetched, forms that answer in place, figures from JSON.
// A form with data-into="SELECTOR" puts its answer there; data-load="/address" is fetched when it appears, and again
// after data-every seconds; data-go="/address" leads there; data-plot="/address.json" is drawn by plotly. A button with
// formaction and data-answers="SELECTOR" does something else with the same form. What is wrong is judged by the server alone.

const PART = {"X-Part": "1"};
export const by = id => document.getElementById(id);

export async function ask(address, options = {}) {
  const answer = await fetch(address, {...options, headers: {...PART, ...options.headers}});
  const text = await answer.text();
  if (!answer.ok && !(answer.headers.get("content-type") || "").includes("text/html")) throw new Error(text || answer.statusText);
  return text;
}

export function put(target, text) {
  const holder = document.createElement("template");
  holder.innerHTML = text;
  const parts = [...holder.content.children];
  const focused = target.contains(document.activeElement) && document.activeElement.name;
  target.replaceChildren(holder.content);
  parts.forEach(wire);
  if (focused) target.querySelector(`[name="${CSS.escape(focused)}"]`)?.focus();
  target.setAttribute("aria-busy", "false");
}

export function fail(target, error) {
  const line = document.createElement("p");
  line.className = "error";
  line.setAttribute("role", "alert");
  line.textContent = String(error.message || error);
  target.replaceChildren(line);
  target.setAttribute("aria-busy", "false");
}

async function load(place) {
  const asked = place.asked = {};
  try {
    const text = await ask(place.dataset.load);
    if (!place.isConnected || place.asked !== asked) return;
    if (place.dataset.every) replace(place, text); else put(place, text);
  } catch (error) { if (place.isConnected) fail(place, error); }
}

function replace(place, text) {
  const holder = document.createElement("template");
  holder.innerHTML = text;
  const made = [...holder.content.children];
  const focused = place.contains(document.activeElement) && document.activeElement.tagName === "BUTTON";
  place.replaceWith(...made);
  made.forEach(wire);
  if (focused) made[0]?.querySelector("button")?.focus();
}

function show(place) {  // the answer to a click is where one looks
  const said = place.querySelector("[role=alert], [role=status], .error, .good, .warning");
  if (!said) return;
  const box = said.getBoundingClientRect();
  if (box.top < 0 || box.bottom > innerHeight) said.scrollIntoView({block: "center"});
}

async function submit(event) {
  const form = event.target, button = event.submitter, selector = button?.dataset.answers || form.dataset.into;
  const into = selector && (form.closest(selector) || document.querySelector(selector));
  if (!into) return;
  event.preventDefault();
  into.setAttribute("aria-busy", "true");
  const data = new FormData(form);
  if (event.submitter?.name) data.append(event.submitter.name, event.submitter.value);
  const get = form.method === "get", action = button?.hasAttribute("formaction") ? button.formAction : form.action;
  const address = get ? action.split("?")[0] + "?" + new URLSearchParams(data) : action;
  const asked = into.asked = {};  // only the answer to the last question counts
  try {
    const text = await ask(address, get ? {} : {method: "POST", body: data});
    if (into.asked === asked) put(into, text);
  } catch (error) { if (into.asked === asked) fail(into, error); }
  if (button) show(into);
}

function forget(event) {  // what was wrong with a form is not known of one that has changed; what it asks stays, with the answers
  const form = event.currentTarget, own = [form.dataset.into, ...[...form.querySelectorAll("button[data-answers]")].map(one => one.dataset.answers)];
  own.forEach(one => document.querySelector(one)?.querySelectorAll(".refused, [role=alert]").forEach(said => said.remove()));
  const into = event.target.type === "file" && document.querySelector(form.dataset.into);
  if (into && into.dataset.reading) say(into, into.dataset.reading);  // what was found in another file is none of this one
}

function say(target, text) {
  const line = document.createElement("p");
  line.className = "quiet";
  line.setAttribute("role", "status");
  line.textContent = text;
  target.replaceChildren(line);
}

// What is chosen in a list stands below it, too, where its box is too narrow for it.
function tell(list) {
  const text = list.selectedOptions[0]?.text || "", look = getComputedStyle(list), pen = document.createElement("canvas").getContext("2d");
  pen.font = look.font;
  const room = list.clientWidth - parseFloat(look.paddingLeft) - parseFloat(look.paddingRight) - 26;  // the arrow
  let place = list.nextElementSibling;
  if (!place?.classList.contains("chosen")) list.after(place = Object.assign(document.createElement("small"), {className: "chosen quiet"}));
  place.textContent = list.clientWidth && pen.measureText(text).width > room ? text : "";
}

// What was typed and chosen stays when the page comes back in another language or look, or with the hints of another choice.
const fields = () => [...document.querySelectorAll("main [name]")].filter(one => one.type !== "hidden" && one.type !== "file");
const state = one => one.options ? [...one.options].map(o => o.selected) : one.type === "checkbox" || one.type === "radio" ? one.checked : one.value;
function keep(focused) { sessionStorage.setItem("kept", JSON.stringify([location.pathname, fields().map(one => [one.name, changed(one) ? state(one) : null]), focused])); }
function restore() {
  const [path, values, focused] = JSON.parse(sessionStorage.getItem("kept") || "[]");
  sessionStorage.removeItem("kept");
  if (path !== location.pathname) return;
  if (focused) document.querySelector(`main [name="${CSS.escape(focused)}"]`)?.focus();
  for (const one of fields()) {
    const place = values.findIndex(([name]) => name === one.name), [, value] = place < 0 ? [] : values.splice(place, 1)[0];
    if (value === undefined || value === null) continue;
    if (one.options) [...one.options].forEach((o, n) => { o.selected = value[n]; });
    else if (one.type === "checkbox" || one.type === "radio") one.checked = value;
    else one.value = value;
  }
}

// A page to which another one led, because something is stated there, leads back to it.
const named = path => document.querySelector(`nav a[href="${CSS.escape(path)}"]`)?.textContent;
function lead(event) { sessionStorage.setItem("led", JSON.stringify([event.currentTarget.pathname, location.pathname, location.search])); }
function leadBack() {
  const [there, from, asked] = JSON.parse(sessionStorage.getItem("led") || "[]");
  if (from === location.pathname) sessionStorage.removeItem("led");
  if (there !== location.pathname || !named(from)) return;
  const place = by("back"), link = place.firstElementChild;
  link.href = from + asked;
  link.textContent += ` ${named(from)}`;
  place.hidden = false;
}

const first = one => !one.multiple && ![...one.options].some(o => o.defaultSelected);  // chosen where no choice is
const changed = one => one.options ? [...one.options].some((o, n) => o.selected !== (o.defaultSelected || n === 0 && first(one)))
  : one.type === "checkbox" || one.type === "radio" ? one.checked !== one.defaultChecked : one.type !== "hidden" && (one.value || "") !== (one.defaultValue || "");
// before the page was ready, or kept by the browser

export function wire(root) {
  const all = selector => [...(root.matches?.(selector) ? [root] : []), ...root.querySelectorAll(selector)];
  all("form[data-into]").forEach(form => { form.noValidate = true; form.addEventListener("submit", submit); form.addEventListener("input", forget); });
  all("form.preferences").forEach(form => form.addEventListener("submit", () => keep()));
  all("form[data-reloads]").forEach(form => {
    const one = form.elements[form.dataset.reloads];
    one.addEventListener("change", () => { keep(one.name); location.assign(`?${new URLSearchParams({[one.name]: one.value})}`); });
  });
  all("select[data-submits]").forEach(one => one.addEventListener("change", () => one.form.requestSubmit()));
  all("select[data-fetches]").forEach(one => one.addEventListener("change", async () => {
    const into = document.querySelector(one.dataset.answers);
    try { put(into, await ask(one.dataset.fetches + encodeURIComponent(one.value))); } catch (error) { fail(into, error); }
  }));
  all("[data-prints]").forEach(one => one.addEventListener("click", () => {
    const paper = document.querySelector(one.dataset.prints || null);
    (paper?.contentWindow || window).print();
  }));
  all("[data-load]").forEach(one => one.dataset.every ? setTimeout(() => one.isConnected && load(one), 1000 * one.dataset.every) : load(one));
  all("[data-follows]").forEach(form => {  // a form that answers to every change, after a moment of rest
    let wait;
    form.addEventListener("input", () => { clearTimeout(wait); wait = setTimeout(() => form.requestSubmit(), 250); });
    if ("now" in form.dataset || [...form.elements].some(changed)) form.requestSubmit();
  });
  all(".scroll").forEach(one => { one.tabIndex = 0; });  // what scrolls must be reached by keyboard
  all("label > select").forEach(one => { tell(one); one.addEventListener("change", () => tell(one)); });
  all("a[data-leads]").forEach(one => one.addEventListener("click", lead));
  all("[data-go]").forEach(one => location.assign(one.dataset.go));
  all("[data-plot]").forEach(one => plot(one));
}

// Figures take their colours from the style sheet, so that they follow the look of the page.
const style = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
export const line = n => style(`--line-${n}`);
const AXIS = () => ({gridcolor: style("--plot-grid"), zerolinecolor: style("--quiet"), linecolor: style("--rule"), color: style("--ink"), exponentformat: "power"});
export function looks(layout = {}) {
  const axes = Object.fromEntries(Object.keys(layout).filter(key => /^[xy]axis\d*$/.test(key)).map(key => [key, {...AXIS(), ...layout[key]}]));
  const scene = layout.scene && {...layout.scene, ...Object.fromEntries(["xaxis", "yaxis", "zaxis"].map(key => [key,
    {...AXIS(), backgroundcolor: style("--ground"), ...layout.scene[key]}]))};
  const separators = document.documentElement.lang === "de" ? ",\u202f" : ".\u202f";
  return {...layout, separators, ...axes, ...(scene ? {scene} : {}), template: "none", paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: {family: getComputedStyle(document.body).fontFamily, size: 13, color: style("--ink")},
    modebar: {bgcolor: "rgba(0,0,0,0)", color: style("--quiet"), activecolor: style("--blue")},
    hoverlabel: {bgcolor: style("--raised"), font: {color: style("--ink")}, bordercolor: style("--rule")}};
}
export const CONFIG = {responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d"]};

export async function draw(place, figure) {
  await window.Plotly.react(place, figure.data, looks(figure.layout), CONFIG);
  place.dataset.ready = String(+(place.dataset.ready || 0) + 1);  // how often it was drawn
}

export async function move(place, y, trace) {
  await window.Plotly.restyle(place, {y: [y]}, [trace]);  // the others stay as they are drawn
  place.dataset.ready = String(+(place.dataset.ready || 0) + 1);
}

export async function plot(place, address = place.dataset.plot) {
  try {
    const answer = await fetch(address, {headers: PART});
    if (!(answer.headers.get("content-type") || "").includes("json"))
      return fail(place, new DOMParser().parseFromString(await answer.text(), "text/html").body.textContent.trim());
    await draw(place, await answer.json());
  } catch (error) { fail(place, error); }
}

const begin = () => { restore(); leadBack(); wire(document); };
if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", begin); else begin();
