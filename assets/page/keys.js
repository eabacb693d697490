// Keys, links and history of a document. Runs whenever another tab is shown; the first time it
// begins to listen.
const PROJECTOR = {size: "20px", width: 1.6, scale: 1.5}
const WIDE = {from: 1700, size: "14px", width: 1.2, scale: 1.2}
const WRITES = "input:not([type=checkbox]):not([type=range]), textarea, [contenteditable=true]"
const MOVES = `${WRITES}, [role=slider], input[type=range], [role=combobox], [role=option],
  [role=menuitem], [role=tab]`
const KEYS = {
  ArrowRight: "step", ArrowLeft: "step_back", r: "reset", R: "reset",
  ",": "ramp_back", ".": "ramp_next", b: "swipe", B: "swipe", Delete: "delete", p: "pin", P: "pin",
}
const SIZES = [
  "axis_label_text_font_size", "major_label_text_font_size", "title_text_font_size",
  "text_font_size",
]

function all_models() {
  return [...Bokeh.documents[0].all_models]
}

function enlarge(model, look, kept) {
  const set = (name, value) => {
    kept.push([model, name, model[name]])
    // Of this browser alone: the program is not told.
    model.setv({[name]: value}, {sync: false})
  }
  for (const name of SIZES) {
    if (typeof model[name] === "string") set(name, look.size)
  }
  const width = model.line_width?.value
  if (typeof width === "number") set("line_width", {value: width * look.width})
}

function enlarge_all(figure, look, kept) {
  for (const part of figure.references()) {
    if (/Axis$|^Title$|^Line$|^Segment$|^Scatter$|^ColorBar$/.test(part.type)) {
      enlarge(part, look, kept)
    }
  }
}

function project() {
  const mode = window.vsep_projector
  const page = all_models().find((model) => model.class_name === "Page")
  if (mode) {
    for (const [model, name, value] of mode.kept) model.setv({[name]: value}, {sync: false})
    if (page) page.data.sidebar_open = mode.sidebar
    document.documentElement.style.setProperty("--vsep-scale", window.vsep_scale)
    if (document.fullscreenElement) document.exitFullscreen()
    window.vsep_projector = null
    return
  }
  const kept = []
  const figures = all_models().filter((model) => model.type === "Figure")
  for (const figure of figures) {
    enlarge_all(figure, PROJECTOR, kept)
  }
  window.vsep_projector = {kept, sidebar: page?.data.sidebar_open}
  if (page) page.data.sidebar_open = false
  document.documentElement.style.setProperty("--vsep-scale", PROJECTOR.scale)
  document.documentElement.requestFullscreen?.().catch(() => {})
}

function press(name) {
  pressed.data = {name: [name], number: [pressed.data.number[0] + 1]}
}

// To another page of the document: a link, or where the browser's history goes.
function go(address) {
  const place = new URL(address, location.href)
  went.data = {
    page: [place.pathname.split("/").pop() || "./"], search: [place.search],
    number: [went.data.number[0] + 1],
  }
}

function taken(event) {
  if (!shown.data.has_scene[0] && !/^[fF?]$/.test(event.key)) return false
  const at = event.composedPath()[0]
  const is = (selector) => at instanceof Element && at.closest(selector) !== null
  if (event.ctrlKey || event.metaKey || event.altKey || is(WRITES) || is("[role=dialog]")) return false
  if (event.key === " ") {
    if (is(`${MOVES}, button, a, input`)) return false
    press("toggle")
  } else if (event.key.startsWith("Arrow")) {
    if (!(event.key in KEYS) || is(MOVES)) return false
    press(KEYS[event.key])
  } else if (event.key in KEYS) {
    press(KEYS[event.key])
  } else if (/^[1-9]$/.test(event.key)) {
    press(`experiment ${event.key}`)
  } else if (event.key === "f" || event.key === "F") {
    project()
  } else if (event.key === "?") {
    open_help()
  } else {
    return false
  }
  return true
}

function open_help() {
  const roots = [document]
  while (roots.length > 0) {
    const root = roots.pop()
    for (const element of root.querySelectorAll("*")) {
      if (element.tagName === "BUTTON" && /^Help/.test(element.getAttribute("aria-label") ?? element.innerText)) {
        element.click()
        return
      }
      if (element.shadowRoot) roots.push(element.shadowRoot)
    }
  }
}

if (!window.vsep_keys) {
  window.vsep_keys = true
  window.vsep_scale = window.innerWidth >= WIDE.from ? WIDE.scale : 1
  if (window.innerWidth >= WIDE.from) {
    document.documentElement.style.setProperty("--vsep-scale", WIDE.scale)
  }
  window.addEventListener("click", (event) => {
    const at = event.composedPath()[0]
    const named = at instanceof Element ? at.closest("[data-press], [data-go]") : null
    if (!named || named.disabled) return
    if (named instanceof HTMLAnchorElement) {
      // Whoever wants a link in another window gets it there.
      if (event.button || event.ctrlKey || event.metaKey || event.shiftKey || event.altKey) return
      event.preventDefault()
    }
    if ("go" in named.dataset) go(named.href)
    else press(named.dataset.press)
  })
  window.addEventListener("popstate", () => go(location.href))
  window.addEventListener("vsep-go", (event) => go(event.detail))
  window.addEventListener("keydown", (event) => {
    if (taken(event)) event.preventDefault()
  })
}
document.title = shown.data.title[0]
if (window.innerWidth >= WIDE.from) {
  window.vsep_enlarged ??= new WeakSet()
  for (const figure of all_models().filter((model) => model.type === "Figure")) {
    if (window.vsep_enlarged.has(figure)) continue
    window.vsep_enlarged.add(figure)
    enlarge_all(figure, WIDE, [])
  }
}
